"""The option `--explain CODE`."""

from __future__ import annotations

import click
from click.shell_completion import CompletionItem

from factory.support.console import emit, say


class Code(click.ParamType[str]):
    """The code of a diagnostic."""

    name = "code"

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from factory.support.explanations import codes

        return [CompletionItem(c) for c in codes() if c.lower().startswith(incomplete.lower())]


def tell_code(code: str, as_json: bool) -> None:
    """Prints what a code means, an example that provokes it, and how to mend it. Raises InputError
    for one that there is not."""
    from factory.support.explanations import explain

    found = explain(code)
    if as_json:
        emit({"code": found.code, "title": found.title, "text": found.text})
    else:
        say(f"{found.code}: {found.title}\n\n{found.text}")
