"""Whether the record of a run is what was seen of it: each firing of the one is in the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from factory.record.monitor.report import Firing, Violation
from factory.record.monitor.subject import MonitorSubject

ROUNDING = 1e-9
"""Times that differ by less are one [s]."""

Recorded = Sequence[tuple[float, str]]
"""Time [s] and name of every transition that fired, as a supervisor says."""


def disagreements(
    subject: MonitorSubject, found: Iterable[Firing], recorded: Recorded
) -> Iterator[Violation]:
    """The firings that only one of the two has, or that have another time in the other. Where the
    run ends, those need not have been seen yet that move no parts."""
    names = subject.factory.net.threaded.transitions
    count = {t.name: subject.counts.get(number, 0) for number, t in enumerate(names)}
    label = {t.name: subject.factory.operations[n // 2].label for n, t in enumerate(names)}
    ends = (o.end for o in subject.factory.operations if subject.moves_parts[o.index])
    shown = {names[end].name for end in ends}
    left = {(firing.transition, firing.unit): firing for firing in found}
    last = 0.0
    for t, name in recorded:
        unit = count[name]
        count[name] += 1
        firing = left.pop((name, unit), None)
        what = f"the record has {name}, in unit {unit}, at {t:.3f} s"
        if t < last:
            yield _violation(subject, t, label[name], f"{what}, after what came later")
        elif firing is None and name in shown:
            yield _violation(subject, t, label[name], f"{what}, and it was not seen to fire")
        elif firing and not firing.earliest - ROUNDING <= t <= firing.latest + ROUNDING:
            when = f"between {firing.earliest:.3f} and {firing.latest:.3f} s"
            yield _violation(subject, t, label[name], f"{what}, and it was seen to fire {when}")
        last = t
    for firing in left.values():
        words = f"{firing.transition} was seen to fire, in unit {firing.unit}, and is not recorded"
        yield _violation(subject, firing.latest, label[firing.transition], words)


def contradictions(
    subject: MonitorSubject, recorded: Recorded, markings: Iterable[tuple[float, Sequence[int]]]
) -> Iterator[Violation]:
    """The first marking in a log that its own firings do not lead to; each is given with the time
    [s] of its tick."""
    net = subject.factory.net.threaded
    events: Mapping[str, int] = net.net.transition_index
    marked, at = set(subject.start), 0
    for time, marking in markings:
        while at < len(recorded) and recorded[at][0] < time - ROUNDING:
            event = events[recorded[at][1]]
            marked.difference_update(net.net.preset[event])
            marked.update(net.net.postset[event])
            at += 1
        if marked != set(marking):
            places = sorted(marked.symmetric_difference(marking))
            names = ", ".join(net.places[place].name for place in places[:4])
            words = f"its firings do not lead to the marking of that time: {names}"
            yield _violation(subject, time, "", words)
            return


def _violation(subject: MonitorSubject, t: float, label: str, words: str) -> Violation:
    operation = subject.factory.by_label.get(label)
    return Violation(t, "", label, "Record", words, operation.position if operation else None)
