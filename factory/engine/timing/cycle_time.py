"""Cycle times: of a gear net by its gears, and of a gear train by its critical circuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from factory.support.errors import Diagnostic, did_you_mean
from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.ways import train_ratio
from factory.theory.plant.factory import Factory

Delays = Mapping[str, float] | Sequence[float]
"""Seconds that a token stays on a place: by the place's name (an operation's is its label), or by
the numbers of the first places, which are the operations. A place left out takes no time."""

WITHIN = 5e-3
"""A cycle time is met within this [s]: the half of a hundredth, as it is printed."""


@dataclass(frozen=True, slots=True)
class CycleTime:
    """The mean time between two products [s], and the robot that allows no less."""

    seconds: float
    bottleneck: str

    def meets(self, asked: float) -> bool:
        """Whether it is no longer than the cycle time asked for [s]."""
        return self.seconds <= asked + WITHIN

    def too_slow(self, asked: float, instead: str) -> Diagnostic:
        """That no factory was found that meets the cycle time asked for [s] (SlowCycle), and what
        to do instead."""
        least = f"{self.seconds:.2f}"
        message = f"the fastest factory found takes {least} s a product, not {asked:g} s"
        return Diagnostic("SlowCycle", message, None, f"--cycle {least}, or {instead}")

    @classmethod
    def of(
        cls,
        subject: Factory | GearNet,
        delays: Delays,
        ways: Mapping[tuple[int, int], float] = MappingProxyType({}),
    ) -> CycleTime:
        """The maximum over robots of the summed delays of its gear, which carries one token; of a
        gear train the maximum cycle ratio. `ways`: what a robot (index) takes to a place [s] while
        it waits for it (`with_ways`).

        Holds since the simple circuits of a gear net are its gears. Where the factory makes several
        units in one cycle of its net, it is that of one of them. The first robot that attains it is
        the bottleneck; in a gear train the first that spends most of the critical circuit. Raises
        ValueError where a delay is negative or names no place, or a gear train is not live.
        """
        net = subject.net if isinstance(subject, Factory) else subject
        units = subject.period if isinstance(subject, Factory) else 1
        seconds = _seconds(MarkedNet.of(net), delays)
        if not net.is_tree:
            ratio, (robot, *_) = train_ratio(net, seconds, ways)
            return cls(ratio.seconds / units, net.gears[robot].robot)
        sums = [
            sum(max(seconds[p], ways.get((robot, p), 0.0)) for p in gear.places)
            for robot, gear in enumerate(net.gears)
        ]
        slowest = max(range(len(sums)), key=sums.__getitem__)
        return cls(sums[slowest] / units, net.gears[slowest].robot)


def _seconds(net: MarkedNet, delays: Delays) -> list[float]:
    seconds = [0.0] * len(net.tokens)
    if isinstance(delays, Mapping):
        for name, delay in delays.items():
            if name not in net.net.place_index:
                hint = did_you_mean(name, list(net.net.place_index), "places")
                raise ValueError(f"no place is called '{name}': {hint}")
            seconds[net.net.place_index[name]] = float(delay)
    elif len(delays) > len(seconds):
        raise ValueError(f"{len(delays)} delays for {len(seconds)} places")
    else:
        seconds[: len(delays)] = map(float, delays)
    if any(not delay >= 0 for delay in seconds):
        raise ValueError("delays must be numbers, and not negative")
    return seconds
