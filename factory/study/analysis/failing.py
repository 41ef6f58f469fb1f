"""The expected cycle time where operations fail: a Monte Carlo run of the timed net."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import lcm

from factory.study.analysis.clearing import clearing_of
from factory.study.analysis.timed import LONGEST_PERIOD, SAME, TimedNet
from factory.study.analysis.timing import Timing
from factory.timing.failing import FailingNet, FailingRun, Rates, drawn, failing_run

UNITS = 2000
"""So many products are made, fewer of a large factory."""

WORK = 2_000_000
"""The most firings, retries apart."""

LEAST = 200
"""No fewer products are made."""


@dataclass(frozen=True)
class FailingPace:
    """The pace with some `rates` of failures, where what is lost lies for `clear` [s], of a run of
    `units` with a `seed`: the mean interval between products, the first tenth left out, `cycle`
    [s]; `loss`: the share by which that is longer than without failures. Both are None where the
    run stopped too early to say."""

    rates: Rates
    clear: float
    units: int
    seed: int
    cycle: float | None
    loss: float | None
    run: FailingRun = field(repr=False)

    @property
    def made(self) -> int:
        """How many of the units were made."""
        return len(self.run.dates)

    @property
    def redone(self) -> int:
        """How many attempts were done again."""
        return sum(self.run.redone.values())

    @property
    def scrapped(self) -> int:
        """How many scraps there were."""
        return sum(self.run.scrapped.values())


def failing_net(timing: Timing, net: TimedNet, clear: float = 0.0) -> FailingNet:
    """The timed net of a laid-out factory whose operations may fail. Robots take as long back as
    they took for the operation, without its dwell; what is lost lies for `clear` [s]."""
    pairs = zip(timing.delays, timing.modes, strict=True)
    back = [delay - mode.dwell for delay, mode in pairs]
    return FailingNet(
        timing.factory,
        net.net,
        net.seconds,
        back,
        net.first,
        net.ready,
        net.ways,
        clearing_of(timing, clear),
    )


def failing_pace(
    timing: Timing, net: TimedNet, rates: Rates, units: int | None = None, clear: float = 0.0
) -> FailingPace:
    """The pace with some rates of failures; without any, that of the timed net once that has
    settled. The seed is that of the timing; what is lost lies for `clear` [s]."""
    if units is None:
        units = min(UNITS, max(LEAST, WORK // len(net.net.net.transitions)))
    subject = failing_net(timing, net, clear)
    run = failing_run(subject, drawn(rates, timing.seed), units)
    turn = min(lcm(*(circuit.tokens for circuit in net.critical)), LONGEST_PERIOD) * net.units
    made = len(run.dates)
    count = (made - 1 - made // 10) // turn * turn
    cycle = (run.dates[-1] - run.dates[-1 - count]) / count if count > 0 else None
    loss = cycle / net.pace - 1 if cycle is not None and net.pace else None
    if loss is not None and abs(loss) < SAME:
        cycle, loss = net.pace, 0.0
    lies = subject.clearing.seconds if subject.clearing else 0.0
    return FailingPace(rates, lies, units, timing.seed, cycle, loss, run)
