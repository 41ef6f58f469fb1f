"""Pack one robot: stations, sides and travels of all that deliver to it, for the least time.

Guarantees what `factory.floor.layout.stretching` does, with contours in place of boxes. Stops are
placed from the B end forward; of all the ways to place the ones so far the best few are kept (a
beam), since where a station is best depends on the next.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf

from factory.floor.layout.dimensions import PAYLOADS, Clearance
from factory.floor.layout.durations import Pace
from factory.floor.layout.footprint import Placed, extent_to, footprint
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import bare
from factory.floor.layout.layout import BESIDE
from factory.floor.layout.outline import Choice, Guest, Outline, outlined
from factory.floor.layout.shapes import Shape, Sides
from factory.floor.layout.skyline import Skyline
from factory.floor.layout.stops import Stop
from factory.support.boxes import Extent
from factory.support.decimals import up
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

SPAN = 0.15
"""A station is not looked at that costs as much more than the best as so long a way [m]."""

SOON = 8
"""Room for those without a crown is made where they come within so many operations."""

ALIGN = 0.05
"""So much further [m] a robot may go to stand where the next operation will be."""

BARE = 5.0
"""How bad it is that a robot has no hand for what it brings, where it could lie another way
[s]."""

WIDTHS = 6, 24
"""How many ways to place the stops so far are kept, where one unit is made in a period, or several:
there the best way for each unit alone is often not the best one for all."""

PATH = 0.025
"""What guidepath costs, as a share of the time to go along it: where times are the same, the
shorter is taken."""


@dataclass(frozen=True, slots=True)
class Task:
    """What all robots of a factory are packed with.

    Attributes:
        factory: the factory.
        clearance: the clearances to keep.
        pace: the speed and acceleration of robots.
        weights: how much the time of each robot matters, 1 for the bottleneck (robots,).
        breadth: share of its extent to the sides by which a robot slows those down that it
            delivers to, as they are charged for it.
        width: number of ways that are kept.
        corridor: whether the output robot's way ahead is kept free for the product, so that the
            outfeed can begin beside the others.
        wide: robots (index) whose ways have room for relays.
        hands: those of the robots; None where they are not chosen.
    """

    factory: Factory
    clearance: Clearance
    pace: Pace
    weights: Sequence[float]
    breadth: float = 1.0
    width: int = WIDTHS[0]
    corridor: bool = True
    wide: Collection[int] = ()
    hands: Hands | None = None


@dataclass(frozen=True, slots=True)
class _Way:
    """One way to place the operations so far: where the robot stands, what is beside its path on
    each side, which robots deliver, at which time and cost [s]; `time` does not count the way
    back."""

    station: float
    beside: Mapping[int, Skyline]
    guests: tuple[Guest, ...] = ()
    stations: tuple[float, ...] = ()
    piles: tuple[Placed, ...] = ()
    time: float = 0.0
    cost: float = 0.0


class Packing:
    """One robot of a factory with a shape of its own.

    `outline(guest, side)`: that of a robot that delivers to it from a side; `admits(operation,
    sides)`: whether the inputs of an operation can come from there.
    """

    def __init__(
        self,
        task: Task,
        robot: int,
        shape: Shape,
        outline: Callable[[int, int], Outline],
        admits: Callable[[Operation, Sides], bool],
    ) -> None:
        self.task, self.robot = task, robot
        self.outline, self.admits = outline, admits
        corridor = task.corridor and robot == 0
        self.own = footprint(task.factory, robot, shape, task.clearance, corridor)

    def packed(self) -> Outline:
        """The best outline found. Raises InputError where a template asks for what cannot be."""
        outlines = self._outlines(nested=True) or self._outlines(nested=False)
        return min(outlines, key=lambda pair: pair[0])[1]

    def _outlines(self, nested: bool) -> list[tuple[float, Outline]]:
        empty = dict.fromkeys((-1, +1), Skyline.behind(self.own.frontier, nested))
        ways = [_Way(0.0, empty)]
        for stop in self.own.stops:
            longer_ways = [longer for way in ways for longer in self._placed(way, stop)]
            ways = sorted(longer_ways, key=lambda way: way.cost)[: self.task.width]
        return [pair for way in ways if (pair := self._finished(way, empty)) is not None]

    def _placed(self, way: _Way, stop: Stop) -> Iterator[_Way]:
        """The ways to place one more stop."""
        robots, least = stop.guests, self.own.least(stop, way.station)
        if not robots:
            yield self._added(way, stop, least, ())
            return
        for sides in self._options(stop, robots):
            alternatives = (self._guests(way, stop, r, side) for r, side in sides.items())
            for guests in product(*alternatives):
                if not way.piles:
                    first = up(self._back(stop, guests))
                    there = [replace(guest, station=first) for guest in guests]
                    yield self._added(way, stop, first, there)
                else:
                    yield from self._stations(way, stop, guests, least)

    def _options(self, stop: Stop, robots: Sequence[int]) -> list[Sides]:
        """The possible sides: two guests come from opposite ones."""
        both = [dict(zip(robots, sides, strict=False)) for sides in ((-1, +1), (+1, -1))]
        admitted = [all(self.admits(o, sides) for o in stop.operations) for sides in both]
        return [sides for sides, can in zip(both, admitted, strict=True) if can] or both

    def _later(self, way: _Way, count: int) -> Iterator[tuple[int, Outline]]:
        """For a number of following operations: which outline may come from which side."""
        for stop in self.own.stops[len(way.piles) + 1 :][:count]:
            for sides in self._options(stop, stop.guests):
                for robot, side in sides.items():
                    yield side, self.outline(robot, side)

    def _guests(self, way: _Way, stop: Stop, robot: int, side: int) -> list[Guest]:
        """A robot that delivers from a side, as near as possible, or with its crown so far out that
        guests without one soon find room before it."""
        outline, strip = self.outline(robot, side), self.own.strips[side]
        early = self.own.early(stop, side, outline.shape)
        wanted = up(outline.least + early) if early > 0 else 0.0
        if not outline.shape.travels:
            return [Guest(robot, outline, side, 0.0)]
        near = Guest(robot, outline, side, max(outline.clear(strip), wanted), wanted)
        if outline.crown == -inf:
            return [near]
        depths = (
            later.clear(strip) + later.behind
            for where, later in self._later(way, SOON)
            if where == side and later.crown == -inf
        )
        out = up(outline.crown + max(depths, default=0.0))
        return [near] if out <= near.travel else [near, replace(near, travel=out, wanted=out)]

    def _stations(
        self, way: _Way, stop: Stop, guests: Sequence[Guest], least: float
    ) -> Iterator[_Way]:
        """The stations at which something becomes clear, as long as the way there is worth it."""
        least = up(least + self._back(stop, guests))
        tried = {least, *self._next(way, least)}
        for guest in guests:
            tried |= way.beside[guest.side].starts(guest.outline, least)
        best, weight = inf, self.task.weights[self.robot]
        for station in sorted({up(value) for value in tried}):
            further = station - way.station
            moving = self.task.pace.rest(further) + further / self.task.pace.speed
            if way.cost + weight * moving > best + SPAN / self.task.pace.speed:
                break
            placed = [_came(way.beside, guest, station, guest.travel) for guest in guests]
            if max(guest.travel for guest in placed) < inf:
                added = self._added(way, stop, station, placed)
                best = min(best, added.cost)
                yield added

    def _next(self, way: _Way, least: float) -> Iterator[float]:
        """The station of the next stop without this one: stopping there once saves time."""
        for side, outline in self._later(way, 1):
            starts = way.beside[side].starts(outline, least)
            yield from (start for start in starts if start < least + ALIGN)

    def _added(self, way: _Way, stop: Stop, station: float, guests: Sequence[Guest]) -> _Way:
        time = self._time(way, stop, station, guests)
        coming = [(guest.side, guest.outline.shape) for guest in guests]
        return _Way(
            station,
            _taken(way.beside, guests),
            (*way.guests, *guests),
            (*way.stations, station),
            (*way.piles, self.own.placed(stop, station, self._further(stop, guests), coming)),
            way.time + time,
            way.cost + self._cost(way, time, station, guests, len(stop.unlike)),
        )

    def _back(self, stop: Stop, guests: Iterable[Guest]) -> float:
        """Displacement behind its station for the operation of a stop farthest back [m]."""
        return max(0.0, -min(self._further(stop, guests).values(), default=0.0))

    def _further(self, stop: Stop, guests: Iterable[Guest]) -> dict[int, float]:
        """Displacements beyond its station for the operations of a stop [m]."""
        return self.own.further(stop, ((guest.robot, guest.outline.shape) for guest in guests))

    def _time(self, way: _Way, stop: Stop, station: float, guests: Sequence[Guest]) -> float:
        """How long the operations at a stop take in each unit [s]. The carrier goes further for the
        first of them, but at the first stop, which it goes back for; for each other it stands there
        while robots come again."""
        pace, operation = self.task.pace, stop.first
        ways = self._ways(way, stop, station)
        longest = sum(self._longest(way, operation, move, guests) for move in ways) / len(ways)
        again = max((2 * pace.rest(guest.travel) for guest in guests), default=0.0)
        others = sum(o.dwell + pace.lost + again for o in stop.unlike[1:])
        if len(way.piles) > 1:  # it comes from the stop before, or goes on to one that is further
            others += 2 * (stop.visits - 1) * pace.rest(station - way.station)
        share = len(ways) / self.task.factory.period
        return share * (longest + operation.dwell + pace.lost + others)

    def _ways(self, way: _Way, stop: Stop, station: float) -> list[float]:
        """How far it goes to a stop in each unit of a period in which it comes there, from where it
        stops before in that unit [m]."""
        stations = dict.fromkeys((o.turn for o in stop.operations), 0.0)
        for before, at in zip(self.own.stops, way.stations, strict=False):
            stations |= {o.turn: at for o in before.operations if o.turn in stations}
        return [station - at for at in stations.values()]

    def _longest(
        self, way: _Way, operation: Operation, move: float, guests: Sequence[Guest]
    ) -> float:
        """Duration of the longest way of a guest to a stop [s]."""
        pace = self.task.pace
        longest = rested = pace.rest(move)
        for guest in guests:
            if guest.outline.shape.tool or guest.robot not in operation.robots:
                continue
            if not way.piles:
                longest = max(longest, pace.rest(guest.travel))
                continue
            standoff = self._standoff(operation, way.piles[-1][1], guest)
            longest = max(longest, pace.staged(guest.travel, standoff, pace.entered(rested)))
        return longest

    def _standoff(self, operation: Operation, pile: Extent, guest: Guest) -> float:
        if operation.robots.index(guest.robot) == operation.lowered:
            return BESIDE
        towards = extent_to(pile, guest.side)
        return max(0.0, guest.outline.shape.last[1] + towards + self.task.clearance.c)

    def _cost(
        self, way: _Way, time: float, station: float, guests: Sequence[Guest], tours: int
    ) -> float:
        """The cost of one more stop: its time, the way back from there, and the ways of guests,
        over a number of tours."""
        pace, weights = self.task.pace, self.task.weights
        cost = weights[self.robot] * (time + (station - way.station) / pace.speed)
        if not way.piles and guests:
            ahead = max(max(guest.outline.high) for guest in guests)
            cost += weights[self.robot] * 2 * ahead / pace.speed
        for guest in guests:
            cost += BARE * self._bare(guest)
            cost += tours * weights[guest.robot] * pace.rest(guest.travel)
            cost += PATH * guest.travel / pace.speed
        return cost

    def _finished(self, way: _Way, beside: Mapping[int, Skyline]) -> tuple[float, Outline] | None:
        """A way with its cost and outline, every travel fixed. None where a path is blocked."""
        strip, guests = self.own.strip_at(way.piles), list[Guest]()
        for guest in way.guests:
            outline = guest.outline
            clear = outline.clear(strip(guest.side, guest.station + outline.high[PAYLOADS]))
            least = max(clear, guest.wanted) if outline.shape.travels else 0.0
            guests.append(_came(beside, guest, guest.station, least))
            if guests[-1].travel == inf:
                return None
            beside = _taken(beside, guests[-1:])
        choice = Choice(
            {guest.robot: guest.side for guest in guests},
            {guest.robot: guest.travel for guest in guests},
            dict(self._stations_of(way)),
        )
        outline = outlined(self.own, way.piles, guests, choice)
        return self._worth(way, outline), outline

    def _stations_of(self, way: _Way) -> Iterator[tuple[int, float]]:
        """The station of each operation, by its number."""
        outlines = {guest.robot: guest for guest in way.guests}
        for stop, station in zip(self.own.stops, way.stations, strict=True):
            there = (outlines[robot] for robot in stop.guests)
            further = self._further(stop, there)
            for operation in stop.operations:
                yield operation.index, station + further.get(operation.index, 0.0)

    def _worth(self, way: _Way, outline: Outline) -> float:
        """What an outline costs [s]: the robot's own time there and back, and what its breadth adds
        to the way of the one it delivers to."""
        task, pace, weights = self.task, self.task.pace, self.task.weights
        travel = max(outline.ahead, 0.0)
        first = (g.travel for g in way.guests if g.station == way.stations[0])
        back = pace.rest(travel) - max(map(pace.rest, first), default=0.0)
        time = way.time + max(back, 0.0) + pace.rest(max(travel - way.station, 0.0))
        factory = task.factory
        last = factory.robots[self.robot].operations[-1]
        carrier = factory.operations[last].carrier
        behind = 0.25 if factory.robots[carrier].operations[0] == last else 1.0
        breadth = task.breadth * (max(outline.high) - behind * min(outline.low))
        ways = weights[carrier] * breadth + PATH * sum(outline.choice.travels.values())
        lacking = BARE * sum(map(self._bare, way.guests))
        return weights[self.robot] * time + ways / pace.speed + lacking

    def _bare(self, guest: Guest) -> int:
        return bare(self.task.factory, guest.robot, guest.outline.shape.hand)


def _came(beside: Mapping[int, Skyline], guest: Guest, station: float, least: float) -> Guest:
    """A robot at a station beside what is there already, with at least a given travel; not
    elsewhere if it is fixed."""
    travel = beside[guest.side].travel(guest.outline, station, least)
    if not guest.outline.shape.travels and travel > least:
        travel = inf
    return replace(guest, station=station, travel=travel)


def _taken(beside: Mapping[int, Skyline], guests: Sequence[Guest]) -> dict[int, Skyline]:
    """The skylines beside the path with guests at their stations."""
    skylines = dict(beside)
    for guest in guests:
        skyline = skylines[guest.side]
        skylines[guest.side] = skyline.taken(guest.outline, guest.station, guest.travel)
    return skylines
