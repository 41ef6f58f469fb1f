"""The warnings that a command prints, those of an incomplete log included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from factory.commands.requests import OutputOptions
from factory.support.console import say, warn
from factory.support.errors import Diagnostic

if TYPE_CHECKING:
    from factory.apps.log import Log
    from factory.pipeline import Project


LISTED = {"Overlap": (6, "pairs overlap"), "Blocked": (24, "operations are blocked")}
"""Maximum number of warnings of a code without `-v`, and the noun for the others."""

NAMED = 12
"""The most labels that a line names."""


def condensed(warnings: Sequence[Diagnostic], verbose: bool) -> list[Diagnostic]:
    """The warnings to print. Unless `verbose`, those of one cause become one line with their number
    and their labels, and only the first ones of some codes are listed."""
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
    from factory.apps.importing.mesh_files import natural

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
    """Print warnings as text; returns all of them for the document of `--json`."""
    warn(condensed(warnings, out.verbose), out.silent)
    return [warning.as_json() for warning in warnings]


def say_allowed(project: Project) -> None:
    """Print the overlaps that exist and are allowed, in the product or on the way."""
    allowed = project.pag.allowed
    if allowed:
        ways = project.matings.notes(allowed) if project.matings else []
        for note in (*project.overlaps.notes(allowed), *ways):
            say(note)


def read_partly(file: Path, silent: bool) -> Log:
    """The log in a file, with a warning where its run was cut off. Raises InputError (BadLog)."""
    from factory.apps.log import read_log

    log = read_log(file)
    if log.cut_off:
        warn([log.cut_off.diagnostic(file)], silent)
    return log


def cut_off(log: Log | None) -> dict[str, object]:
    """The key `cut_off` of a `--json` document about a log; nothing without one."""
    if log is None:
        return {}
    return {"cut_off": log.cut_off and log.cut_off.as_json()}
