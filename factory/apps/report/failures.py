"""The failures of a recorded run and the responses to them, as HTML and as data."""

from __future__ import annotations

from collections import Counter
from html import escape
from math import isfinite
from typing import Any

from factory.api import Failing, Failures
from factory.apps.drawing.tables import table
from factory.apps.report.recording import Recording
from factory.support.texts import counted

LEGEND = (
    "Robots over time: undone operations are hatched; in a band a robot stands still, in a dark one"
    " it is dead, until a spare replaces it."
)

COLUMNS = ("Time", "Failure", "Response", "Undone", "Scrapped")


def failures_section(recording: Recording) -> str:
    """The section of a run that recovers from failures; empty for any other."""
    failures = recording.log.failures
    if failures is None:
        return ""
    rows = "".join(_row(recording, one) for one in failures.found)
    listed = table(COLUMNS, rows) if rows else ""
    text = f"<p>{escape(_summary(failures))}</p>{listed}<p class='note'>{LEGEND}</p>"
    return (
        '\n<section class="panel wide failures" aria-labelledby="h-failures">\n'
        '<div class="bar"><h2 id="h-failures">Failures</h2></div>'
        f'<div class="text">{text}</div>\n</section>'
    )


def failures_data(recording: Recording) -> dict[str, Any]:
    """The data of the page: `undone`: number of firings before, time [s] and transitions; `dead`:
    robot, start and end [s], null where nothing replaced it, and the situation after it; `stood`:
    times [s] and the robots that stood still from then on."""
    log, net = recording.log, recording.factory.net.threaded.net.transition_index
    if log.failures is None:
        return {}
    robots = {robot.name: robot.index for robot in recording.factory.robots}
    return {
        "undone": [
            [after, round(undone.t, 4), [net[name] for name in undone.transitions]]
            for after, undone in log.undone
        ],
        "dead": [
            [robots[one.robot], round(one.start, 4), *_until(one.end, one.then)]
            for one in log.failures.deaths
        ],
        "stood": [
            [round(t, 4), [robots[name] for name in names]] for t, names in log.failures.stood
        ],
    }


def _until(end: float, then: str) -> tuple[float | None, str]:
    """The end of a death, as in `failures_data`, and the situation after it."""
    return (round(end, 4), f", then {then}") if isfinite(end) else (None, "")


def _summary(failures: Failures) -> str:
    """The counts of all failures, in words."""
    struck = ", ".join(f"{n} {kind.replace('_', ' ')}" for kind, n in failures.struck.items() if n)
    figures = (
        counted(len(failures.found), "failure"),
        f"{counted(failures.undone, 'transition')} undone",
        f"{failures.scrapped} scrapped",
        f"{counted(failures.spares, 'spare')} used",
        f"{counted(failures.contacts, 'contact')} with fallen or misplaced parts",
    )
    detection = f"{failures.missed} missed, {counted(failures.false_alarms, 'false alarm')}"
    return f"Faults: {struck or 'none'}; {detection}. {', '.join(figures)}."


def _row(recording: Recording, one: Failing) -> str:
    undone = Counter(
        name
        for _, entry in recording.log.undone
        if (entry.operation, entry.reason) == (one.operation, one.test)
        if abs(entry.t - one.t) < 1e-6
        for name in entry.transitions
    )
    names = ", ".join(f"{name} ({n} times)" if n > 1 else name for name, n in undone.items())
    cells = (one.done, names or "–", ", ".join(one.scrapped) or "–")
    values = "".join(f"<td>{escape(cell)}</td>" for cell in cells)
    return f"<tr><th>{one.t:.2f} s</th><td>{escape(one.what)}</td>{values}</tr>"
