"""The state of a factory that a picture shows, and its moving bodies, from its model alone: cameras
are fitted to these, not to fixed ones.

Posts and booms of feeders fade where they hide the action. Housings and the shed do not fade, since
their contents must stay out of sight. The opacity follows from the view alone, so a still, a film
of a run and a film of its log show the same.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import Geoms, Replica
from factory.engine.mjcf.weld_frames import WeldFrames
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.sight import View
from factory.support.rotations import rotation

FAINT = 0.16
"""Opacity of a geom that hides the action."""

SEEN, HIDDEN = 0.05, 0.20
"""Hidden shares of a box at which geoms begin to fade, and are fully faded."""

ROUND = 0.03
"""How far about a box counts as that box [m]: what is thin is not hidden all of a sudden."""

STANDS = ("post", "boom")
"""Geoms of a feeder that fade."""

SHED = ("outfeed/roof", "outfeed/back", "outfeed/wall")
"""Geoms of the shed, by what their names begin with."""


class Fading:
    """Fades geoms of a replica of the model."""

    def __init__(self, replica: Replica) -> None:
        self.m, d = replica.m, replica.d
        self.last: View | None = None
        stands: list[tuple[int, str]] = []
        for body in range(1, self.m.nbody):
            if names.kind(name := self.m.body(body).name) == "feeder":
                geoms = Geoms(self.m).shown(body)
                stands += [(g, name) for g in geoms if is_stand(self.m.geom(g).name)]
        self.geoms = np.array([g for g, _ in stands], np.intp)
        self.groups = np.unique([group for _, group in stands], return_inverse=True)[1]
        self.paint = np.array([Geoms(self.m).colour(g) for g in self.geoms]).reshape(-1, 4)
        self.boxes = np.array([placed(self.m, d, g) for g in self.geoms]).reshape(-1, 8, 3)

    def fade(self, view: View, watched: Array) -> None:
        """Fade geoms that hide much of any of the boxes `watched` (n, 8, 3) in a view."""
        if view is self.last or not len(self.geoms):
            return
        self.last = view
        share = (self.hidden(view, watched) - SEEN) / (HIDDEN - SEEN)
        share = np.clip(share, 0.0, 1.0)[self.groups]
        self.m.geom_rgba[self.geoms] = self.paint
        self.m.geom_rgba[self.geoms, 3] *= 1.0 - (1.0 - FAINT) * share * share * (3 - 2 * share)

    def hidden(self, view: View, watched: Array) -> Array:
        """For each group of geoms the greatest share of a watched box that it hides in a view."""
        watched = watched + ROUND * np.sign(watched - watched.mean(axis=1, keepdims=True))
        (front, before), (back, behind) = outlines(view, self.boxes), outlines(view, watched)
        one, other = shapely.STRtree(back).query(front, predicate="intersects")
        shared = shapely.area(shapely.intersection(front[one], back[other]))
        shared /= np.maximum(shapely.area(back[other]), 1e-12)
        ahead = behind[other].mean(axis=1) - before[one].mean(axis=1)
        deep = (np.ptp(behind[other], axis=1) + np.ptp(before[one], axis=1)) / 2
        shared *= np.clip(2 * ahead / deep - 1, 0.0, 1.0)
        count = len(watched)
        pairs, number = np.unique(self.groups[one] * count + other, return_inverse=True)
        together = np.bincount(number, shared, len(pairs))
        greatest = np.zeros(int(self.groups.max()) + 1)
        np.maximum.at(greatest, pairs // count, together)
        return greatest


def is_stand(geom: str) -> bool:
    """Whether a geom of a feeder is its post or its boom, or a skin of one."""
    return not set(STANDS).isdisjoint(geom.split("/")[2:])


def outlines(view: View, boxes: Array) -> tuple[Array, Array]:
    """The outlines (n,) of boxes (n, 8, 3) in a view, as polygons, and how far ahead (n, 8) their
    corners are."""
    seen = (boxes - view.position) @ view.axes.T
    ahead = np.maximum(seen[:, :, 2], 1e-3)
    points = shapely.multipoints(shapely.points(seen[:, :, :2] / ahead[:, :, None]))
    return shapely.convex_hull(points), seen[:, :, 2]


ELBOW = 2
"""Joints of a chain below its elbow."""

SIGNS = np.array(list(product((-1.0, 1.0), repeat=3)))


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The state of a model that a picture shows: `qpos`, and the constraints that are active, by
    number, with the bodies they are aimed at."""

    qpos: Array
    active: NDArray[np.int32]
    body2: NDArray[np.int32]

    @classmethod
    def of(cls, qpos: Array, welds: NDArray[np.integer]) -> Snapshot:
        """That of positions and active constraints (k, 3), as of an `Observation`."""
        return cls(qpos, *welds[:, [0, 2]].T.astype(np.int32))


def corners(m: mujoco.MjModel, geom: int) -> Array:
    """The corners (8, 3) of a geom's box in its own frame, or the vertices of its mesh."""
    if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        return Geoms(m).mesh(geom)[0]
    box = m.geom_aabb[geom]
    return np.asarray(box[:3] + SIGNS * box[3:])


def placed(m: mujoco.MjModel, d: mujoco.MjData, geom: int) -> Array:
    """The corners (8, 3) of a geom's box where it is [m]."""
    box = m.geom_aabb[geom]
    turn = d.geom_xmat[geom].reshape(3, 3)
    return np.asarray((box[:3] + SIGNS * box[3:]) @ turn.T + d.geom_xpos[geom])


def held(m: mujoco.MjModel, shown: Snapshot) -> bool:
    """Whether the output robot, the first, holds a product."""
    grip = names.grip("r1", "")
    return any(m.equality(e).name.startswith(grip) for e in shown.active.tolist())


Own = tuple[int, str]
"""A body that moves by itself, and `body` or `load`: it, or what it holds."""


@dataclass(frozen=True, slots=True)
class Action:
    """What a picture of a factory has to show, as boxes (n, 8, 3) by their corners [m].

    Attributes:
        robots: robots, and what they carry, at both ends of their guidepaths.
        beside: the feeders that parts hang from at first, with their rods down and up, and the tray
            with a product, empty and where it goes into the shed.
        housings: the housings of feeders.
        shed: the shed and its shutter.
    """

    robots: Array
    beside: Array
    housings: Array
    shed: Array

    @property
    def points(self) -> Array:
        """All corners (n, 3) of what moves and of feeders [m]."""
        return np.concatenate([self.robots, self.beside]).reshape(-1, 3)

    @property
    def framed(self) -> Array:
        """All corners (n, 3) that a picture of the whole shows: these, and the shed's [m]."""
        return np.concatenate([self.robots, self.beside, self.shed]).reshape(-1, 3)


def action_of(m: mujoco.MjModel, d: mujoco.MjData) -> Action:
    """The action of a model, with its state at the start."""
    points: defaultdict[Own, list[Array]] = defaultdict(list)
    for owner, corners_of in (*_bodies(m, d), *_loads(m, d)):
        points[owner].append(corners_of)
    boxes = {owner: box_of(np.concatenate(corners_of)) for owner, corners_of in points.items()}
    beside = list(_feeders(m, d))
    robots: list[Array] = []
    for (body, _), box in boxes.items():
        way = _way(m, d, body, boxes.get((body, "load"), box))
        is_tray = m.body(body).name == names.OUTFEED_TRAY
        (beside if is_tray else robots).extend((box, box + way))
    kinds = robots or beside, beside, list(_housings(m, d)), list(_shed(m, d))
    return Action(*(np.array(corners_of).reshape(-1, 8, 3) for corners_of in kinds))


def _feeders(m: mujoco.MjModel, d: mujoco.MjData) -> Iterator[Array]:
    """Boxes of the geoms of feeders, those of sliders down and up."""
    for g in range(m.ngeom):
        if names.kind(m.geom(g).name) != "feeder":
            continue
        yield (box := placed(m, d, g))
        if up := _raised(m, int(m.body_weldid[m.geom_bodyid[g]])):
            yield box + np.array([0.0, 0.0, up])


def _raised(m: mujoco.MjModel, body: int) -> float:
    """How far up a body goes on its joint [m], 0 for one that stands."""
    return float(m.jnt_range[m.body_jntadr[body], 1]) if m.body_jntnum[body] else 0.0


def _housings(m: mujoco.MjModel, d: mujoco.MjData) -> Iterator[Array]:
    """The box of each feeder's housing."""
    for body in range(1, m.nbody):
        if names.kind(m.body(body).name) == "feeder" and m.body_weldid[body] == 0:
            first = int(m.body_geomadr[body])
            geoms = range(first, first + int(m.body_geomnum[body]))
            walls = [placed(m, d, g) for g in geoms if not is_stand(m.geom(g).name)]
            if walls:
                yield box_of(np.concatenate(walls))


def _shed(m: mujoco.MjModel, d: mujoco.MjData) -> Iterator[Array]:
    """The box of the shed, and that of its shutter."""
    geoms = [(m.geom(g).name, g) for g in range(m.ngeom)]
    walls = [placed(m, d, g) for name, g in geoms if name.startswith(SHED)]
    if walls:
        yield box_of(np.concatenate(walls))
    yield from (placed(m, d, g) for name, g in geoms if name == names.SHUTTER)


def _bodies(m: mujoco.MjModel, d: mujoco.MjData) -> Iterator[tuple[Own, Array]]:
    """Points around each geom of the moving bodies; of a chain of hinges up to its elbow, which
    stands out from its base."""
    roots, joints = m.body_rootid[m.geom_bodyid], m.jnt_type
    slides = m.jnt_bodyid[joints == mujoco.mjtJoint.mjJNT_SLIDE]
    moving = [b for b in m.body_rootid[slides] if names.kind(m.body(int(b)).name) != "feeder"]
    hinges = m.jnt_bodyid[joints == mujoco.mjtJoint.mjJNT_HINGE]
    chains = np.setdiff1d(m.body_rootid[hinges], m.body_rootid[slides])
    for g in np.flatnonzero(np.isin(roots, [*moving, *chains])).tolist():
        root, body = int(roots[g]), int(m.geom_bodyid[g])
        if root not in chains or len(WeldFrames.joints_of(m, body)) <= ELBOW:
            yield (root, "body"), placed(m, d, g)


def _loads(m: mujoco.MjModel, d: mujoco.MjData) -> Iterator[tuple[Own, Array]]:
    """Points around all payloads, with lifts down and up. Bodies of parts never turn."""
    frames = WeldFrames.of(m, d)
    held = frames.at(d.qpos[frames.along])
    shapes: dict[int, Array] = {}
    for e in range(m.neq):
        if names.kind(m.equality(e).name) not in ("grip", "hold"):
            continue
        holder, body = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
        if body not in shapes:
            shapes[body] = shape_of(m, body)
        owner = int(m.body_rootid[holder]), "load"
        yield owner, held[e] + shapes[body]
        yield owner, held[e] + shapes[body] + (0.0, 0.0, _stroke(m, holder))


def shape_of(m: mujoco.MjModel, body: int) -> Array:
    """The corners of a body's box in its own frame, with its shells."""
    of = m.geom_bodyid
    geoms = np.flatnonzero((of == body) | (m.body_parentid[of] == body)).tolist()
    return box_of(
        np.concatenate([corners(m, g) @ rotation(m.geom_quat[g]).T + m.geom_pos[g] for g in geoms])
    )


def box_of(points: Array) -> Array:
    """The corners (8, 3) of the box round points (n, 3)."""
    low, high = points.min(axis=0), points.max(axis=0)
    return np.asarray((low + high) / 2 + SIGNS * (high - low) / 2)


def _stroke(m: mujoco.MjModel, holder: int) -> float:
    """Stroke of the lift with this head: the length of its column [m]."""
    robot, _, kind = m.body(holder).name.partition("/")
    return 2 * _half(m, f"{robot}/column", 1) if kind == "head" else 0.0


def _way(m: mujoco.MjModel, d: mujoco.MjData, body: int, load: Array) -> Array:
    """The way of a robot from the B end of its guidepath to that of its rail at A, or of the tray
    until half of its load is in the shed (3,) [m]; none of what stands."""
    if not m.body_jntnum[body]:
        return np.zeros(3)
    name, along = m.body(body).name, d.xaxis[m.body_jntadr[body]]
    if name != names.OUTFEED_TRAY:
        rail = f"{name.partition('/')[0]}/rail"
        return np.asarray(-along * 2 * (_half(m, rail, 0) - _half(m, name, 0)))
    if (wall := _geom(m, "outfeed/wall1")) < 0:
        return np.zeros(3)
    mouth = m.geom_pos[wall, 0] - m.geom_size[wall, 0]
    return np.asarray(along * max(float(mouth - load[:, 0].mean()), 0.0))


def _half(m: mujoco.MjModel, geom: str, axis: int) -> float:
    """Half the size of a geom along one of its axes, 0 where there is none [m]."""
    number = _geom(m, geom)
    return float(m.geom_size[number, axis]) if number >= 0 else 0.0


def _geom(m: mujoco.MjModel, name: str) -> int:
    return int(mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_GEOM.value, name))
