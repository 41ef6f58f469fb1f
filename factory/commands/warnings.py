"""The warnings that a command prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from factory.commands.requests import OutputOptions
from factory.support.console import warn
from factory.support.errors import Diagnostic
from factory.support.order import natural

SHOWN = 24
"""The most blocked operations that are listed, unless `-v` asks for all."""

NAMED = 12
"""The most labels that a line names."""


def told(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """All warnings. Unless `verbose`: those of one cause as one line, that counts them, and names
    what they are about; of blocked operations the first, and how many more there are."""
    if verbose:
        return list(warnings)
    causes: dict[object, list[Diagnostic]] = {}
    blocked = []
    for number, warning in enumerate(warnings):
        if warning.code == "Blocked":
            blocked.append(warning)
        else:
            causes.setdefault(warning.many or number, []).append(warning)
    others = [_as_one(alike) for alike in causes.values()]
    more = len(blocked) - SHOWN
    if more > 0:
        message = f"and {more} more operations are blocked"
        blocked[SHOWN:] = [Diagnostic("Blocked", message, None, "list: -v")]
    return [*others, *blocked]


def _as_one(alike: list[Diagnostic]) -> Diagnostic:
    first, names = alike[0], sorted((one.about for one in alike if one.about), key=natural)
    if not names:
        message = f"{len(alike)} {first.many}; list: -v"
        return Diagnostic(first.code, message) if len(alike) > 1 else first
    if len(alike) == 1:
        place = first.position and replace(first.position, text="")
        return Diagnostic(first.code, f"{first.message}; -v", place)
    listed = f"{', '.join(names[:NAMED])}{', ...' * (len(names) > NAMED)}"
    return Diagnostic(first.code, f"{len(alike)} {first.many}: {listed}; -v")


def announced(warnings: Sequence[Diagnostic], out: OutputOptions) -> list[dict[str, object]]:
    """Print warnings for people; gives all of them, as the document of `--json` lists them."""
    warn(told(warnings, out.verbose), out.silent)
    return [warning.as_json() for warning in warnings]
