"""What went wrong in a recorded run, and what was done about it, as HTML and as data."""

from __future__ import annotations

from collections import Counter
from html import escape
from math import isfinite
from typing import Any

from factory.record.failures import Death, Failing, Failures, deaths
from factory.show.report.recording import Recording

LEGEND = (
    "Robots over time: hatched is what was undone; in a band a robot stands still, in a dark one it"
    " is dead, until another is in its place, or does its tours."
)

COLUMNS = ("Time", "What failed", "What was done", "Undone", "Scrapped")


def failures_section(recording: Recording) -> str:
    """The section of a run that goes on after failures; nothing of any other."""
    found = recording.log.failures
    if found is None:
        return ""
    head = "".join(f"<th>{name}</th>" for name in COLUMNS)
    rows = "".join(_row(recording, one) for one in found.found)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>" if rows else ""
    text = f"<p>{escape(_summary(found))}</p>{table}<p class='note'>{LEGEND}</p>"
    return (
        '\n<section class="panel wide failures" aria-labelledby="h-failures">\n'
        '<div class="bar"><h2 id="h-failures">Failures</h2></div>'
        f'<div class="text">{text}</div>\n</section>'
    )


def failures_data(recording: Recording) -> dict[str, Any]:
    """What the page draws of it: `undone`, after how many firings, when [s] and which transitions;
    `dead`, which robots were, from when on and until when [s], null where none took their place,
    and what was then; `gone`, which were lifted out for good, when [s], and their deputies;
    `stood`, from when on [s] which robots stood."""
    log, net = recording.log, recording.factory.net.threaded.net.transition_index
    if log.failures is None:
        return {}
    robots = {robot.name: robot.index for robot in recording.factory.robots}
    entries = [undone for _, undone in log.undone]
    return {
        "undone": [
            [after, round(undone.t, 4), [net[name] for name in undone.transitions]]
            for after, undone in log.undone
        ],
        "dead": [_dead(robots[one.robot], one) for one in deaths(log.failures.found, entries)],
        "gone": [
            [robots[e.robots[0]], round(e.t, 4), robots[e.robots[1]]] for e in entries if e.robots
        ],
        "stood": [
            [round(t, 4), [robots[name] for name in names]] for t, names in log.failures.stood
        ],
    }


def _dead(robot: int, death: Death) -> list[Any]:
    """A death, as the page draws it."""
    start, end = round(death.start, 4), round(death.end, 4) if isfinite(death.end) else None
    return [robot, start, end, f", then {death.then}" if end is not None else ""]


def _summary(found: Failures) -> str:
    """The figures of all failures in a sentence or two."""
    struck = ", ".join(f"{n} {kind.replace('_', ' ')}" for kind, n in found.struck.items() if n)
    figures = (
        _count(len(found.found), "failure"),
        f"{_count(found.undone, 'transition')} undone",
        f"{found.scrapped} scrapped",
        f"{_count(found.spares, 'spare')} used",
        f"{_count(found.contacts, 'contact')} with what fell or lay askew",
    )
    told = f"{found.missed} missed, {_count(found.false_alarms, 'false alarm')}"
    return f"Faults: {struck or 'none'}; {told}. {', '.join(figures)}."


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


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
