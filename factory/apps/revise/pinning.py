"""Pinned layout: that of a product's next revision, in which robots stay where they are.

The values of the old layout hold: sides, travels, stations, and the hands that still fit. A new
robot gets the station, on either side of its carrier's path, at which least has to move. What is
too near then moves away, one move at a time, until the layout is clear; of the moves that help, the
one that displaces fewest robots. As for every layout, the certificate decides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil

from factory.api import Certificate, Layout, LayoutMachines, LayoutSearch
from factory.apps.revise.pins import Pins
from factory.floor.layout.certificate import Fault
from factory.support.decimals import up

STEP = 0.02
"""Stations for what is new are so far apart [m]."""

BEYOND = 0.3
"""Stations are looked at so far beyond either end of a guidepath [m]."""

OUT = 3.0
"""A path leads out that is clear when it is so much longer [m]."""

TRIED = 2
"""So many stations of what is new, with a free path and without, are followed until the layout is
clear."""

AGAIN = 4
"""So often robots move whose hands would collide."""

MOVES = 60
"""The most moves of one layout."""

JUMPS = (0.0, 0.03, 0.1, 0.2, 0.4, 0.7, 1.1, 1.6)
"""How much further than what is lacking a robot may move [m]."""

JAM = 0.1
"""What counts as lacking where a fault has no distance [m]."""

WEIGHT, LENGTH, TIME = 0.004, 0.0005, 0.02
"""What each robot that is displaced counts as, each metre of guidepath, and each second of cycle
time [m lacking]."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """Travel [m] and side of each robot, station of each operation [m]."""

    travel: tuple[float, ...]
    stations: tuple[float, ...]
    sides: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Seen:
    """A stretch with its layout, what is wrong with it, and how bad that is [m]."""

    stretch: Stretch
    layout: Layout
    faults: tuple[Fault, ...]
    lacking: float
    score: float


class Pinning:
    """Lays out a factory with `pins`."""

    def __init__(self, search: LayoutSearch, pins: Pins) -> None:
        self.search, self.factory, self.pins = search, search.factory, pins
        self.names = {robot.name: robot.index for robot in self.factory.robots}
        self.on = search.carriers
        self._certificates: dict[Stretch, Certificate] = {}
        self.faults: tuple[Fault, ...] = ()

    def layout(self) -> Layout | None:
        """The layout with its certificate; None where none is found that is clear, then with its
        `faults`."""
        best = self._begun()
        for robot in self._new_guests():
            best = self._placed(best, robot)
        for _ in range(AGAIN):
            best = self._cleared(best)
            certificate = self._certificate(best)
            if certificate.holds:
                return replace(best.layout, certificate=certificate)
            self.faults = certificate.faults
            ways = [self._seen(move) for f in self.faults for move in self._moves(best.stretch, f)]
            clear = [way for way in ways if not way.faults]
            if not clear or best.faults:
                return None
            best = min(clear, key=lambda way: (len(self._certificate(way).faults), way.score))
        return None

    def _certificate(self, seen: _Seen) -> Certificate:
        if seen.stretch not in self._certificates:
            self._certificates[seen.stretch] = LayoutMachines(seen.layout).certify()
        return self._certificates[seen.stretch]

    def _begun(self) -> _Seen:
        """The pinned values, and those of a packed layout for all else."""
        free = self.search.packed().sides
        sides = {**free, **self.pins.sides}
        for o in self.factory.making:
            guests = [r for r in o.robots if r != o.carrier]
            if len(guests) == 2 and sides[guests[0]] == sides[guests[1]]:
                loose = next((r for r in guests if r not in self.pins.sides), guests[1])
                sides[loose] = -sides[loose]
        return self._seen(self._packed(self.search.admissible(sides)))

    def _packed(self, sides: dict[int, int]) -> Stretch:
        pins, packed = self.pins, self.search.packed(sides)
        robots = tuple(sides.get(robot, 0) for robot in range(len(self.on)))
        least = self.search.least_travels(_sides(robots))
        travel = (
            max(pins.travel.get(r, far), short)
            for r, (far, short) in enumerate(zip(packed.travel, least, strict=True))
        )
        stations = (pins.stations.get(n, s) for n, s in enumerate(packed.stations))
        return Stretch(tuple(travel), tuple(stations), robots)

    def _new_guests(self) -> list[int]:
        """The robots that are new and come to one that stays, after its first stop."""
        return [
            robot
            for robot in range(1, len(self.on))
            if robot not in self.pins.travel
            and self.on[robot] in self.pins.travel
            and self.factory.last(robot).index != self.search.carried(self.on[robot])[0]
        ]

    def _placed(self, seen: _Seen, robot: int) -> _Seen:
        """The stretch with a new robot where it displaces fewest, after moves: of the best stations
        with a free path, and the best without."""
        branch, clear, others = self.search.branch(robot), list[_Seen](), list[_Seen]()
        for side in (-1, +1):
            sides = {r: s for r, s in enumerate(seen.stretch.sides) if r} | {robot: side}
            if self.search.admissible(sides) != sides:
                continue
            for stretch in self._stations(seen.stretch, sides, robot):
                near = self._seen(stretch)
                if self._lacks(near, branch):
                    others.append(near)
                    near = self._out(stretch, robot, branch) or near
                if not self._lacks(near, branch):
                    clear.append(near)
        best = (sorted(ways, key=lambda way: way.score)[:TRIED] for ways in (clear, others))
        cleared = [self._cleared(way) for ways in best for way in ways]
        return min(cleared, key=lambda way: (way.lacking > 0, way.score), default=seen)

    def _out(self, stretch: Stretch, robot: int, branch: list[int]) -> _Seen | None:
        """The stretch with a robot as far out as needed; None if its path is blocked."""
        if self._lacks(self._seen(self._further(stretch, robot, OUT)), branch):
            return None
        ways = (self._seen(self._further(stretch, robot, by)) for by in JUMPS[1:])
        return next((way for way in ways if not self._lacks(way, branch)), None)

    def _lacks(self, seen: _Seen, branch: list[int]) -> bool:
        """Whether a fault concerns some of these robots."""
        return any(self.names[name] in branch for fault in seen.faults for name in fault.robots)

    def _stations(self, stretch: Stretch, sides: dict[int, int], robot: int) -> Iterator[Stretch]:
        """A stretch with a new robot on a side, at stations all along its carrier's path, and
        beyond its ends."""
        packed, carrier = self._packed(sides), self.on[robot]
        inside = self.search.branch(robot)
        travel = [packed.travel[r] if r in inside else t for r, t in enumerate(stretch.travel)]
        carried_by = {n for r in inside for n in self.search.carried(r)}
        stations = [
            packed.stations[n] if n in carried_by else s for n, s in enumerate(stretch.stations)
        ]
        count = ceil((travel[carrier] + BEYOND) / STEP)
        least = -ceil(BEYOND / STEP) if carrier else 0
        made = self.search.carried(carrier)
        for number in range(least, count):
            at, back = number * STEP, max(0.0, -number * STEP)
            moved, far = [*stations], [*travel]
            moved[self.factory.last(robot).index] = at
            for n in made:
                moved[n] = round(moved[n] + back, 6)
            far[carrier] = round(max(far[carrier] + back, at + STEP), 6)
            yield Stretch(tuple(far), tuple(moved), tuple(sides.get(r, 0) for r in range(len(far))))

    def _cleared(self, seen: _Seen) -> _Seen:
        """The stretch after moves, until it is clear or none helps."""
        for _ in range(MOVES):
            faults = seen.faults
            moves = {move for fault in faults[:3] for move in self._moves(seen.stretch, fault)}
            ways = [self._seen(move) for move in sorted(moves, key=lambda m: m.travel)]
            better = [way for way in ways if way.lacking < seen.lacking - 1e-6]
            if not better:
                return seen
            seen = min(better, key=lambda way: way.score)
        return seen

    def _moves(self, stretch: Stretch, fault: Fault) -> Iterator[Stretch]:
        """Moves by which two robots that are too near get apart: either one, or its branch of their
        common path, goes further out or comes to a later station."""
        chains = [self._chain(self.names[name]) for name in dict.fromkeys(fault.robots)]
        tops = list[int]()
        for chain in chains:
            others = {r for other in chains if other is not chain for r in other}
            below = [r for r in chain if r not in others]
            tops += [*below[:1], *below[-1:]]
        lacking = up(max(fault.lacking, 0.001))
        for robot in dict.fromkeys(tops):
            for jump in JUMPS[:5]:
                yield self._further(stretch, robot, lacking + jump)
                if robot:
                    yield self._later(stretch, robot, lacking + jump, False)
                    yield self._later(stretch, robot, lacking + jump, True)

    def _chain(self, robot: int) -> list[int]:
        chain = [robot]
        while self.on[chain[-1]] >= 0:
            chain.append(self.on[chain[-1]])
        return chain

    def _further(self, stretch: Stretch, robot: int, by: float) -> Stretch:
        """With a robot that comes from further out."""
        travel = [*stretch.travel]
        travel[robot] = round(travel[robot] + by, 6)
        return replace(stretch, travel=tuple(travel))

    def _later(self, stretch: Stretch, robot: int, by: float, longer: bool) -> Stretch:
        """With a robot and those after it at later stations of their carrier, whose way from there
        is as long as it was, or shorter."""
        carrier, number = self.on[robot], self.factory.last(robot).index
        made, travel = self.search.carried(carrier), [*stretch.travel]
        stations = [*stretch.stations]
        for n in made:
            if n == number or stations[n] > stations[number]:
                stations[n] = round(stations[n] + by, 6)
        if longer:
            travel[carrier] = round(travel[carrier] + by, 6)
        travel[carrier] = max(travel[carrier], max(stations[n] for n in made))
        return replace(stretch, travel=tuple(travel), stations=tuple(stations))

    def _seen(self, stretch: Stretch) -> _Seen:
        """A stretch with its layout and faults."""
        far = (stretch.travel[0] + 1.0, *stretch.travel[1:])
        lengths = far, stretch.stations, _sides(stretch.sides)
        layout = self.search.drafted(*lengths, self.pins.travel[0])
        faults = tuple(LayoutMachines(layout).crowding_faults)
        lacking = sum(fault.lacking or JAM for fault in faults)
        displaced = len(self.pins.ends) - len(self.pins.in_place(layout)[1])
        score = lacking + WEIGHT * displaced + LENGTH * layout.guidepath_length
        score += TIME * self.search.pace.cycle_of(layout)
        return _Seen(stretch, layout, faults, lacking, score)


def _sides(of: tuple[int, ...]) -> dict[int, int]:
    """The sides of robots (index) but the output robot, by their numbers."""
    return {robot: side for robot, side in enumerate(of) if robot}
