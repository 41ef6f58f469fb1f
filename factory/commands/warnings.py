"""The warnings that a command prints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from factory.commands.requests import OutputOptions
from factory.support.console import say, warn
from factory.support.errors import Diagnostic
from factory.support.order import natural

if TYPE_CHECKING:
    from factory.pipeline import Project

LISTED = {"Overlap": (6, "pairs overlap"), "Blocked": (24, "operations are blocked")}
"""The most of each code that are listed, unless `-v` asks for all, and what more there are."""

NAMED = 12
"""The most labels that a line names."""


def told(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """All warnings. Unless `verbose`: those of one cause as one line, that counts them, and names
    what they are about; of some codes the first, and how many more there are."""
    if verbose:
        return list(warnings)
    causes: dict[object, list[Diagnostic]] = {}
    listed: dict[str, list[Diagnostic]] = {code: [] for code in LISTED}
    for number, warning in enumerate(warnings):
        if warning.code in LISTED:
            listed[warning.code].append(warning)
        else:
            causes.setdefault(warning.many or number, []).append(warning)
    listed["Overlap"][1:] = [replace(one, hint="") for one in listed["Overlap"][1:]]
    for code, (most, words) in LISTED.items():
        if (more := len(listed[code]) - most) > 0:
            listed[code][most:] = [Diagnostic(code, f"and {more} more {words}", None, "list: -v")]
    return [*(_as_one(alike) for alike in causes.values()), *chain(*listed.values())]


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


def say_allowed(project: Project) -> None:
    """Say which overlaps of parts are there, when finished or on the way, and allowed."""
    allowed = project.pag.allowed
    if allowed:
        ways = project.matings.notes(allowed) if project.matings else []
        for note in (*project.overlaps.notes(allowed), *ways):
            say(note)
