"""Hidden penetrations: how deep things that are drawn are inside each other, whatever a run leaves
out of contact.

The poses of a run are looked at in a model of its own, in which all that is drawn is solid: no
masks, no exclusions, a body against its parent too. A part is as it is drawn: its primitive or its
convex pieces, whose faces do not recede. Only geoms of one rigid group, which nothing can move
against each other, and what lies below the floor are not looked at. Of parts that overlap in the
finished product, what they are deeper inside each other than there counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.control.mode import Array, Index
from factory.layout.layout import Layout
from factory.mjcf import names
from factory.mjcf.loading import load
from factory.mjcf.solid import SolidReplica
from factory.plant.approaches import Pair
from factory.simulation.modelling import physical_model
from factory.simulation.simulation import Simulation
from factory.study.fidelity.record import Penetration
from factory.support.engine import mujoco

TOUCH = 1e-6
"""Things that are no deeper inside each other only touch, and what is no deeper by that than before
is as deep [m]."""


BEARING = {"lid", "rod"}
"""A feeder's rod slides in a hole of its housing's lid, which has none: that is left out."""

EVERY = 0.02
"""Time from one look to the next [s], in which a robot goes 10 mm at 0.5 m/s."""


class HiddenPenetrations:
    """Looks at poses of a model `m`, and keeps how deep any two things have been inside each other.
    `overlaps`: how deep two parts are in the finished product [m]."""

    def __init__(self, m: mujoco.MjModel, overlaps: Mapping[Pair, float]) -> None:
        self.replica = SolidReplica(m)
        self.names = [m.geom(i).name for i in range(m.ngeom)]
        kinds, numbers = np.unique([names.without_copy(n) for n in self.names], return_inverse=True)
        self._kind, self._many = numbers.astype(np.intp), len(kinds)
        self._overlap = self._overlaps(kinds.tolist(), overlaps)
        self._keys: Index = np.zeros(0, np.intp)
        self._depth: Array = np.zeros(0)
        self._found: dict[int, Penetration] = {}
        self._due = 0.0
        self._keep(*self.replica.standing(), 0.0, False)

    @classmethod
    def of(cls, simulation: Simulation) -> HiddenPenetrations:
        """Those of a simulation, in a model of its own whose parts' faces do not recede."""
        layout, asked = simulation.layout, simulation.request
        model = physical_model(
            layout,
            asked.units,
            replace(asked.settings, overlap=0.0),
            asked.catalogue,
            asked.wip,
            simulation.under_way(),
            asked.fuse,
        )
        return cls(load(model), overlaps_of(layout))

    def look(self, qpos: NDArray[Any], time: float) -> None:
        """At the poses that the joints' positions (nq,) have at a time [s], unless the last look
        was a moment ago."""
        if time > self._due - 1e-9:
            self._due = time + EVERY
            self._keep(*self.replica.meeting(qpos), time)

    def _overlaps(self, kinds: list[str], overlaps: Mapping[Pair, float]) -> tuple[Index, Array]:
        """The keys of pairs of geoms of parts that overlap, and how deep [m]."""
        geoms: dict[str, list[int]] = {}
        for number, name in enumerate(kinds):
            if names.kind(name) == "part":
                geoms.setdefault(name.rpartition("/")[2], []).append(number)
        found = {
            min(a, b) * self._many + max(a, b): deep
            for (one, other), deep in overlaps.items()
            for a in geoms.get(one, ())
            for b in geoms.get(other, ())
        }
        keys = np.array(sorted(found), np.intp)
        return keys, np.array([found[key] for key in keys.tolist()])

    def _bearing(self, geoms: Index) -> list[bool]:
        """Whether pairs of geoms (n, 2) are a rod and the lid that it slides in."""
        return [
            {self.names[geom].rpartition("/")[2] for geom in pair} == BEARING
            for pair in geoms.tolist()
        ]

    def _keep(self, geoms: Index, depth: Array, time: float, moves: bool = True) -> None:
        kinds = np.sort(self._kind[geoms], axis=1)
        keys = kinds[:, 0] * self._many + kinds[:, 1]
        depth = depth - _looked_up(*self._overlap, keys)
        depth[self._bearing(geoms)] = 0.0
        deeper = np.flatnonzero(depth > _looked_up(self._keys, self._depth, keys) + TOUCH)
        if not len(deeper):
            return
        for row in deeper[np.argsort(depth[deeper])].tolist():  # the deepest of a kind comes last
            pair = sorted(self.names[geom] for geom in geoms[row].tolist())
            found = Penetration((pair[0], pair[1]), 1e3 * float(depth[row]), time, moves)
            self._found[int(keys[row])] = found
        self._keys = np.array(sorted(self._found))
        self._depth = np.array([1e-3 * self._found[key].depth_mm for key in self._keys.tolist()])

    def found(self) -> tuple[Penetration, ...]:
        """All that there have been, the deepest first."""
        return tuple(sorted(self._found.values(), key=lambda p: (-p.depth_mm, p.geoms)))

    def deepest(self) -> float:
        """The deepest [mm]; 0 where nothing was inside anything."""
        return max((p.depth_mm for p in self._found.values()), default=0.0)


def overlaps_of(layout: Layout) -> dict[Pair, float]:
    """How far parts of a product must recede from each other so that they do not overlap [m]."""
    return {o.parts: max(far for _, _, far in o.bodies) for o in layout.overlaps if o.bodies}


def _looked_up(keys: Index, values: Array, wanted: Index) -> Array:
    """The values (n,) of wanted keys (n,), 0 for those that are not among the sorted `keys`."""
    if not len(keys):
        return np.zeros(len(wanted))
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.asarray(np.where(keys[at] == wanted, values[at], 0.0))
