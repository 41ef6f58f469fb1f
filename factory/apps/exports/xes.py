"""XES (IEEE 1849-2016) of a log's events, for process mining: a trace for each product, in it the
start and the end of each operation that makes it, with its robots.

Time begins with the year 2000. An operation that is undone is aborted (`ate_abort`), one that was
over and is undone is withdrawn."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

from factory.apps.drawing.markup import quoteattr
from factory.apps.exports.csv import EventRow, rows
from factory.apps.exports.subject import Subject
from factory.apps.log.project_table import factory_of

FORMAT, TAKES = "xes", "log"

EPOCH = datetime(2000, 1, 1, tzinfo=UTC)

STEPS = {
    "start": "start",
    "end": "complete",
    "start undone": "ate_abort",
    "end undone": "withdraw",
}
"""The transitions of the standard lifecycle, by the kinds of events."""

HEAD = """\
<?xml version="1.0" encoding="UTF-8"?>
<log xes.version="1849-2016" xes.features="" xmlns="http://www.xes-standard.org/">
<extension name="Concept" prefix="concept" uri="http://www.xes-standard.org/concept.xesext"/>
<extension name="Lifecycle" prefix="lifecycle" uri="http://www.xes-standard.org/lifecycle.xesext"/>
<extension name="Organizational" prefix="org" uri="http://www.xes-standard.org/org.xesext"/>
<extension name="Time" prefix="time" uri="http://www.xes-standard.org/time.xesext"/>
<global scope="trace"><string key="concept:name" value=""/></global>
<global scope="event"><string key="concept:name" value=""/>\
<string key="lifecycle:transition" value="complete"/>\
<date key="time:timestamp" value="2000-01-01T00:00:00.000+00:00"/></global>
<classifier name="operation" keys="concept:name"/>
"""


def export(subject: Subject) -> str:
    """The log as a text."""
    return "".join(_log(subject))


def _log(subject: Subject) -> Iterator[str]:
    factory = factory_of(subject.log.header)
    turns = {operation.label: operation.turn for operation in factory.operations}
    traces: dict[int, list[EventRow]] = {}
    for row in rows(subject.log):
        number = (row.unit - 1) * factory.period + turns[row.operation] + 1
        traces.setdefault(number, []).append(row)
    yield HEAD
    yield _string("concept:name", subject.stem)
    for number, events in sorted(traces.items()):
        yield f"\n<trace>{_string('concept:name', f'{subject.stem} {number}')}"
        yield from map(_event, events)
        yield "\n</trace>"
    yield "\n</log>\n"


def _event(row: EventRow) -> str:
    time = (EPOCH + timedelta(seconds=row.time_s)).isoformat(timespec="milliseconds")
    texts = {
        "concept:name": row.operation,
        "lifecycle:transition": STEPS[row.kind],
        "org:resource": " ".join(row.robots),
        "template": row.template,
        "transition": row.transition,
    }
    words = "".join(_string(key, value) for key, value in texts.items())
    return f'\n<event><date key="time:timestamp" value="{time}"/>{words}</event>'


def _string(key: str, value: str) -> str:
    return f"<string key={quoteattr(key)} value={quoteattr(value)}/>"
