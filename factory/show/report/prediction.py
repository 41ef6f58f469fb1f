"""The pace of a recorded run as the timed net predicts it, where there is a layout."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.show.report.recording import Recording
from factory.study.analysis import Timing
from factory.study.analysis.flow import busy_until, flow, lasting
from factory.study.analysis.recorded import conditions
from factory.study.analysis.timed import timed_net


@dataclass(frozen=True)
class Predicted:
    """In seconds: the cycle time in the long run, the first product and the last of as many as the
    run made (None where it began in the middle); the duration of each operation; the share of the
    time until then that each robot is in operations. `critical`: what sets the pace, by name."""

    cycle: float
    first: float | None
    last: float | None
    critical: tuple[str, ...]
    durations: tuple[float, ...] = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)
    gears: tuple[float, ...] = field(repr=False)


def predicted(recording: Recording) -> Predicted | None:
    """The prediction; None where there is no layout to predict from."""
    if recording.layout is None:
        return None
    made = conditions(recording.log.header)
    timing = Timing(recording.layout, made.settings, made.world, made.seed, made.jitter)
    net = timed_net(timing, wip=made.wip)
    units = max(1, int(recording.log.delivered[-1]))
    found = flow(timing, net, units)
    begun = recording.from_start
    own = {circuit.name: circuit.seconds for circuit in net.named}
    return Predicted(
        net.pace,
        found.first if begun else None,
        found.last if begun else None,
        tuple(circuit.name for circuit in net.critical),
        tuple((lasting(timing, found) + made.settings.tick).tolist()),
        tuple(busy_until(timing, found)),
        tuple(own[robot.name] for robot in recording.factory.robots),
    )
