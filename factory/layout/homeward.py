"""Ways home: the passes at which robots become clear of other machines, and lifts that are adjusted
only at home."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import replace

from factory.layout.certificate import Precedence
from factory.layout.coordinating import HOME
from factory.layout.hands.leaving import SPARE
from factory.layout.hands.limbs import rises_first
from factory.layout.layout import Layout
from factory.layout.presence import Near, Nearness, Presence, alike, nearest
from factory.nets.coordinated import CoordinatedNet, Past
from factory.nets.exclusion import marked_after
from factory.nets.marked import MarkedNet

BISECTIONS = 12
"""Bisection steps to the point from which on a way home is clear."""


class Homeward(Nearness):
    """The ways home of a layout's robots, and the nearness of its machines."""

    def __init__(self, layout: Layout) -> None:
        super().__init__(layout.clearance)
        self._layout, self._cuts = layout, dict[Hashable, float | None]()

    def nearer(self, found: Near) -> Near | None:
        """As `Nearness.nearer`; for two robots on one stem by the boxes of their bodies."""
        robots = [side.robot for side in (found.one, found.other) if not side.bears]
        if len({*robots}) == 2 and self._layout.share_stem(*robots):
            one, other = (replace(p, bodies=p.bodies.as_boxes) for p in (found.one, found.other))
            found = replace(found, one=one, other=other)
        return super().nearer(found)

    def _cut(self, own: Presence, other: Presence) -> Past | None:
        """The pass at which a robot that goes home becomes clear of another machine; None if it
        never does, or always is."""
        begin = self._layout.visits[own.since // 2, own.robot].at
        pair = own.robot, other.robot, begin, alike(own, other)
        if pair not in self._cuts:
            self._cuts[pair] = self._bisected(own, other, begin)
        at = self._cuts[pair]
        return None if at is None else Past(own.since, own.robot, at)

    def _bisected(self, own: Presence, other: Presence, begin: float) -> float | None:
        robot, layout = own.robot, self._layout
        home = layout.guidepaths[robot].length
        heights = [z for _, span in own.sweeps for z in span]
        low = max(heights) if rises_first(layout, robot) else min(heights)

        def clear(at: float) -> bool:
            there = replace(own, sweeps=(((at, home), (low, max(heights))),))
            pair = nearest(there, other, layout.clearance)
            return pair is None or self.nearer(pair) is None

        short, far = begin, home - SPARE
        if layout.guidepaths[robot].fixed or begin >= home or not clear(far) or clear(short):
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
                for own, other in sides
                if own.since >= 0
                and not all(marked_after(net, when, place, own.since) for place in other.places)
                and (cut := self._cut(own, other)) is not None
            ]
            if ways:
                visits = self._layout.visits
                cuts.append(
                    min(ways, key=lambda past: past.at - visits[past.after // 2, past.axis].at)
                )
        return cuts

    def adjusted(self, net: CoordinatedNet, pairs: Iterable[Near]) -> Iterator[Precedence]:
        """The order places by which lifts that are adjusted for each tour are adjusted at home, for
        robots that go there by themselves and would come near a machine of a pair on the way."""
        layout, factory, transitions = self._layout, self._layout.factory, net.net.net.transitions
        for own in (side for pair in pairs for side in (pair.one, pair.other)):
            home = Past(own.since, own.robot, layout.guidepaths[own.robot].length - HOME)
            if own.robot not in factory.adjusted or home not in net.passes:
                continue
            gear = factory.robots[own.robot].operations
            then = factory.operations[gear[(gear.index(own.since // 2) + 1) % len(gear)]]
            if then.place in own.places and factory.begins(own.robot, then.index):
                before = transitions[net.net.right[net.passes[home][0]]].name
                start, tokens = transitions[then.start].name, int(then.index == gear[0])
                yield Precedence(f"order:{before}:{start}", before, start, tokens)
