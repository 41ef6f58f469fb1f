"""How machines move from place to place: in every marking each is in one of its ways, from which it
comes to the next without a jump, with what it holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from factory.apps.exports.clearance.documents import Interval, MachineWay, Row
from factory.apps.exports.clearance.machines import FED, TAKEN_AWAY, Machines

MOST = 50_000
"""Most markings of one machine that are looked at."""

JOIN = 1e-4
"""Spans no further apart join [m or rad]."""

STARTS = "_s"
"""How the transitions are named at which operations start."""

Marking = frozenset[str]

Ways = Sequence[MachineWay]


@dataclass(frozen=True, slots=True)
class MachineStep:
    """A machine fires a transition: its ways before and after."""

    event: str
    before: Ways
    after: Ways


class Machine:
    """A machine with its `ways`, and what of the `net` is beside them: their places, and the
    transitions between these."""

    def __init__(self, ways: Ways, net: Mapping[str, Row]) -> None:
        self.name, self.ways = ways[0].machine, ways
        self.places = {place for way in ways for place in way.places}
        self._sets = [(frozenset(way.places), way) for way in ways]
        self._net, self._inputs = net, Counter(row.after for row in net.values())
        self._pre, self._post = dict[str, set[str]](), dict[str, set[str]]()
        for place in self.places:
            self._post.setdefault(net[place].before, set()).add(place)
            self._pre.setdefault(net[place].after, set()).add(place)

    @property
    def start(self) -> Marking:
        """The places that are marked at the start."""
        return frozenset(place for place in self.places if self._net[place].tokens)

    @cached_property
    def is_gear(self) -> bool:
        """Whether its places are one circuit with one token, so that one at a time is marked."""
        (first, *_), onward = self.places, {self._net[p].before: p for p in self.places}
        place, circuit = onward.get(self._net[first].after), {first}
        while place is not None and place not in circuit:
            circuit.add(place)
            place = onward.get(self._net[place].after)
        is_whole = place == first and circuit == self.places == {*onward.values()}
        return is_whole and sum(self._net[p].tokens for p in circuit) == 1

    def _present(self, marking: Marking) -> tuple[Ways, list[str]]:
        """The ways in which the machine may be in a marking: where there is none, those to which
        passes alone lead, and the places that these leave."""
        left = list[str]()
        while not (ways := [way for places, way in self._sets if places <= marking]):
            passing = next((p for p in sorted(marking) if self._is_passed(p)), None)
            if passing is None:
                break
            left.append(passing)
            marking = marking - {passing} | self._post.get(self._net[passing].after, set())
        return ways, left

    def _is_passed(self, place: str) -> bool:
        """Whether the transition after a place is a pass: nothing else is before it."""
        return self._inputs[self._net[place].after] == 1

    def explore(self) -> Iterator[MachineStep | str]:
        """All firings of the part of the net beside the machine; a text where one is not safe, or
        leads to a marking in which the machine is nowhere. Other places only allow less."""
        events = sorted(self._pre.keys() | self._post.keys())
        for event in events:
            if not self._pre.get(event):
                yield f"is in no way before '{event}', but after it in {_listed(self._post[event])}"
                return
        if full := {place for place in self.places if self._net[place].tokens > 1}:
            yield f"goes through {_listed(full)}, with more than one token"
            return
        seen, left = {self.start}, [self.start]
        if not self._present(self.start)[0]:
            yield f"is in none of its ways at the start, with {_listed(self.start)} marked"
        while left:
            marking = left.pop()
            for event in (e for e in events if self._pre[e] <= marking):
                kept, gained = marking - self._pre[event], self._post.get(event, set())
                if kept & gained:
                    yield f"is where '{event}' puts a second token: {_listed(kept & gained)}"
                    return
                if len(seen) > MOST:
                    yield f"has more than {MOST} markings"
                    return
                after = kept | gained
                ways, passed = self._present(after)
                if not ways:
                    yield f"is in none of its ways after '{event}', with {_listed(after)} marked"
                    return
                if not passed or self._inputs[event] > 1 or gained & {*passed}:
                    yield MachineStep(event, self._present(marking)[0], ways)
                if after not in seen:
                    seen.add(after)
                    left.append(after)


def jumps(step: MachineStep, start: Sequence[MachineWay]) -> Iterator[str]:
    """Where a machine would jump in a step: out of a way, or into one that is not of the `start`
    alone."""
    for word, ways, others in (("from", step.before, step.after), ("to", step.after, step.before)):
        for way in _cut_off(ways, others):
            if word == "from" or way not in start:
                listed = " or ".join(dict.fromkeys(map(str, others)))
                yield f"{way}: it cannot come {word} there at '{step.event}'; {listed} is elsewhere"


def hulls(ways: Ways) -> dict[str, Interval]:
    """From where to where each joint goes on some ways."""
    of = dict[str, list[Interval]]()
    for way in ways:
        for group in way.spans:
            for joint, span in zip(way.joints, group, strict=True):
                of.setdefault(joint, []).append(span)
    return {j: (min(a for a, _ in each), max(b for _, b in each)) for j, each in of.items()}


def starts_outside(step: MachineStep, joints: Container[str]) -> Iterator[str]:
    """Where an operation would begin outside its ways: a machine starts it from wherever it is with
    these of its joints."""
    if not step.event.endswith(STARTS):
        return
    before, after = hulls(step.before), hulls(step.after)
    for joint in (joint for joint in before if joint in joints and joint in after):
        (low, high), (least, most) = before[joint], after[joint]
        if low < least - JOIN or high > most + JOIN:
            names = " or ".join(dict.fromkeys(map(str, step.after)))
            begins, goes = f"{low:g} to {high:g}", f"{least:g} to {most:g}"
            yield f"{names}: joint '{joint}' begins at {begins}, and is elsewhere, {goes}"


def _cut_off(ways: Ways, others: Ways) -> Ways:
    """Those of some ways that join none of the others, neither directly nor over each other."""
    left = [*ways]
    joined = [way for way in left if any(_joins(way, other) for other in others)]
    while joined:
        left = [way for way in left if way not in joined]
        joined = [way for way in left if any(_joins(way, o) for o in ways if o not in left)]
    return left


def _joins(one: MachineWay, other: MachineWay) -> bool:
    """Whether some position is in both ways."""
    spans = [
        dict(zip(way.joints, group, strict=True)) for way in (one, other) for group in way.spans
    ]
    mine, its = spans[: len(one.spans)], spans[len(one.spans) :]
    return any(
        all(
            max(a[joint][0], b[joint][0]) <= min(a[joint][1], b[joint][1]) + JOIN
            for joint in a.keys() & b.keys()
        )
        for a in mine
        for b in its
    )


@dataclass(slots=True)
class PartTransfers:
    """Which parts (body) machines get and give away at each transition: the welds."""

    gained: dict[tuple[str, int], set[str]]
    lost: dict[tuple[str, int], set[str]]

    @classmethod
    def of(cls, steps: Iterable[MachineStep], machines: Machines) -> PartTransfers:
        """Those of all steps of all machines."""
        gained, lost = dict[tuple[str, int], set[str]](), dict[tuple[str, int], set[str]]()
        for step in steps:
            before, after = (
                {w for way in ways for w in way.welds} for ways in (step.before, step.after)
            )
            for side, welds in ((gained, after - before), (lost, before - after)):
                for weld in welds:
                    side.setdefault((step.event, machines.part(weld)), set()).add(weld)
        return cls(gained, lost)

    def faults(self) -> Iterator[str]:
        """Parts that come from nowhere, or are gone."""
        sides = (
            (self.lost, self.gained, TAKEN_AWAY, ("lets go of", "gets")),
            (self.gained, self.lost, FED, ("gets", "lets go of")),
        )
        for mine, its, kind, (one, other) in sides:
            for (event, part), welds in mine.items():
                odd = sorted(weld for weld in welds if not weld.startswith(kind))
                if odd and (event, part) not in its:
                    yield f"'{odd[0]}' {one} its part at '{event}', and no machine {other} it"


def _listed(places: Iterable[str]) -> str:
    return ", ".join(f"'{place}'" for place in sorted(places)) or "none of its places"
