"""Finds the labels that no hand can hold, and the nearest misses: for each kind of hand the place
that is strong enough and has the fewest obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from factory.floor.layout.hands.apart import Swept
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import Holding, held
from factory.floor.layout.hands.in_the_way import IN_THE_WAY
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.misses import Miss, NoGrip, Obstacle
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.surfaces import Way, hit, near
from factory.floor.layout.hands.tips import STRONG
from factory.floor.layout.sides import admitted
from factory.support.arrays import Array, Index, Truth

Frames = tuple[tuple[Way, Way], ...]
"""How a robot may lie: along u, to a carrier that lies along t."""

SAME = 1e-9
"""Boxes whose sides are no further apart are one [m]."""

AS_WEAK = 1.5
"""Where no place is strong, those count that use no more than so many times the least share."""


def no_grips(hands: Hands) -> tuple[NoGrip, ...]:
    """Each sub-assembly that no hand of its robot can hold, in any frame in which it can come; and
    for a robot that can hold each of its labels, but not all by one hand, all of them."""
    factory, lacking_grips = hands.holding.factory, list[NoGrip]()
    for robot, tours in enumerate(hands.tours.of):
        frames = _frames(hands.holding, tours)
        chosen = [hands.hand(robot, u, t) for u, t in frames]
        if chosen and all(hand is not None and not hand.kind.holds for hand in chosen):
            unlike = tuple(dict.fromkeys(hands.tours.alike(tours)))
            labels = tuple(held(factory, tour) for tour in unlike) if len(unlike) > 1 else ()
            lacking = [t for t in unlike if not (labels and hands.one_hand.fits(t))]
            searches = [_Search(hands, tour, held(factory, tour)) for tour in lacking or tours[:1]]
            ways = () if lacking else tuple(_ways(hands, unlike))
            lacking_grips += [
                replace(search.found(not lacking), line=labels, ways=ways) for search in searches
            ]
    return tuple(lacking_grips)


def _frames(holding: Holding, tours: Sequence[int]) -> list[tuple[Way, Way]]:
    """The frames of a robot in which its inputs can come from its side of their carriers, the
    others from the other; all frames where these leave none."""
    frames, operations = [*holding.frames(tours[0])], [(t, holding.last(t)) for t in tours]

    def admits(u: Way) -> bool:
        t = -u[0], -u[1]  # it heads against its carrier's side
        return all(admitted(o, dict.fromkeys(o.robots, -1) | {r: 1}, t) for r, o in operations)

    return [frame for frame in frames if admits(frame[0])] or frames


def _ways(hands: Hands, tours: Sequence[int]) -> Iterator[tuple[HandKind, tuple[str, ...]]]:
    """For each kind of hand which labels of a line it can hold, one by one."""
    fits = {held(hands.holding.factory, tour): hands.one_hand.fits(tour) for tour in tours}
    for kind in hands.one_hand.kinds(tours):
        yield kind, tuple(label for label, fit in fits.items() if any(kind in way for way in fit))


class _Search:
    """Looks for the nearest misses of a robot that is to hold a sub-assembly."""

    def __init__(self, hands: Hands, robot: int, label: str) -> None:
        self.hands, self.in_the_way, self.holding = hands, hands.in_the_way, hands.holding
        self.robot, self.label = robot, label
        self.all_frames = hands.all_frames(robot)
        bodies = [(b, p) for p, of in self.holding.surfaces.bodies.items() for b in of]
        self._boxes = np.array([[body.low, body.high] for body, _ in bodies])
        self._names = [part for _, part in bodies]
        self._own = frozenset(self.holding.factory.contents[label])

    def found(self, bare: bool = False) -> NoGrip:
        """The result; without misses if `bare`."""
        factory, last = self.holding.factory, self.holding.last(self.robot)
        made = factory.contents[factory.result(last)]
        return NoGrip(
            self.label,
            factory.robots[self.robot].name,
            factory.contents[self.label],
            tuple(part for part in made if part not in self._own),
            ()
            if bare
            else tuple(self.nearest(kind) for kind in self.hands.one_hand.kinds([self.robot])),
            factory.by_label[self.label].position,
        )

    def nearest(self, kind: HandKind) -> Miss:
        """The nearest miss of a kind of hand, over all frames."""
        best: tuple[tuple[bool, int, float], Frames, Places] | None = None
        for frames in self.all_frames:
            places = self.in_the_way.on_side(self.robot, kind, frames)
            if not len(places):
                continue
            number = self._counted(kind, places, frames)
            enough = max(STRONG, AS_WEAK * float(places.pinned.min()))
            place = np.lexsort((places.pinned, number, places.pinned > enough))[0]
            share = float(places.pinned[place])
            rank = share > STRONG, int(number[place]), share
            if best is None or rank < best[0]:
                best = rank, frames, places.chosen(np.arange(len(places)) == place)
        if best is None:
            return Miss(kind, self.all_frames[0][0][0], np.zeros((0, 3)))
        _, frames, place = best
        x, y, z = place.at[0].tolist()
        low, high = self.in_the_way.reach(kind, place, frames[0][0])
        return Miss(
            kind,
            frames[0][0],
            self.in_the_way.on_side(self.robot, kind, frames).at,
            (round(x, 6), round(y, 6), round(z, 6)),
            float(place.radius[0]),
            float(place.pinned[0]),
            np.array([low[0], high[0]]),
            self._obstacles(kind, place, frames),
            self._why(kind, frames),
        )

    def _why(self, kind: HandKind, frames: Frames) -> str:
        """The most frequent obstacle, in words."""
        places = self.in_the_way.on_side(self.robot, kind, frames)
        checks, _ = self.in_the_way.checks(self.robot, self.label, kind, places, frames)
        why, free = min(checks.items(), key=lambda item: int(item[1].sum()))
        return f"{len(places) - int(free.sum())} of {len(places)} places: {IN_THE_WAY[why]}"

    def _counted(self, kind: HandKind, places: Places, frames: Frames) -> Index:
        """Number of obstacles of a hand at each place (n,)."""
        things: dict[tuple[str, str], Truth] = {}
        for key, met, _, _ in self._met(kind, places, frames):
            things[key] = things.get(key, np.zeros(len(places), bool)) | met
        return np.asarray(np.sum([np.zeros(len(places), np.intp), *things.values()], axis=0))

    def _obstacles(self, kind: HandKind, place: Places, frames: Frames) -> tuple[Obstacle, ...]:
        """The obstacles of a hand at one place."""
        things: dict[tuple[str, str], tuple[list[Array], list[Array]]] = {}
        for key, met, way, body in self._met(kind, place, frames):
            if met[0]:
                ways, bodies = things.setdefault(key, ([], []))
                if way is not None and body is not None:
                    ways.append(np.array([way[0][0], way[1][0]]))
                    bodies.append(body)
        return tuple(
            Obstacle(why, part, np.reshape(ways, (-1, 2, 3)), np.reshape(bodies, (-1, 2, 3)))
            for (why, part), (ways, bodies) in things.items()
        )

    def _met(
        self, kind: HandKind, places: Places, frames: Frames
    ) -> Iterator[tuple[tuple[str, str], Truth, tuple[Array, Array] | None, Array | None]]:
        """For each reason and part: whether it is in the way of a hand at each place (n,), the
        hand's sweep (low and high), and the part's box (2, 3); None for both if boxes do not
        matter."""
        checks, _ = self.in_the_way.checks(self.robot, self.label, kind, places, frames)
        for why, late, (low, high, boxes) in self._ways(kind, places, frames):
            for box in boxes[near(low, high, boxes)]:
                met = late & hit(low, high, box[None])
                if met.any():
                    part = "" if why == "hands" else self._part(box)
                    is_own = why == "joined" and part in self._own
                    yield ("own" if is_own else why, part), met, (low, high), box
        for why in ("weak", "hands", "feeder", "tray"):
            if not checks[why].all():
                yield (why, ""), ~checks[why], None, None

    def _part(self, box: Array) -> str:
        """The part of a body's box. The box of a part that is lowered is endless upwards, and where
        it comes over other parts also higher and endless to a side."""
        level = (np.abs(self._boxes - box)[:, :, :2] < SAME) | np.isinf(box[:, :2])
        matches = np.asarray(level.all(axis=(1, 2)))
        low = matches & (np.abs(self._boxes[:, 0, 2] - box[0, 2]) < SAME)
        chosen = np.flatnonzero(low if low.any() else matches)
        return self._names[chosen[0]] if len(chosen) else ""

    def _ways(
        self, kind: HandKind, places: Places, frames: Frames
    ) -> Iterator[tuple[str, Truth, Swept]]:
        """Possible obstacles, each with its reason and the places (n,) at which it matters."""
        robot, label, always = self.robot, self.label, np.ones(len(places), bool)
        _, first = self.in_the_way.checks(robot, label, kind, places, frames)
        is_fed = self.holding.is_fed(robot) and kind.tall
        for u, t in frames:
            for why, ways in self.in_the_way.met(robot, kind, places, u, t):
                yield why, always, ways
            for ways in self.in_the_way.coming(robot, label, kind, places, u, t) if is_fed else ():
                yield "own", always, ways
            for later, ways in self.in_the_way.joined(robot, kind, places, u, t):
                yield "brought", first | later, ways
