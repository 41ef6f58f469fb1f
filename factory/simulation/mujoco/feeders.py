"""Feeders: each presents the next part of its label, the n-th for unit n.

A copy gets into a housing while the slider is up, where nothing of it can be seen. It comes down
when the robot that has taken the last one is out of the way. Feeders of one line, whose parts one
robot takes, take turns in the order of its program: no part comes down before all their sliders are
at rest. Whose turn it is follows from how many parts each has shown.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Index
from factory.layout.feeding import Outlet, outlets_of
from factory.layout.layout import Layout
from factory.mjcf.masks import feeder_codes
from factory.mjcf.model import Model
from factory.mjcf.parts import presented_at
from factory.plant.factory import Operation
from factory.simulation.mujoco.holdings import Holdings
from factory.simulation.mujoco.passing import Passing
from factory.simulation.mujoco.sliders import NEVER, Sliders
from factory.simulation.mujoco.supply import Supply, TakenBack
from factory.simulation.mujoco.welds import Place, Welds


@dataclass(frozen=True, slots=True)
class Station:
    """An outlet of a feeder: the label of its parts, the robot (index) that takes them, its
    feeder's code, and where the part is while the slider is down, and up."""

    label: str
    robot: int
    code: int
    down: Place
    up: Place


class Feeders:
    """The feeders of a factory, by their outlets (n,). `counts`: how often each transition has
    fired where the run starts.

    `lacking`: the labels of parts that robots have asked for, and that have not come. `due`: when a
    part that a robot has asked for too early comes soon enough [s]. `back`: what is taken back.
    """

    def __init__(
        self,
        model: Model,
        holdings: Holdings,
        welds: Welds,
        sliders: Sliders,
        passing: Passing,
        supply: Supply,
    ) -> None:
        self._holdings, self._welds, self._sliders = holdings, welds, sliders
        self._passing, self.supply = passing, supply
        outlets = outlets_of(model.layout)
        codes = feeder_codes(model.factory, outlets)
        self._stations = [_station(outlet, codes[outlet.robot]) for outlet in outlets]
        self.back = TakenBack()
        self.lacking = set[str]()
        self.due = NEVER
        self._spent = dict[int, int]()
        self._serve(model.layout)

    def _serve(self, layout: Layout) -> None:
        """From now on robots take parts as in a layout."""
        by_label = layout.factory.by_label
        self._number = {
            station.label: n
            for n, station in enumerate(self._stations)
            if by_label[station.label].carrier == station.robot
        }
        robots = range(len(layout.factory.robots))
        lines = ([self._number[label] for label in layout.magazine(robot)] for robot in robots)
        self._lines = {self._stations[line[0]].code: line for line in lines if line}

    def _turn(self, line: Sequence[int], rounds: Mapping[str, int]) -> int:
        """Whose turn it is in a line, after so many rounds of each label: the first that is
        behind."""
        return min(line, key=lambda number: rounds[self._stations[number].label])

    def _vacant(self) -> list[int]:
        """The feeders whose turn it is in lines that show nothing and take nothing back, but for
        those for which nothing was left, and has not come back since."""
        empty, returns = self._lines.keys() - self._holdings.holders, self._holdings.returns
        lines = [self._lines[code] for code in empty if self._spent.get(code) != returns]
        return sorted(number for number in map(self._next, lines) if number is not None)

    def _next(self, line: Sequence[int]) -> int | None:
        """Whose turn it is in a line; None while it is not known which unit is made next."""
        while True:
            number = line[0] if len(line) == 1 else self._turn(line, self.supply.rounds())
            label = self._stations[number].label
            if not self.supply.skips(label):
                return number if self.supply.is_known(label) else None

    def serves(self, label: str) -> bool:
        """Whether robots take such things from feeders."""
        return label in self._number

    @property
    def welds(self) -> dict[str, int]:
        """What holds the part that a feeder presents, by label."""
        stations = ((label, self._stations[n].code) for label, n in self._number.items())
        return {label: self._holdings.weld[code, label] for label, code in stations}

    @property
    def trees(self) -> dict[int, int]:
        """The code of the feeder that each slider is of, by its kinematic tree."""
        codes = (station.code for station in self._stations)
        return dict(zip(self._sliders.trees.tolist(), codes, strict=True))

    def begin(self) -> None:
        """Where the run starts, each feeder presents a part if it can and its robot is not yet
        under way with another."""
        due = [number for number in self._vacant() if not self._passing.holds[number]]
        self._sliders.begin(self._load(due, down=True))

    def presents(self, label: str, unit: int) -> bool:
        """Whether a robot may come for the part for that unit: it is down before the robot can be
        there, and may be let in."""
        if not self.supply.admits(unit):
            return False
        number = self._number[label]
        if self.shows(label) != unit:
            self.lacking.add(label)
            return False
        ends = float(self._sliders.ends[number])
        enough = ends - self._passing.soonest(number) if ends < NEVER else -NEVER
        if enough > self._sliders.now:
            self.due = min(self.due, enough)
            return False
        return True

    def taken(self, label: str) -> None:
        """The robot takes the part."""
        self._passing.holding(self._stations[self._number[label]].robot)

    def end(self, operations: Sequence[Operation]) -> None:
        """These operations have ended: sliders whose parts have been taken go up."""
        for operation in operations:
            self._passing.end(operation)
        taken = [self._number[o.label] for o in operations if o.label in self._number]
        self._send(np.array(taken, np.intp), down=False)

    def tend(self) -> bool:
        """Let the next parts come down from housings whose sliders have come up, where the robots
        are out of the way. Whether one comes that a robot has asked for."""
        self._sliders.settle()
        if self.back.numbers:
            self._take_back()
        vacant = np.array(self._vacant(), np.intp)
        clear = vacant[self._passing.clear()[vacant]] if len(vacant) else vacant
        free = [number for number in clear.tolist() if not self._is_busy(number)]
        if free:
            late = self._obstructed()
            free = [number for number in free if number not in late]
        if not free:
            return False
        loaded = self._load(free)
        self._welds.write()
        self._send(loaded, down=True)
        come = self.lacking & {self._stations[number].label for number in loaded.tolist()}
        self.lacking -= come
        return bool(come)

    def at_rest(self) -> Iterator[tuple[Station, int, int]]:
        """The parts that are shown by sliders that rest, and have not been looked at: where, for
        which unit, and the body."""
        for label, unit in self.shown().items():
            number = self._number[label]
            if label not in self.back.good and self._sliders.ends[number] == NEVER:
                yield self._stations[number], unit, self._holdings[label, unit]

    def take_back(self, label: str, scrap: int) -> None:
        """A part that is shown goes back into the housing, and is no longer for any unit but for
        `scrap`."""
        number = self._number[label]
        self.supply.next[label] -= self.supply.period
        self._holdings.assign({self._holdings.held(self._stations[number].code)[label]: scrap})
        self.back.numbers.append(number)
        self.back.good.discard(label)

    def served(self) -> Iterator[str]:
        """The labels of feeders that take a part back, but for those whose robots are in its way:
        it waits for them."""
        for number in self.back.numbers:
            if self._passing.is_aside(number):
                line = self._lines.get(self._stations[number].code, ())
                yield from (self._stations[n].label for n in line)

    def shown(self) -> dict[str, int]:
        """The unit of the part that is shown of each label, as they came."""
        codes, rows = {station.code for station in self._stations}, self._holdings.rows()
        labels = (holding.label for _, holding in rows if holding.holder in codes)
        return {label: unit for label in labels if (unit := self.shows(label)) is not None}

    def shows(self, label: str) -> int | None:
        """The unit of the part that is shown of a label, None where none is."""
        number = self._number[label]
        body = self._holdings.held(self._stations[number].code).get(label)
        return None if body is None or number in self.back.numbers else self._holdings.of(body).unit

    def undone(self, units: Mapping[str, int], rounds: Mapping[str, int], scrap: int) -> None:
        """The next part of each label is for another unit, after so many rounds; what it is no
        longer the turn of is taken back."""
        self.lacking.clear()
        self._spent.clear()
        turns = {self._turn(line, rounds) for line in self._lines.values()}
        for label, unit in units.items():
            number, is_shown = self._number[label], self.shows(label) is not None
            self.supply.next[label] = unit + self.supply.period * is_shown
            if is_shown and number not in turns:
                self.take_back(label, scrap + number)

    def exchange(self, robot: int, layout: Layout) -> None:
        """A robot (index) is gone, and others take parts as in a layout. What is shown `elsewhere`
        has been taken back."""
        self._passing.gone(robot)
        self.lacking.clear()
        self._spent.clear()
        self._serve(layout)

    def elsewhere(self, layout: Layout) -> list[str]:
        """The labels of parts that are shown where they are not taken in a layout."""
        by_label = layout.factory.by_label
        robots = ((x, self._stations[self._number[x]].robot) for x in self.shown())
        return [label for label, robot in robots if by_label[label].carrier != robot]

    def in_the_way(self) -> set[int]:
        """The robots (index) under which a part comes late that they wait for."""
        vacant = self._vacant()
        due = (self._stations[n] for n in self._obstructed() if n in vacant)
        return {station.robot for station in due if self._supplied(station.label)}

    def _obstructed(self) -> list[int]:
        """Feeders that are late, whose robots stand where the next part comes down. That robots are
        in time for it, unless something fails, is in the layout."""
        late = self.back.late if self.supply.recovers else ()
        return [n for n in late if self._passing.is_under(n)]

    def stay_clear(self, robot: int) -> None:
        """The next part for a robot (index) comes down when that is out of the way."""
        self._passing.come_clear(robot)

    def _take_back(self) -> None:
        """Sliders with what is taken back go up, and let go of it where nothing of it is seen."""
        for number in [*self.back.numbers]:
            if self._sliders.ends[number] < NEVER:
                continue
            if not self._sliders.is_up(number):
                if not self._passing.is_aside(number):
                    continue
                self._sliders.send(np.array([number]), down=False, loaded=True)
                continue
            station = self._stations[number]
            self._holdings.put_away([self._holdings.held(station.code)[station.label]])
            self.back.numbers.remove(number)
        self._welds.write()

    def _is_busy(self, number: int) -> bool:
        """Whether a feeder is in a line of which a slider is on its way, or is to show nothing
        yet."""
        ends, line = self._sliders.ends, self._lines[self._stations[number].code]
        awaited = self.back.awaited
        return any(ends[n] < NEVER or self._stations[n].label in awaited for n in line)

    def _send(self, numbers: Index, down: bool) -> None:
        self._sliders.send(numbers, down)
        self._welds.masks.fresh.update(self._stations[n].code for n in numbers.tolist())

    def _load(self, numbers: Sequence[int], down: bool = False) -> Index:
        """Put the next copies into feeders, where there are some to spare and units that need
        them. Gives which."""
        loaded = [n for n in numbers if self._supplied(self._stations[n].label)]
        missing = {*numbers}.difference(loaded)
        codes = (self._stations[number].code for number in missing)
        self._spent |= dict.fromkeys(codes, self._holdings.returns)
        self.back.late = self.back.late.union(missing).difference(loaded)
        for number in loaded:
            station, supply = self._stations[number], self.supply
            unit = supply.next[station.label]
            supply.next[station.label] += supply.period
            body = self._holdings.take(station.label, unit, station.code)
            self._welds.place(body, station.down if down else station.up)
            self.back.good.discard(station.label)
            self.back.fresh[station.label] = unit
        return np.array(loaded, np.intp)

    def _supplied(self, label: str) -> bool:
        return bool(self._holdings.free[label]) and self.supply.wants(label)


def _station(outlet: Outlet, code: int) -> Station:
    x, y, z = presented_at(outlet.layout, outlet.leaf.label)
    up = x, y, z + outlet.feeder.stroke
    return Station(outlet.label, outlet.robot, code, (x, y, z), up)
