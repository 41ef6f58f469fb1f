"""Ways home: the passes at which robots become clear of other machines, and lifts that are adjusted
only at home."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import replace

from factory.floor.layout.certificate import Precedence
from factory.floor.layout.coordinating import HOME
from factory.floor.layout.hands.leaving import SPARE
from factory.floor.layout.hands.limbs import rises_first
from factory.floor.layout.layout import Layout
from factory.floor.layout.nearness import (
    Near,
    Nearness,
    alike,
    distances,
    judged,
    meeting,
    nearest,
)
from factory.floor.layout.presence import Presence
from factory.floor.layout.staying import goes_home
from factory.theory.nets.coordinated import CoordinatedNet, Past
from factory.theory.nets.exclusion import marked_after
from factory.theory.nets.marked import MarkedNet
from factory.theory.problem.ids import TransitionId, carriage_axis, operation_of

BISECTIONS = 12
"""Bisection steps to the point from which on a way home is clear."""


class Homeward(Nearness):
    """The ways home of a layout's robots, and the nearness of its machines."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout.clearance)
        self._layout, self._cuts = layout, dict[Hashable, float | None]()

    def nearer(self, pair: Near) -> Near | None:
        """As `Nearness.nearer`; for two robots on one stem by the boxes of their bodies."""
        one, other = self._on_stem(pair.one, pair.other)
        return super().nearer(replace(pair, one=one, other=other))

    def _on_stem(self, one: Presence, other: Presence) -> tuple[Presence, Presence]:
        """Two presences; those of two robots on one stem with bodies that fill their boxes."""
        robots = [side.robot for side in (one, other) if not side.bears]
        if len({*robots}) == 2 and self._layout.share_stem(*robots):
            one, other = (replace(p, bodies=p.bodies.as_boxes) for p in (one, other))
        return one, other

    def _since_visit(self, past: Past) -> float:
        """How far a pass is from where its operation was visited [m], backwards below 0."""
        visits, robot = self._layout.visits, self._layout.factory.robot_of(past.axis)
        return past.at - visits[operation_of(past.after), robot].at

    def _cut(self, one: Presence, other: Presence) -> Past | None:
        """The pass at which a robot that goes home becomes clear of another machine; None if it
        never does, or always is, or does not go so far by itself."""
        begin = self._layout.visits[operation_of(one.since), one.robot].at
        pair = one.robot, other.robot, begin, alike(one, other)
        if pair not in self._cuts:
            self._cuts[pair] = self._bisected(one, other, begin)
        at, layout = self._cuts[pair], self._layout
        if at is None:
            return None
        then = layout.factory.after(one.robot, operation_of(one.since))
        far = layout.visits[then, one.robot].at
        return _pass(one, at) if goes_home(layout, one.robot, then) or at <= far else None

    def _bisected(self, one: Presence, other: Presence, begin: float) -> float | None:
        robot, layout = one.robot, self._layout
        home = layout.guidepaths[robot].length
        heights = [z for _, span in one.sweeps for z in span]
        low, high = min(heights), max(heights)
        if rises_first(layout, robot) and round(high - low, 6) > SPARE:
            low = high  # unless it counts as up from the beginning

        there, its = self._on_stem(one, other)
        needed = distances(there, its, layout.clearance)

        def goes(at: float) -> Presence:
            return replace(there, sweeps=(((at, home), (low, high)),))

        def clear(at: float) -> bool:
            if layout.guidepaths[robot].way:
                return judged(goes(at), its, needed) is None
            return nearest(goes(at), its, on_all) is None

        short, far = begin, home - SPARE
        on_all = meeting(goes(min(short, far)), its, needed)  # on less of the way no others do
        if not layout.guidepaths[robot].travels or begin >= home or not clear(far) or clear(short):
            return None
        for _ in range(BISECTIONS):
            middle = (short + far) / 2
            short, far = (short, middle) if clear(middle) else (middle, far)
        return round(min(far + SPARE, home - SPARE), 6)

    def cuts(self, net: MarkedNet, when: Sequence[int], pairs: Iterable[Near]) -> list[Past]:
        """The passes at which ways home become clear of what they come near, for each pair that
        allows one: on the shorter way of the two."""
        cuts = list[Past]()
        for pair in pairs:
            sides = ((pair.one, pair.other), (pair.other, pair.one))
            ways = [
                cut
                for one, other in sides
                if one.since >= 0
                and not all(marked_after(net, when, place, one.since) for place in other.places)
                and (cut := self._cut(one, other)) is not None
            ]
            if ways:
                cuts.append(min(ways, key=self._since_visit))
        return cuts

    def adjusted_at_home(self, net: CoordinatedNet, pairs: Iterable[Near]) -> Iterator[Precedence]:
        """The order places by which lifts that are adjusted for each tour are adjusted at home, for
        robots that go there by themselves and would come near a machine of a pair on the way."""
        layout, factory, transitions = self._layout, self._layout.factory, net.net.net.transitions
        for one in (side for pair in pairs for side in (pair.one, pair.other)):
            home = _pass(one, layout.guidepaths[one.robot].length - HOME)
            if one.robot not in factory.adjusted or home not in net.passes:
                continue
            then = factory.operations[factory.after(one.robot, operation_of(one.since))]
            if then.place in one.places and factory.begins(one.robot, then.index):
                before = transitions[net.net.right[net.passes[home][0]]].name
                start, tokens = transitions[then.start].name, int(then == factory.first(one.robot))
                yield Precedence(f"order:{before}:{start}", before, start, tokens)


def _pass(one: Presence, at: float) -> Past:
    """The pass at which a robot that goes home has come as far as `at` [m]."""
    return Past(TransitionId(one.since), carriage_axis(one.robot), at)
