"""Distances between the pads of holders and their payloads at the moment of taking. They are
computed from the current state; the engine's derived quantities belong to the start of its last
step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.mjcf.pads import Pads
from factory.mjcf.weld_frames import WeldFrames
from factory.simulation.mujoco.fusing import rotations
from factory.support.engine import mujoco


class PadGaps:
    """`largest` [m]: largest distance between a holder's pads and the nearest of its bodies; None
    while no holder with pads has taken anything. Pads are measured at a holder's first payload.
    Welds are rigid, so further bodies bring the nearest no farther away."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.largest: float | None = None
        self._m, self._d = m, d
        self._frames = WeldFrames.of(m, d)
        self._pads = Pads(m)
        self._at_zero, self._turned = d.geom_xpos.copy(), rotations(m.geom_quat)
        self._welds = {h: np.flatnonzero(m.eq_obj1id == h) for h in self._pads.of}
        for holder, welds in self._welds.items():
            pads, weld = self._pads.of[holder], welds[0]
            moved = d.qpos[self._frames.along[weld]] @ self._frames.way[weld]
            self._at_zero[pads] = d.geom_xpos[pads] - moved

    def measure(self, on: Mapping[int, int]) -> None:
        """Measure welds that are about to close, each with its body. A holder that exchanges parts
        for their fused body has been measured before."""
        taken: dict[int, tuple[int, list[int]]] = {}
        for weld, body in on.items():
            holder = int(self._m.eq_obj1id[weld])
            if holder in self._pads.of and body in self._pads.solid:
                taken.setdefault(holder, (weld, []))[1].append(body)
        for holder, (weld, bodies) in taken.items():
            if not self._d.eq_active[self._welds[holder]].any():
                self._pads_of(holder, weld, bodies)

    def _pads_of(self, holder: int, weld: int, bodies: Sequence[int]) -> None:
        m, d, pads, flat = self._m, self._d, self._pads.of[holder], np.empty(9)
        along, way = self._frames.along[weld], self._frames.way[weld]
        d.geom_xpos[pads] = self._at_zero[pads] + d.qpos[along] @ way
        for body in bodies:
            geoms = self._pads.solid[body]
            at = m.jnt_qposadr[m.body_jntadr[body]] + np.arange(7)
            mujoco.mju_quat2Mat(flat, d.qpos[at[3:]])
            turn = flat.reshape(3, 3)
            d.geom_xpos[geoms] = d.qpos[at[:3]] + m.geom_pos[geoms] @ turn.T
            d.geom_xmat[geoms] = (turn @ self._turned[geoms]).reshape(-1, 9)
        apart = self._pads.apart(d, holder, self._pads.geoms(bodies))
        self.largest = max(self.largest or 0.0, apart)
