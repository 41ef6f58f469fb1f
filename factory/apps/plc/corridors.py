"""Corridors of a driven plant: where each axis may go while places of the coordinated net are
marked.

They are the ways for which the certificate of the layout proves that no two machines come near each
other, and inside an operation what its mode keeps apart. So a controller may ask for any target: no
axis leaves its corridor. A part of a way that a pass has ended is closed for good, since others
have been let in by it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from factory.api import LayoutMachines, Mode, Past, Timing
from factory.support.arrays import Array

SLACK = 1e-3
"""An axis is where it has to be within this [m]."""

AWAY = 0.005
"""A robot that is further from its way stays where it is [m]: more than it goes in a tick."""

SOON = 0.01
"""An axis that is let go on by a tick stops so much further at most [m]."""


Sweep = tuple[tuple[float, float], tuple[float, float]]
"""From where to where a robot's carriage goes, and its lift [m]."""


@dataclass(frozen=True, slots=True)
class WayPart:
    """A part of a robot's way in one place of the compiled net: the `sweeps` of its carriage and
    its lift, until one of the passes `ends`."""

    ends: tuple[Past, ...]
    sweeps: tuple[Sweep, ...]


class Corridors:
    """The corridors of a timed layout in its coordinated net, with the modes of its operations."""

    def __init__(self, timing: Timing) -> None:
        layout, net = timing.layout, timing.coordinated
        self._factory, self._modes = layout.factory, timing.modes
        self._least, self._most = np.array(layout.spans).T
        ended = {int(place): past for past, (place, _) in net.passes.items()}
        self._ways = dict[tuple[int, int], list[WayPart]]()
        for presence in LayoutMachines(layout).robot_presences(net):
            ends = tuple(ended[place] for place in presence.places[1:] if place in ended)
            key = presence.robot, presence.places[0]
            self._ways.setdefault(key, []).append(WayPart(ends, presence.sweeps))
        self._passed = dict[Past, int]()

    def bounds(
        self, marked: Sequence[int], fired: Sequence[int], x: Array, stops: Array
    ) -> tuple[Array, Array]:
        """The lowest and the highest target of each axis (n,) [m] in a marking, with firing counts
        `fired`, axes at `x` that can stop at `stops` [m]. A robot that is nowhere on its way stays
        where it is: at the start of a run one stands under the part of its feeder. Remembers the
        passes."""
        low, high = (np.clip(x, self._least, self._most) for _ in range(2))
        for (robot, place), stretches in self._ways.items():
            if not marked[place]:
                continue
            axes = [*self._factory.axes_of(robot)]
            sweeps = [*self._left(stretches, fired, x)]
            if min(_off(sweep, x[axes]) for sweep in sweeps) > AWAY:
                continue
            for which, axis in enumerate(axes):
                other = float(x[axes[1 - which]]) if len(axes) == 2 else 0.0
                spans = _beside(sweeps, which, other) if len(axes) == 2 else [s[0] for s in sweeps]
                low[axis] = min(min(span) for span in spans)
                high[axis] = max(max(span) for span in spans)
        for operation, mode in zip(self._factory.operations, self._modes, strict=True):
            if marked[operation.place]:
                axes = [*self._factory.moves[operation.index]]
                _keep_gates(mode, axes, x, stops, low, high)
                _keep_apart(mode, axes, x, stops, low, high)
        return low, high

    def _left(self, stretches: list[WayPart], fired: Sequence[int], x: Array) -> Iterator[Sweep]:
        """The sweeps of what is left of a way; its last stretch is never ended."""
        for past in (past for stretch in stretches for past in stretch.ends):
            if past.holds(float(x[past.axis])):
                self._passed[past] = fired[past.after]
        left = [
            stretch
            for stretch in stretches
            if not any(self._passed.get(past) == fired[past.after] for past in stretch.ends)
        ]
        for stretch in left or stretches[-1:]:
            yield from stretch.sweeps


def _outside(span: tuple[float, float], at: float) -> float:
    """How far a place is outside a span [m]."""
    return max(min(span) - at, at - max(span), 0.0)


def _off(sweep: Sweep, at: Array) -> float:
    """How far axes are outside a sweep [m]."""
    return max(_outside(span, there) for span, there in zip(sweep, at.tolist(), strict=False))


def _beside(sweeps: Sequence[Sweep], which: int, other: float) -> list[tuple[float, float]]:
    """The spans of one of two axes, 0 or 1, in the sweeps in which the other may be where it is,
    or in those that are nearest to that."""
    off = [_outside(sweep[1 - which], other) for sweep in sweeps]
    reach = max(SLACK, min(off))
    return [sweep[which] for sweep, far in zip(sweeps, off, strict=True) if far <= reach]


def _keep_gates(
    mode: Mode, axes: Sequence[int], x: Array, stops: Array, low: Array, high: Array
) -> None:
    """No axis comes nearer to its goal than its standoff before its gate stands at its own, and the
    gate stays there from when the axis can be nearer."""
    for slot, gate in enumerate(mode.gate.tolist()):
        standoff = float(mode.standoff[slot])
        if gate < 0 or standoff <= 0.0:
            continue
        axis, guard = axes[slot], axes[gate]
        goal, nearest = float(mode.goals[gate]), float(mode.goals[slot]) + standoff
        is_there = max(abs(float(at[guard]) - goal) for at in (x, stops)) < mode.eps
        if stops[axis] < nearest + (SOON if is_there else -mode.eps):
            low[guard] = high[guard] = goal
        if not is_there:
            low[axis] = max(low[axis], min(nearest, float(x[axis])))


def _keep_apart(
    mode: Mode, axes: Sequence[int], x: Array, stops: Array, low: Array, high: Array
) -> None:
    """No two robots whose guidepaths meet touch, where the other can stop."""
    for pair, meet, touch in zip(
        mode.pairs.tolist(), mode.meet.tolist(), mode.touch.tolist(), strict=True
    ):
        for one, other in ((0, 1), (1, 0)):
            axis, off = axes[pair[one]], abs(float(stops[axes[pair[other]]]) - meet[other])
            if (near := touch - off) <= 0.0:
                continue
            if x[axis] >= meet[one]:
                low[axis] = max(low[axis], min(meet[one] + near, float(x[axis])))
            else:
                high[axis] = min(high[axis], max(meet[one] - near, float(x[axis])))
