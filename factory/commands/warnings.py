"""The warnings that a command prints."""

from __future__ import annotations

from collections.abc import Sequence

from factory.commands.requests import OutputOptions
from factory.support.console import warn
from factory.support.errors import Diagnostic


def told(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """All warnings; unless `verbose`, those of one cause as one, that counts them, where the first
    of them is."""
    causes: dict[object, list[Diagnostic]] = {}
    for number, warning in enumerate(warnings):
        is_alone = verbose or not warning.many
        causes.setdefault(number if is_alone else warning.many, []).append(warning)
    return [_as_one(alike) if len(alike) > 1 else alike[0] for alike in causes.values()]


def _as_one(alike: list[Diagnostic]) -> Diagnostic:
    return Diagnostic(alike[0].code, f"{len(alike)} {alike[0].many}; list: -v")


def announced(warnings: Sequence[Diagnostic], out: OutputOptions) -> list[dict[str, object]]:
    """Print warnings for people; gives all of them, as the document of `--json` lists them."""
    warn(told(warnings, out.verbose), out.silent)
    return [warning.as_json() for warning in warnings]
