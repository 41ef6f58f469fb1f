"""How the findings of a monitor agree with the record of the run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence

from factory.api import MonitorSubject, PetriNet, Undone
from factory.engine.record.findings import Firing, Violation

ROUNDING = 1e-9
"""Times that differ by less are equal [s]."""

Recorded = Sequence[tuple[float, str]]
"""Time [s] and name of every transition that fired, from a supervisor."""


def disagreements(
    subject: MonitorSubject, firings: Iterable[Firing], recorded: Recorded
) -> Iterator[Violation]:
    """The firings that are in only one of the two, or that differ in time. At the end of the run,
    firings that move no parts may not have been observed yet."""
    names = subject.factory.net.threaded.transitions
    count = {t.name: subject.counts.get(number, 0) for number, t in enumerate(names)}
    operations = subject.factory.operations
    label = {names[t].name: o.label for o in operations for t in (o.start, o.end)}
    ends = (o for o in subject.factory.operations if subject.moves_parts[o.index])
    shown = {names[o.end].name: o for o in ends}
    left = {(firing.transition, firing.unit): firing for firing in firings}
    last = 0.0
    for t, name in recorded:
        unit = count[name]
        count[name] += 1
        firing = left.pop((name, unit), None)
        what = f"the record has {name}, in unit {unit}, at {t:.3f} s"
        if t < last:
            yield _violation(subject, t, label[name], f"{what}, after a later firing")
        elif firing is None and name in shown and subject.is_made(shown[name], unit):
            yield _violation(subject, t, label[name], f"{what}, which was not observed")
        elif firing and not firing.earliest - ROUNDING <= t <= firing.latest + ROUNDING:
            when = f"between {firing.earliest:.3f} and {firing.latest:.3f} s"
            yield _violation(subject, t, label[name], f"{what}, but it was observed {when}")
        last = t
    for firing in left.values():
        words = f"{firing.transition} was observed in unit {firing.unit}, but is not recorded"
        yield _violation(subject, firing.latest, label[firing.transition], words)


def contradictions(
    subject: MonitorSubject,
    entries: Iterable[tuple[float, str | Undone]],
    markings: Iterable[tuple[float, Sequence[int]]],
) -> Iterator[Violation]:
    """The first marking in a log that does not follow from its entries, firings and undos. Each
    marking has the time [s] of its tick, and includes the undos after that tick."""
    left, gears = deque(entries), subject.factory.net
    tokens = [int(place in subject.start) for place in range(len(gears.threaded.places))]
    for time, marking in markings:
        while left:
            t, entry = left[0]
            if t >= time + (ROUNDING if isinstance(entry, Undone) else -ROUNDING):
                break
            left.popleft()
            _play(gears.threaded.net, tokens, entry)
        marked = {place for place, count in enumerate(tokens) if count}
        if marked != set(marking):
            places = sorted(marked.symmetric_difference(marking))
            names = ", ".join(gears.threaded.places[place].name for place in places[:4])
            words = f"the recorded marking does not follow from the firings: {names}"
            yield _violation(subject, time, "", words)
            return


def _play(net: PetriNet, tokens: list[int], entry: str | Undone) -> None:
    """Fire a transition, or the transitions of an undo backwards."""
    names, sign = (entry.transitions, -1) if isinstance(entry, Undone) else ((entry,), 1)
    for name in names:
        event = net.transition_index[name]
        for place in net.preset[event]:
            tokens[place] -= sign
        for place in net.postset[event]:
            tokens[place] += sign


def _violation(subject: MonitorSubject, t: float, label: str, words: str) -> Violation:
    operation = subject.factory.by_label.get(label)
    return Violation(t, "", label, "Record", words, operation.position if operation else None)
