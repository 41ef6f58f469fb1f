"""Zones on the floor round what lies about, where no robot may come near."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from factory.layout.sweeping import APART
from factory.mjcf import names
from factory.support.engine import mujoco

Zone = tuple[float, float, float]
"""The middle and the radius of a disc on the floor [m]."""


class Zones:
    """Those of a model: round the bodies of parts that nothing holds, but for what is out of sight
    or over a bin."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self.m, bodies = m, np.arange(m.nbody)
        loose = [names.kind(m.body(b).name) == "part" and m.body_dofnum[b] > 0 for b in bodies]
        self.parts = bodies[np.array(loose, bool)]
        self.radii = np.zeros(m.nbody)
        far = np.linalg.norm(m.geom_pos, axis=1) + m.geom_rbound
        np.maximum.at(self.radii, m.geom_bodyid, far)
        self.bins = [b for b in bodies.tolist() if names.kind(m.body(b).name) == "bin"]

    def at(self, d: mujoco.MjData, held: NDArray[np.int32]) -> list[Zone]:
        """All in a state of the engine in which these bodies are `held`."""
        found = list[Zone]()
        for body in np.setdiff1d(self.parts, held).tolist():
            x, y, z = d.xpos[body].tolist()
            if z > 0.0 and not any(self._is_over(d, one, x, y) for one in self.bins):
                found.append((x, y, float(self.radii[body]) + APART))
        return found

    def _is_over(self, d: mujoco.MjData, bin_: int, x: float, y: float) -> bool:
        """Whether a place is over a bin, by its bottom plate."""
        bottom = int(self.m.body_geomadr[bin_])
        half, at = self.m.geom_size[bottom], d.geom_xpos[bottom]
        return bool(abs(x - at[0]) <= half[0] and abs(y - at[1]) <= half[1])
