"""Feeders: each presents the next part of its label, the n-th for unit n.

A copy enters a housing unseen, while the slider is up. It comes down when the robot that took the
previous one is out of the way. The feeders of one line, whose parts one robot takes, take turns in
the order of its program: no part comes down before all their sliders are at rest. Whose turn it is
follows from the number of parts that each has presented.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from factory.engine.mjcf.masks import feeder_codes
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.parts import presented_at
from factory.engine.simulation.mujoco.courses import Points
from factory.engine.simulation.mujoco.holdings import Holdings
from factory.engine.simulation.mujoco.passing import Passing
from factory.engine.simulation.mujoco.sliders import Sliders
from factory.engine.simulation.mujoco.strokes import NEVER
from factory.engine.simulation.mujoco.supply import Supply, TakenBack
from factory.engine.simulation.mujoco.welds import Place, Welds
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.feeding import Outlet, lines_of, outlets_of
from factory.support.arrays import Index
from factory.theory.plant.operation import Operation


@dataclass(frozen=True, slots=True)
class Station:
    """The outlet of a feeder.

    Attributes:
        label: the label of its parts.
        robot: the robot (index) that takes them.
        code: the feeder's code as a holder.
        down: position of a part with the slider down [m].
        up: position of a part with the slider up [m].
    """

    label: str
    robot: int
    code: int
    down: Place
    up: Place


class Feeders:
    """The feeders of a factory, by outlet (n,).

    Attributes:
        supply: which units need parts.
        back: withdrawn parts.
        lacking: labels of parts that robots wait for.
        due: the time by which such a part must come to be in time [s].
        blocked: the points past which the robots are out of the way of empty sliders that wait for
            them; None for no such slider.
        clear_from: none of them is there before this [s].
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
        self.due = self.clear_from = NEVER
        self.blocked: Points | None = None
        self._spent = dict[int, int]()
        self._number = {station.label: n for n, station in enumerate(self._stations)}
        operations, rising = model.factory.operations, coordinated(model.layout).rising
        self._rising = {
            start: [self._number[operations[number].label] for number in before]
            for start, before in rising.items()
        }
        lines = ([self._number[outlet.label] for outlet in line] for line in lines_of(model.layout))
        self._lines = {self._stations[line[0]].code: line for line in lines if line}

    def _turn(self, line: Sequence[int], rounds: Mapping[str, int]) -> int:
        """Whose turn it is in a line after given rounds of each label: the first that is behind."""
        return min(line, key=lambda number: rounds[self._stations[number].label])

    def _vacant(self) -> list[int]:
        """Feeders whose turn it is in lines that present and withdraw nothing, except those that
        ran out and have had no copy back since."""
        empty, returns = self._lines.keys() - self._holdings.holders, self._holdings.returns
        lines = [self._lines[code] for code in empty if self._spent.get(code) != returns]
        return sorted(number for number in map(self._next, lines) if number is not None)

    def _next(self, line: Sequence[int]) -> int | None:
        """Whose turn it is in a line; None while the next unit is not known."""
        while True:
            number = line[0] if len(line) == 1 else self._turn(line, self.supply.rounds())
            label = self._stations[number].label
            if self.supply.skips_none:
                return number
            if not self.supply.skips(label):
                return number if self.supply.is_known(label) else None

    def serves(self, label: str) -> bool:
        """Whether robots take such labels from feeders."""
        return label in self._number

    @property
    def welds(self) -> dict[str, int]:
        """The weld that holds the part that a feeder presents, by label."""
        stations = ((label, self._stations[n].code) for label, n in self._number.items())
        return {label: self._holdings.weld[code, label] for label, code in stations}

    @property
    def trees(self) -> dict[int, int]:
        """The code of each slider's feeder, by kinematic tree."""
        codes = (station.code for station in self._stations)
        return dict(zip(self._sliders.trees.tolist(), codes, strict=True))

    def begin(self) -> None:
        """At the start, let each feeder present a part if it can and its robot is not yet under way
        with another."""
        due = [number for number in self._vacant() if not self._passing.holds[number]]
        self._sliders.begin(self._load(due, down=True))

    def presents(self, label: str, unit: int) -> bool:
        """Whether a robot may come for the part of a unit: it will be down before the robot, and
        may be let in."""
        if not self.supply.word.lets_in(unit):
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

    def sliders_are_up(self, operation: Operation) -> bool:
        """Whether no slider that an operation waits for is on its way up."""
        moving = [n for n in self._rising.get(operation.start, ()) if self._sliders.rises(n)]
        self.due = min((self.due, *(float(self._sliders.ends[number]) for number in moving)))
        return not moving

    def taken(self, label: str) -> None:
        """The robot takes the presented part."""
        self._passing.holding(self._stations[self._number[label]].robot)

    def end(self, operations: Sequence[Operation]) -> None:
        """Operations have ended: sliders whose parts were taken go up."""
        for operation in operations:
            self._passing.end(operation)
        taken = [self._number[o.label] for o in operations if o.label in self._number]
        self._send(np.array(taken, np.intp), down=False)

    def tend(self) -> bool:
        """Let the next parts come down from housings whose sliders are up and whose robots are out
        of the way. Returns whether an awaited part comes."""
        self._sliders.settle()
        if self.back.numbers:
            self._take_back()
        busy = self._busy()
        idle = [n for n in self._vacant() if self._stations[n].code not in busy]
        is_clear = self._passing.clear() if idle else ()
        free = [number for number in idle if is_clear[number]]
        self.blocked = self._passing.points([number for number in idle if not is_clear[number]])
        self.clear_from = NEVER
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

    def until_clear(self) -> float:
        """No robot comes out of the way before so long [s], whatever pushes it."""
        return NEVER if self.blocked is None else self._passing.until_past(self.blocked)

    def at_rest(self) -> Iterator[tuple[Station, int, int]]:
        """Presented parts on resting sliders that no camera has examined: station, unit, body."""
        for label, unit in self.shown().items():
            number = self._number[label]
            if label not in self.back.good and self._sliders.ends[number] == NEVER:
                yield self._stations[number], unit, self._holdings[label, unit]

    def take_back(self, label: str, scrap: int) -> None:
        """Withdraw a presented part; it belongs to the unit `scrap` from now on."""
        number = self._number[label]
        self.supply.next[label] -= self.supply.period
        self._holdings.assign({self._holdings.held(self._stations[number].code)[label]: scrap})
        self.back.numbers.append(number)
        self.back.good.discard(label)

    def served(self) -> Iterator[str]:
        """Labels of feeders that withdraw a part, except those blocked by their robots."""
        for number in self.back.numbers:
            if self._passing.is_aside(number):
                line = self._lines.get(self._stations[number].code, ())
                yield from (self._stations[n].label for n in line)

    def shown(self) -> dict[str, int]:
        """The unit of the presented part of each label, in the order of presentation."""
        codes, rows = {station.code for station in self._stations}, self._holdings.rows()
        labels = (holding.label for _, holding in rows if holding.holder in codes)
        return {label: unit for label in labels if (unit := self.shows(label)) is not None}

    def shows(self, label: str) -> int | None:
        """The unit of the presented part of a label; None for none."""
        number = self._number[label]
        body = self._holdings.held(self._stations[number].code).get(label)
        return None if body is None or number in self.back.numbers else self._holdings.of(body).unit

    def undone(self, units: Mapping[str, int], rounds: Mapping[str, int], scrap: int) -> None:
        """Set the next unit of each label and the rounds made; parts whose turn it no longer is are
        withdrawn."""
        self.lacking.clear()
        self._spent.clear()
        turns = {self._turn(line, rounds) for line in self._lines.values()}
        for label, unit in units.items():
            number, is_shown = self._number[label], self.shows(label) is not None
            self.supply.next[label] = unit + self.supply.period * is_shown
            if is_shown and number not in turns:
                self.take_back(label, scrap + number)

    def in_the_way(self) -> set[int]:
        """Robots (index) that stand under a late part that they wait for."""
        vacant = self._vacant()
        due = (self._stations[n] for n in self._obstructed() if n in vacant)
        return {station.robot for station in due if self._supplied(station.label)}

    def _obstructed(self) -> list[int]:
        """Late feeders whose robots stand where the next part comes down. Only after a failure: the
        layout sees to it otherwise."""
        late = self.back.late if self.supply.recovers else ()
        return [n for n in late if self._passing.is_under(n)]

    def stay_clear(self, robot: int) -> None:
        """Let the next part of a robot (index) come down only when the robot is out of the way."""
        self._passing.require_clear(robot)

    def _take_back(self) -> None:
        """Move sliders with withdrawn parts up, and release these out of sight."""
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

    def _busy(self) -> set[int]:
        """The codes of lines in which a slider moves, or which must present nothing yet."""
        (moving,) = (self._sliders.ends < NEVER).nonzero()
        waiting = [self._number[label] for label in self.back.awaited if self.serves(label)]
        return {self._stations[n].code for n in (*moving.tolist(), *waiting)}

    def _send(self, numbers: Index, down: bool) -> None:
        self._sliders.send(numbers, down)
        self._welds.masks.fresh.update(self._stations[n].code for n in numbers.tolist())

    def _load(self, numbers: Sequence[int], down: bool = False) -> Index:
        """Put copies into feeders that have some to spare and units that need them. Returns
        which."""
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
    x, y, z = presented_at(outlet.layout, outlet.label)
    up = x, y, z + outlet.feeder.stroke
    return Station(outlet.label, outlet.robot, code, (x, y, z), up)
