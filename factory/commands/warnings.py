"""The warnings that a command prints."""

from __future__ import annotations

from collections.abc import Sequence

from factory.commands.requests import OutputOptions
from factory.support.console import warn
from factory.support.errors import Diagnostic

SHOWN = 24
"""The most blocked operations that are listed, unless `-v` asks for all."""


def told(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """All warnings. Unless `verbose`: those of one cause as one, that counts them, where the first
    of them is; of blocked operations the first, and how many more there are."""
    if verbose:
        return list(warnings)
    causes: dict[object, list[Diagnostic]] = {}
    blocked = []
    for number, warning in enumerate(warnings):
        if warning.code == "Blocked":
            blocked.append(warning)
        else:
            causes.setdefault(warning.many or number, []).append(warning)
    others = [_as_one(alike) if len(alike) > 1 else alike[0] for alike in causes.values()]
    more = len(blocked) - SHOWN
    if more > 0:
        message = f"and {more} more operations are blocked"
        blocked[SHOWN:] = [Diagnostic("Blocked", message, None, "list: -v")]
    return [*others, *blocked]


def _as_one(alike: list[Diagnostic]) -> Diagnostic:
    return Diagnostic(alike[0].code, f"{len(alike)} {alike[0].many}; list: -v")


def announced(warnings: Sequence[Diagnostic], out: OutputOptions) -> list[dict[str, object]]:
    """Print warnings for people; gives all of them, as the document of `--json` lists them."""
    warn(told(warnings, out.verbose), out.silent)
    return [warning.as_json() for warning in warnings]
