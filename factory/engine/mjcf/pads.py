"""The pads of robots, feeders and the tray, on which what they hold rests, and how far it is from
them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from factory.engine.mjcf import names
from factory.support.arrays import Index
from factory.support.engine import mujoco

FREE = 6
"""Degrees of freedom of a part's body; what holds parts has fewer."""

FAR = 10.0
"""Distances are measured up to this [m]."""


def trunks(m: mujoco.MjModel) -> Index:
    """For each body of an engine's model (nbody,) the body that it is a shell of; else itself. A
    *shell* holds the geoms of one part in the body that a sub-assembly has become, fixed and
    without mass: the engine leaves pairs of bodies out of contact, not pairs of geoms, so a part
    that overlaps another too deep has a body of its own in what it is fused into."""
    trunk = np.arange(m.nbody)
    shells = [b for b in range(m.nbody) if names.kind(m.body(b).name) == names.SHELL]
    trunk[shells] = m.body_parentid[shells]
    return trunk


class Pads:
    """The pads of a model: `of`, by body that holds parts, its pads (geoms), none where those are
    only drawn; `solid`, by body of a part or sub-assembly, the geoms that collide, those of its
    shells among them."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self._m = m
        self._receded = m.geom_user[:, 0] if m.nuser_geom else np.zeros(m.ngeom)
        trunk = trunks(m)[m.geom_bodyid]
        part = m.body_dofnum[trunk] == FREE
        geoms = np.flatnonzero(part & (m.geom_group != 1))
        geoms = geoms[np.argsort(trunk[geoms], kind="stable")]
        bodies, first = np.unique(trunk[geoms], return_index=True)
        self.solid: dict[int, Index] = dict(
            zip(bodies.tolist(), np.split(geoms, first[1:]), strict=True)
        )
        named: dict[str, list[int]] = {}
        solid = (m.geom_contype | m.geom_conaffinity) != 0
        for geom in np.flatnonzero(solid & ~part).tolist():
            named.setdefault(names.pad_of(m.geom(geom).name), []).append(geom)
        holders = {int(b): named.get(names.holder(m.body(b).name)) for b in np.unique(m.eq_obj1id)}
        self.of = {body: np.array(pads) for body, pads in holders.items() if pads}

    def first_taken(self, d: mujoco.MjData, fresh: Index, active: Index) -> float | None:
        """The largest distance [m] of holders' pads from the nearest of the bodies that `fresh`
        welds hold, of those whose other welds are not among the `active`; None for no such."""
        holder, body = self._m.eq_obj1id, self._m.eq_obj2id
        busy = np.isin(holder[fresh], holder[np.setdiff1d(active, fresh)])
        gaps = [
            self.apart(d, one, self.geoms(body[fresh[holder[fresh] == one]].tolist()))
            for one in np.unique(holder[fresh[~busy]]).tolist()
            if one in self.of
        ]
        return max(gaps, default=None)

    def geoms(self, bodies: Iterable[int]) -> Index:
        """The geoms that collide of the bodies of parts, one after the other."""
        return np.concatenate([self.solid[body] for body in bodies])

    def apart(self, d: mujoco.MjData, holder: int, geoms: Index) -> float:
        """The least distance [m] of a holder's pads from what some geoms are of, whose faces may
        have receded for an overlap (their number in the model is how far); 0 where one is in it.
        The nearest are tried first: spheres round geoms bound how near the others are."""
        return self.nearest(d, self.of[holder].tolist(), geoms)

    def nearest(self, d: mujoco.MjData, pads: Iterable[int], geoms: Index) -> float:
        """As `apart`, of some geoms that hold."""
        m, least = self._m, FAR
        for pad in pads:
            far = np.linalg.norm(d.geom_xpos[geoms] - d.geom_xpos[pad], axis=1)
            receded = self._receded[geoms]
            bound = far - m.geom_rbound[geoms] - m.geom_rbound[pad] - receded
            for k in np.argsort(bound).tolist():
                if max(bound[k], 0.0) >= least:
                    break
                away = float(receded[k])
                apart = mujoco.mj_geomDistance(m, d, pad, int(geoms[k]), least + away, None)
                least = max(0.0, min(least, apart - away))
        return least
