"""What machines sweep on their ways, by the engine's shapes of their bodies: boxes, and seen from
above the hulls of what is in them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPoint

from factory.apps.exports.clearance.documents import MachineWay
from factory.apps.exports.clearance.machines import Machines
from factory.support.engine import mujoco

Boxes = NDArray[np.float64]
Points = NDArray[np.float64]

NEAREST = 2e-5
"""Bodies whose boxes are no further apart are near [m]."""

PIECES = 3
"""The group of the geoms that are the convex pieces of a part."""

TOUCHING = 1e-5
"""A machine touches what stands within this: a shutter slides closely before its walls [m]."""

PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)

SIDES = 64
"""A disc is in a polygon of so many sides."""

STEPS = 90
"""Angles at which a turning box is looked at."""


@dataclass(frozen=True, slots=True)
class SweptShapes:
    """What a machine and what it holds sweep.

    Attributes:
        geoms: whose each shape is.
        boxes: their boxes (n, 2, 3) [m].
        plans: points (k, 2), seen from above, in whose hull each is [m].
    """

    geoms: tuple[str, ...]
    boxes: Boxes
    plans: tuple[Points, ...]

    @classmethod
    def of(cls, rows: Iterable[tuple[str, Boxes, Points]]) -> SweptShapes:
        """Those of some shapes: whose each is, its box, its points."""
        geoms, boxes, plans = [*zip(*rows, strict=True)] or ((), (), ())
        return cls(tuple(geoms), np.array(boxes).reshape(-1, 2, 3), tuple(plans))

    def near(self, other: SweptShapes, least: float = NEAREST) -> tuple[str, str] | None:
        """The geoms of two machines that are no further apart than the `least` distance [m], in
        height and seen from above: of which that is so of the boxes, and of the hulls of what is
        in them. Where there are several, those whose boxes are nearest."""
        a, b = self.boxes, other.boxes
        apart = np.maximum(a[:, None, 0] - b[None, :, 1], b[None, :, 0] - a[:, None, 1]).max(axis=2)
        pairs = np.argwhere(apart <= least)
        for i, j in pairs[np.argsort(apart[apart <= least], kind="stable")].tolist():
            one, its = (MultiPoint(plan).convex_hull for plan in (self.plans[i], other.plans[j]))
            if one.distance(its) <= least:
                return self.geoms[i], other.geoms[j]
        return None


class Sweeping:
    """Sweeps the bodies of a model from where it starts."""

    def __init__(self, machines: Machines) -> None:
        self._machines, self._m = machines, machines.m
        self._d = mujoco.MjData(self._m)
        mujoco.mj_kinematics(self._m, self._d)

    def swept(self, way: MachineWay) -> SweptShapes:
        """What a machine sweeps on a way."""
        m, d, rows = self._m, self._d, list[tuple[str, Boxes, Points]]()
        for body in (self._machines.bodies[name] for name in way.bodies):
            for geom in self._machines.solid(body):
                at, turn = d.geom_xpos[geom], d.geom_xmat[geom].reshape(3, 3)
                name = m.geom(geom).name or way.machine
                rows += [(name, *each) for each in self._sweep(body, way, geom, at, turn)]
        for weld in (self._machines.welds[name] for name in way.welds):
            holder, part = int(m.eq_obj1id[weld]), int(m.eq_obj2id[weld])
            turn, place = _turn(m.eq_data[weld][6:10]), m.eq_data[weld][3:6]
            here = d.xmat[holder].reshape(3, 3)
            for geom in self._shapes(part):
                at = d.xpos[holder] + here @ (place + turn @ m.geom_pos[geom])
                name = m.geom(geom).name or m.body(part).name
                held = here @ turn @ _turn(m.geom_quat[geom])
                rows += [(name, *each) for each in self._sweep(holder, way, geom, at, held)]
        return SweptShapes.of(rows)

    def standing(self, moving: Collection[str]) -> SweptShapes:
        """What stands on the ground, apart from some bodies: those of machines."""
        m, d = self._m, self._d
        machines = {self._machines.bodies[name] for name in moving}
        bodies = (b for b in range(m.nbody) if not self._machines.root(b) and b not in machines)
        geoms = [
            g for body in bodies for g in self._machines.solid(body) if m.geom_type[g] != PLANE
        ]
        places = [(d.geom_xpos[g], d.geom_xmat[g].reshape(3, 3)) for g in geoms]
        names = (m.geom(g).name or m.body(m.geom_bodyid[g]).name for g in geoms)
        pairs = zip(names, geoms, places, strict=True)
        return SweptShapes.of(
            (name, self._box(geom, *place), self._plan(geom, *place)) for name, geom, place in pairs
        )

    def _sweep(
        self, body: int, way: MachineWay, geom: int, at: Boxes, turn: Boxes
    ) -> Iterator[tuple[Boxes, Points]]:
        """The box, and points seen from above, of what a geom of a body sweeps as joints go over
        spans, one group after the other. A joint that turns about the vertical comes first: it is
        the body's own."""
        m, d = self._m, self._d
        above = {*self._machines.above(body)}
        box, plan = self._box(geom, at, turn), self._plan(geom, at, turn)
        for group in way.spans:
            swept, points = box.copy(), plan
            for name, (low, high) in zip(way.joints, group, strict=True):
                joint = self._machines.joints[name]
                if int(m.jnt_bodyid[joint]) not in above:
                    continue
                begin = m.qpos0[m.jnt_qposadr[joint]]
                if m.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
                    turns = np.linspace(low - begin, high - begin, STEPS) * d.xaxis[joint][2]
                    swept = _turned(swept, d.xanchor[joint], turns, self._stands(geom, turn))
                    points = _corners(swept)
                    continue
                ends = np.outer([low - begin, high - begin], d.xaxis[joint])
                swept += [ends.min(axis=0), ends.max(axis=0)]
                points = (points[:, None] + ends[:, :2]).reshape(-1, 2)
            yield swept, points

    def _stands(self, geom: int, turn: Boxes) -> bool:
        """Whether a geom that is turned so is a cylinder that stands."""
        is_round = self._m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
        return bool(is_round and abs(abs(turn[2, 2]) - 1.0) < 1e-9)

    def _plan(self, geom: int, at: Boxes, turn: Boxes) -> Points:
        """Points (k, 2), seen from above, in whose hull a geom is."""
        m = self._m
        if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            mesh = m.geom_dataid[geom]
            first = m.mesh_vertadr[mesh]
            vertices = m.mesh_vert[first : first + m.mesh_vertnum[mesh]]
            return np.asarray((at + vertices @ turn.T)[:, :2])
        if not self._stands(geom, turn):
            return _corners(self._box(geom, at, turn))
        angles = np.arange(SIDES) * 2 * np.pi / SIDES
        radius = float(m.geom_size[geom][0]) / np.cos(np.pi / SIDES)
        return np.asarray(at[:2] + radius * np.column_stack([np.cos(angles), np.sin(angles)]))

    def _shapes(self, part: int) -> list[int]:
        """The geoms of a part that can collide: its pieces, or what is drawn of it."""
        geoms = [*self._machines.geoms(part)]
        return [g for g in geoms if self._m.geom_group[g] == PIECES] or geoms

    def _box(self, geom: int, at: Boxes, turn: Boxes) -> Boxes:
        low, half = self._m.geom_aabb[geom][:3], self._m.geom_aabb[geom][3:]
        middle, half = at + turn @ low, np.abs(turn) @ half
        return np.array([middle - half, middle + half])


def _corners(box: Boxes) -> Points:
    """The corners (4, 2) of a box, seen from above."""
    (x, y), (u, v) = box[:, :2]
    return np.array([[x, y], [u, y], [u, v], [x, v]])


def _turned(box: Boxes, anchor: Boxes, turns: Boxes, standing: bool) -> Boxes:
    """The box of a box, or of a cylinder that stands in it, which turns about a vertical axis."""
    half = (box[1] - box[0]) / 2 * standing
    ends = np.array([box[0] + half, box[1] - half])
    x, y = np.meshgrid(ends[:, 0] - anchor[0], ends[:, 1] - anchor[1])
    c, s = np.cos(turns)[:, None], np.sin(turns)[:, None]
    u, v = c * x.ravel() - s * y.ravel() + anchor[0], s * x.ravel() + c * y.ravel() + anchor[1]
    low, high = box[:, 2]
    plan = np.array([[u.min(), v.min()], [u.max(), v.max()]]) + np.outer([-1, 1], half[:2])
    return np.column_stack([plan, [low, high]])


def _turn(quaternion: Boxes) -> Boxes:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
