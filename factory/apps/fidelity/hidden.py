"""Hidden penetrations: how deep things that are drawn are inside each other, whatever a run leaves
out of contact.

The poses of a run are examined in a separate model, in which everything drawn is solid: no masks,
no exclusions, a body against its parent too. A part has the shape that is drawn: its primitive or
its convex pieces, whose faces do not recede. Left out are geoms of one rigid group, which nothing
can move against each other, and everything below the floor. Of parts that overlap in the finished
product, only the penetration beyond that overlap counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Layout, Simulation, load, names, physical_model
from factory.apps.fidelity.record import Penetration
from factory.apps.fidelity.solid import SolidReplica
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

TOUCH = 1e-6
"""Penetration up to which two things only touch; differences up to that do not count [m]."""

BEARING = {"lid", "rod"}
"""A feeder's rod slides in a hole of its housing's lid, which the model lacks: left out."""

EVERY = 0.02
"""Time between two looks [s], in which a robot goes 10 mm at 0.5 m/s."""


class HiddenPenetrations:
    """The deepest penetrations of any two things in poses of a model `m`, over all their copies.
    `overlaps`: penetration of two parts in the finished product [m]."""

    def __init__(self, m: mujoco.MjModel, overlaps: Mapping[tuple[str, str], float]) -> None:
        self.replica = SolidReplica(m)
        self.names = [m.geom(i).name for i in range(m.ngeom)]
        self._overlaps = {frozenset(pair): depth for pair, depth in overlaps.items()}
        self._deepest: dict[tuple[str, ...], Penetration] = {}
        self._due = 0.0
        self._keep(*self.replica.standing(), 0.0, False)

    @classmethod
    def of(cls, simulation: Simulation) -> HiddenPenetrations:
        """Those of a simulation, in a model of its own whose parts' faces do not recede."""
        layout, request = simulation.layout, simulation.request
        model = physical_model(
            layout,
            request.units,
            replace(request.settings, overlap=0.0),
            request.catalogue,
            request.wip,
            simulation.under_way(),
            request.fuse,
        )
        return cls(load(model), overlaps_of(layout))

    def look(self, qpos: NDArray[Any], time: float) -> None:
        """At the poses that the joints' positions (nq,) have at a time [s], unless the last look
        was a moment ago."""
        if time > self._due - 1e-9:
            self._due = time + EVERY
            self._keep(*self.replica.meeting(qpos), time)

    def _keep(self, geoms: Index, depth: Array, time: float, moves: bool = True) -> None:
        inside = np.flatnonzero(depth > TOUCH)
        for row in inside[np.argsort(-depth[inside])].tolist():  # the deepest of a kind comes first
            a, b = sorted(self.names[geom] for geom in geoms[row].tolist())
            kinds = tuple(sorted(map(names.without_copy, (a, b))))
            deep = float(depth[row]) - self._overlaps.get(frozenset(map(_part, kinds)), 0.0)
            before = self._deepest.get(kinds)
            bearing = {name.rpartition("/")[2] for name in (a, b)} == BEARING
            if not bearing and deep > TOUCH + (1e-3 * before.depth_mm if before else 0.0):
                self._deepest[kinds] = Penetration((a, b), 1e3 * deep, time, moves)

    def found(self) -> tuple[Penetration, ...]:
        """All penetrations, the deepest first."""
        return tuple(sorted(self._deepest.values(), key=lambda p: (-p.depth_mm, p.geoms)))

    def deepest(self) -> float:
        """The deepest penetration [mm]; 0 where there is none."""
        return max((p.depth_mm for p in self._deepest.values()), default=0.0)


def overlaps_of(layout: Layout) -> dict[tuple[str, str], float]:
    """How far parts of a product must recede from each other so that they do not overlap [m]."""
    return {o.parts: max(far for _, _, far in o.bodies) for o in layout.overlaps if o.bodies}


def _part(kind: str) -> str:
    """The label of the part that geoms of a kind are of, "" for others."""
    return kind.rpartition("/")[2] if names.kind(kind) == "part" else ""
