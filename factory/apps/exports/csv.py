"""CSV (RFC 4180, with a header line) of a log's events: time, transition, operation, unit,
robots, source line.

A spreadsheet evaluates a text that begins like a formula; such a text gets an apostrophe before it.
Control codes become spaces."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Iterator
from dataclasses import astuple, dataclass

from factory.api import Factory, Undone
from factory.apps.exports.subject import Subject
from factory.apps.log import Log
from factory.apps.log.project_table import factory_of
from factory.support.errors import one_line


@dataclass(frozen=True, slots=True)
class EventRow:
    """A transition that fired, or was undone.

    Attributes:
        time_s: time [s].
        transition: its name.
        kind: start, end, start undone or end undone.
        operation: the label that the operation makes.
        template: the operation's template.
        unit: how often the transition has fired, less how often it was undone.
        carrier: the carrier of the operation.
        robots: the robots of the operation.
        file, line, column: the place in the PAG.
    """

    time_s: float
    transition: str
    kind: str
    operation: str
    template: str
    unit: int
    carrier: str
    robots: tuple[str, ...]
    file: str
    line: int
    column: int


COLUMNS = tuple(EventRow.__dataclass_fields__)
"""The names of the columns."""


def rows(log: Log) -> Iterator[EventRow]:
    """The events in the order in which they were recorded: a row for each time that a transition
    fires, and one for each that is undone. Raises InputError (BadLog) where the log is not of the
    factory that its header describes."""
    factory, units = factory_of(log.header), Counter[int]()
    numbers = factory.net.threaded.net.transition_index
    for time, entry in log.timed_entries:
        if isinstance(entry, Undone):
            for name in entry.transitions:
                number = numbers[name]
                yield _row(factory, time, number, units[number], " undone")
                units[number] -= 1
            continue
        number = numbers[entry]
        units[number] += 1
        yield _row(factory, time, number, units[number])


def _row(factory: Factory, time: float, number: int, unit: int, undone: str = "") -> EventRow:
    operation = factory.operation_of(number)
    at = operation.position
    return EventRow(
        round(time, 9),
        factory.net.threaded.transitions[number].name,
        ("end" if number == operation.end else "start") + undone,
        operation.label,
        operation.template.name,
        unit,
        factory.robots[operation.carrier].name,
        tuple(factory.robots[r].name for r in operation.robots),
        at.file if at else "",
        at.line if at else 0,
        at.column if at else 0,
    )


FORMAT, TAKES = "csv", "log"

FORMULA = ("=", "+", "-", "@")
"""First characters of a formula."""


def export(subject: Subject) -> str:
    """The table as text; robots are separated by spaces."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in rows(subject.log):
        writer.writerow([_cell(value) for value in astuple(row)])
    return text.getvalue()


def _cell(value: object) -> object:
    """A value as it stands in a cell."""
    if not isinstance(value, str | tuple):
        return value
    text = one_line(value if isinstance(value, str) else " ".join(value))
    return f"'{text}" if text.lstrip().startswith(FORMULA) else text
