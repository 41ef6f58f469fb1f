"""When the units of a word leave: the earliest firing of the timed net in which those units that
nobody has ordered take no time."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import inf

from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.demand import Word
from factory.engine.timing.distributed import Scan, ScannedTimes
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import Timing


def cycle_of(
    timing: Timing, word: Word, wip: int | None = None, scans: Sequence[Scan] = ()
) -> CycleTime:
    """The cycle time of a layout and what allows no less; on demand, the mean interval between
    units as far as the `word` is known, and the busiest robot; with `scans`, that of robots which
    run their own programs."""
    if scans:
        return ScannedTimes(Timed.of(timing, wip=wip), scans).cycle
    if word.demand is None:
        return Timed.of(timing, wip=wip).cycle
    return WordTimes(Timed.of(timing), word).cycle


class WordTimes:
    """The times of a `word` in a timed net. Of standing changes it is not known when they come:
    each is taken to come as late as the bound on units inside allows."""

    def __init__(self, net: Timed, word: Word) -> None:
        self.timed, self.word = net, replace(word, units=[], fixed=0, wip=None, now=inf)
        while len(self.word.units) < word.most and word.demand is not None:
            self.word.made = max(0, len(self.word.units) + 1 - (word.wip or 1))
            if self.word.makes(self.word.fixed) is None:
                break
        self._wip = word.wip or len(self.word.units)

    @cached_property
    def dropoffs(self) -> list[float]:
        """When each unit is dropped off [s]."""
        factory, net, word = self.timed.timing.factory, self.timed.net, self.word
        begun, ready = self.timed.timing.first, self.timed.ready
        served = self.timed.timing.coordinated.served.values()
        first = {o.start for o in factory.leaves} | {net.right[one.top] for one in served}
        ends = {o.end for o in factory.dropoffs}
        order = sorted(net.token_free.order, key=self._turns.__getitem__)
        dates, left = dict[tuple[int, int], float](), list[float]()
        lasting, last = self._lasting, dict[str, float]()
        units = factory.period
        for period in range(1 + max(word.units, default=-1) // factory.period):
            for event in order:
                date, unit = 0.0, period * units + self._turns[event]
                for place in net.net.preset[event]:
                    before = net.left[place], period - net.tokens[place]
                    if before in dates:
                        usual = self.timed.seconds[place]
                        seconds = usual if period else begun.get(place, usual)
                        date = max(date, dates[before] + seconds * self._takes(before))
                    elif word.is_made(unit):
                        date = max(date, ready.get(place, 0.0))
                number = word.number(unit)
                if event in first and word.is_made(unit):
                    date = max(date, word.placed(number))
                    if number >= self._wip:
                        date = max(date, left[number - self._wip])
                if machine := lasting.get(event):
                    date = last[machine] = date if word.is_made(unit) else last.get(machine, 0.0)
                dates[event, period] = date
                if event in ends and word.is_made(unit):
                    left.append(date)
        return left

    @property
    def bottleneck(self) -> str:
        """The robot that is in operations longest."""
        factory = self.timed.timing.factory
        sums = {robot.name: 0.0 for robot in factory.robots}
        made = Counter(unit % factory.period for unit in self.word.units)
        for o in factory.operations:
            for robot in o.robots:
                sums[factory.robots[robot].name] += made[o.turn] * self.timed.seconds[o.place]
        return max(sums, key=sums.__getitem__)

    @property
    def cycle(self) -> CycleTime:
        """The mean interval between the units of the last half, and the bottleneck."""
        last = self.dropoffs[len(self.dropoffs) // 2 - 1 :] if len(self.dropoffs) > 1 else [0.0]
        return CycleTime((last[-1] - last[0]) / max(1, len(last) - 1), self.bottleneck)

    @cached_property
    def _lasting(self) -> dict[int, str]:
        """The machine whose carriage or slider has come past a point, by that transition. In a unit
        that is not made it is still where the one before left it."""
        coordinated, net = self.timed.timing.coordinated, self.timed.net
        lasting: dict[int, str] = {
            net.right[p]: f"axis {past.axis}" for past, (p, _) in coordinated.passes.items()
        }
        for number, one in coordinated.served.items():
            carrier = self.timed.timing.factory.operations[number].carrier
            lasting |= {net.right[one.up]: f"up {carrier}", net.right[one.top]: f"down {carrier}"}
        return lasting

    def _takes(self, before: tuple[int, int]) -> bool:
        """Whether a token stays where a transition, in some period, has put it."""
        event, period = before
        return self.word.is_made(period * len(self.word.sequence) + self._turns[event])

    @cached_property
    def _turns(self) -> list[int]:
        """For which unit of a period each transition is."""
        factory, coordinated = self.timed.timing.factory, self.timed.timing.coordinated
        turns = [operation.turn for operation in factory.operations for _ in range(2)]
        turns += [0] * (len(self.timed.net.net.transitions) - len(turns))
        for past, (place, _) in coordinated.passes.items():
            turns[self.timed.net.right[place]] = factory.operation_of(past.after).turn
        for number, served in coordinated.served.items():
            turns[self.timed.net.right[served.top]] = factory.operations[number].turn
            turns[self.timed.net.right[served.up]] = factory.operations[served.before].turn
        return turns
