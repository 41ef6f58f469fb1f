"""What the cameras look at, read from a model alone: the factory's extent, and the product on its
way."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from factory.engine import mujoco
from factory.mjcf import names
from factory.render.camera import Array

SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a model that a picture shows: `qpos`, and the constraints that are active, by
    number, with the bodies they are aimed at."""

    qpos: Array
    active: NDArray[np.int32]
    body1: NDArray[np.int32]
    body2: NDArray[np.int32]

    @classmethod
    def of(cls, m: mujoco.MjModel, d: mujoco.MjData) -> Snapshot:
        """The present state of a running model."""
        active = np.flatnonzero(d.eq_active).astype(np.int32)
        return cls(d.qpos.copy(), active, m.eq_obj1id[active].copy(), m.eq_obj2id[active].copy())


UNSEEN = ("part", "ground")
"""Kinds of bodies that do not count for what a picture of the factory has to show."""


def extent(m: mujoco.MjModel, d: mujoco.MjData) -> Array:
    """Points (n, 3) round everything that stands in a factory and its robots at both ends of their
    rails."""
    robots = {m.body(j.bodyid[0]).name: j for j in map(m.joint, range(m.njnt)) if j.type[0] == 2}
    found = []
    for g in range(m.ngeom):
        body = int(m.geom_bodyid[g])
        name = m.body(body).name
        if m.geom_type[g] == mujoco.mjtGeom.mjGEOM_PLANE or names.kind(name) in UNSEEN:
            continue
        corners = _corners(m, g) @ d.geom_xmat[g].reshape(3, 3).T + d.geom_xpos[g]
        found.append(corners)
        if name in robots:
            found.append(corners + _travel(m, d, name, int(robots[name].id)))
    return np.concatenate(found) if found else SIGNS.copy()


def _corners(m: mujoco.MjModel, geom: int) -> Array:
    """The corners (8, 3) of a geom's box in its own frame, or the vertices of its mesh."""
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = m.mesh(int(m.geom_dataid[geom]))
        first = int(mesh.vertadr[0])
        return np.asarray(m.mesh_vert[first : first + int(mesh.vertnum[0])], float)
    box = m.geom_aabb[geom]
    return np.asarray(box[:3] + SIGNS * box[3:])


def _travel(m: mujoco.MjModel, d: mujoco.MjData, carriage: str, joint: int) -> Array:
    """The way of a robot from the B end of its rail to the A end (3,) [m]."""
    robot = carriage.partition("/")[0]
    try:
        rail, own = m.geom(f"{robot}/rail"), m.geom(carriage)
    except KeyError:
        return np.zeros(3)
    return np.asarray(-d.xaxis[joint] * 2 * (rail.size[0] - own.size[0]))


class Followed:
    """The product that is furthest on its way: where the finished product's box will be about it.

    It is known by one of its parts, that which the most robots carry. Parts never turn, so the
    place of one part tells that of the product."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self.kinds = [m.equality(e).name for e in range(m.neq)]
        grips = [name.split("/", 2)[1:] for name in self.kinds if name.startswith("grip/")]
        carried, rank = (
            _counts([label for _, label in grips]),
            _counts([robot for robot, _ in grips]),
        )
        self.label = max(carried, key=lambda label: carried[label]) if carried else ""
        self.rank = {e: self._rank(name, rank) for e, name in enumerate(self.kinds)}
        bodies = {m.body(b).name: b for b in range(m.nbody)}
        prefix = names.part(self.label, 1)[:-1]
        self.copies = [b for name, b in bodies.items() if name.startswith(prefix)]
        self.box = self._box(m, bodies)

    def _rank(self, name: str, rank: dict[str, int]) -> float:
        """How far a part is that this constraint holds: parked, at its feeder, with a robot that
        carries n parts."""
        kind, _, rest = name.partition("/")
        if kind == "grip":
            return float(rank[rest.partition("/")[0]])
        return {"park": -1.0, "feed": 0.0}.get(kind, np.inf)

    def _box(self, m: mujoco.MjModel, bodies: dict[str, int]) -> Array:
        """The corners (8, 3) of the finished product's box, about the followed part's origin."""
        offset = {
            name.partition("/")[2]: m.eq_data[e, 3:6]
            for e, name in enumerate(self.kinds)
            if name.startswith("hold/")
        }
        shift = offset.get(self.label, np.zeros(3))
        points = []
        for g in range(m.ngeom):
            name = m.body(int(m.geom_bodyid[g])).name
            if names.kind(name) != "part" or not name.endswith("#1"):
                continue
            turn = np.empty(9)
            mujoco.mju_quat2Mat(turn, m.geom_quat[g])
            place = m.geom_pos[g] + offset.get(names.label_of(name), np.zeros(3)) - shift
            points.append(_corners(m, g) @ turn.reshape(3, 3).T + place)
        if not points:
            return 0.1 * SIGNS
        every = np.concatenate(points)
        low, high = every.min(axis=0), every.max(axis=0)
        return np.asarray((low + high) / 2 + SIGNS * (high - low) / 2)

    def furthest(self, d: mujoco.MjData, shown: Snapshot) -> tuple[int, float] | None:
        """The body of the followed part in the product furthest on its way, and how far it is:
        infinitely where no robot holds it any more. None if no copy is in the factory."""
        rank = dict.fromkeys(self.copies, np.inf)
        for e, body in zip(shown.active.tolist(), shown.body2.tolist(), strict=True):
            if body in rank:
                rank[body] = min(rank[body], self.rank[e])
        seen = [b for b in self.copies if rank[b] >= 0 and d.xpos[b, 2] > 0]
        return max(((b, rank[b]) for b in seen), key=lambda pair: pair[1], default=None)


def held(m: mujoco.MjModel, shown: Snapshot) -> bool:
    """Whether the output robot, the first, holds a product."""
    grip = names.grip("r1", "")
    return any(m.equality(e).name.startswith(grip) for e in shown.active.tolist())


def _counts(words: list[str]) -> dict[str, int]:
    found: dict[str, int] = {}
    for word in words:
        found[word] = found.get(word, 0) + 1
    return found
