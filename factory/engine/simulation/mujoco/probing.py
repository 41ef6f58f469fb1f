"""Whether what should be solid collides: before a run parts are put into it, in a replica, and the
engine is asked for the contacts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import cycle, islice

import numpy as np

from factory.engine.mjcf.masks import NOBODY, masks_of
from factory.engine.mjcf.pads import trunks
from factory.engine.mjcf.replica import Replica
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

PROBE = 1 << 28
"""The code of a holder that no factory has."""

AT_ONCE = 64
"""Number of parts that are put somewhere at once."""

ASIDE = np.array([0.5, 0.19, 0.23])
"""Where a part is put, in shares of a box's half lengths. They are unequal: on the diagonal of a
square floor the engine finds no contact with some plates."""

TYPE = mujoco.mjtGeom


def untouched(m: mujoco.MjModel, geoms: Index, parts: Mapping[int, Index]) -> list[int]:
    """Those of some `geoms` that nothing touches when a part is put into them, and the first geoms
    of those `parts` (bodies, with the geoms that collide) that touch nothing then. Two that find no
    contact are tried again, each with others."""
    probes = _Probes(m, parts)
    targets, bodies = geoms.tolist(), [*parts]
    if not targets or not bodies:
        return []
    count = max(len(targets), len(bodies))
    probes.put([*islice(cycle(bodies), count)], [*islice(cycle(targets), count)])
    for turn in (1, 2):
        loose = [geom for geom in targets if geom not in probes.touched]
        good = [body for body in bodies if probes.touches(body)] or bodies
        probes.put([*islice(cycle(good), turn, turn + len(loose))], loose)
        bad = [body for body in bodies if not probes.touches(body)]
        solid = [geom for geom in targets if geom in probes.touched] or targets
        probes.put(bad, [*islice(cycle(solid), len(bad))])
    firsts = [int(parts[body][0]) for body in bodies if not probes.touches(body)]
    return [geom for geom in targets if geom not in probes.touched] + firsts


class _Probes:
    """Parts that are put into geoms of a replica; `touched`: the geoms that had a contact."""

    def __init__(self, m: mujoco.MjModel, parts: Mapping[int, Index]) -> None:
        self._replica, self._parts = Replica(m), parts
        self._replica.exclude_nothing()
        d, trunk = self._replica.d, trunks(m)
        self._rest, self._at = d.qpos.copy(), d.geom_xpos.copy()
        self._turn = d.geom_xmat.reshape(-1, 3, 3).copy()
        self._own = {body: np.flatnonzero(trunk == body) for body in parts}
        self._is_part = np.zeros(m.ngeom, bool)
        self._is_part[np.concatenate([*parts.values()])] = True
        self.touched = set[int]()

    def touches(self, body: int) -> bool:
        """Whether a part has touched anything."""
        return not self.touched.isdisjoint(self._parts[body].tolist())

    def put(self, bodies: Sequence[int], geoms: Sequence[int]) -> None:
        """Put each of some parts into a geom, many at once."""
        at_once = min(AT_ONCE, len(self._parts))
        for first in range(0, len(bodies), at_once):
            chosen = bodies[first : first + at_once]
            if len({*chosen}) < len(chosen):  # few parts, many times
                for body, geom in zip(chosen, geoms[first : first + at_once], strict=True):
                    self._try({body: geom})
            else:
                self._try(dict(zip(chosen, geoms[first : first + at_once], strict=True)))

    def _try(self, into: Mapping[int, int]) -> None:
        m, d = self._replica.m, self._replica.d
        qpos = self._rest.copy()
        for body, geom in into.items():
            at = m.jnt_qposadr[m.body_jntadr[body]]
            qpos[at : at + 3] += self._inside(geom) - self._at[self._parts[body][0]]
        self._mask(into, PROBE)
        self._replica.place(qpos)
        mujoco.mj_collision(m, d)
        pairs = d.contact.geom[d.contact.dist[: d.ncon] < 0]
        with_part = self._is_part[pairs].any(axis=1)
        self.touched.update(pairs[with_part].ravel().tolist())
        self._mask(into, NOBODY)

    def _mask(self, bodies: Iterable[int], code: int) -> None:
        for body in bodies:
            self._replica.mask(self._parts[body], self._own[body], *masks_of(code))

    def _inside(self, geom: int) -> Array:
        """A point (3,) in a geom, about half way from its middle to its end and in none of its
        planes of symmetry [m]."""
        m = self._replica.m
        kind, size = int(m.geom_type[geom]), m.geom_size[geom]
        if kind == TYPE.mjGEOM_MESH:
            mesh = int(m.geom_dataid[geom])
            first = int(m.mesh_vertadr[mesh])
            vertices = m.mesh_vert[first : first + int(m.mesh_vertnum[mesh])]
            corners = vertices[[int((vertices**2).sum(axis=1).argmax()), 0, -1]]
            inside = ASIDE @ corners
        elif kind == TYPE.mjGEOM_PLANE:
            inside = np.zeros(3)
        elif kind == TYPE.mjGEOM_BOX:
            inside = ASIDE * size
        else:  # round: a sphere, a cylinder, a capsule
            inside = ASIDE * (size[0], size[0], size[1] or size[0])
        return np.asarray(self._at[geom] + self._turn[geom] @ inside)
