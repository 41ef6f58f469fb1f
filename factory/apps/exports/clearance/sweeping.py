"""The boxes that machines sweep on their ways, by the engine's shapes of their bodies."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from factory.api import mujoco
from factory.apps.exports.clearance.documents import MachineWay
from factory.apps.exports.clearance.machines import Machines

Boxes = NDArray[np.float64]

NEAREST = 2e-5
"""Bodies whose boxes are no further apart are near [m]."""

PIECES = 3
"""The group of the geoms that are the convex pieces of a part."""

TOUCHING = 1e-5
"""A machine touches what stands within this: a shutter slides closely before its walls [m]."""

PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)

STEPS = 90
"""Angles at which a turning box is looked at."""


@dataclass(frozen=True, slots=True)
class SweptBoxes:
    """The boxes (n, 2, 3) that a machine and what it holds sweep [m], and whose they are."""

    geoms: tuple[str, ...]
    boxes: Boxes

    def near(self, other: SweptBoxes, least: float = NEAREST) -> tuple[str, str] | None:
        """The geoms of two machines that come nearest, where that is no more than the `least`
        distance [m]."""
        a, b = self.boxes, other.boxes
        apart = np.maximum(a[:, None, 0] - b[None, :, 1], b[None, :, 0] - a[:, None, 1]).max(axis=2)
        if not apart.size or apart.min() > least:
            return None
        i, j = np.unravel_index(int(apart.argmin()), apart.shape)
        return self.geoms[i], other.geoms[j]


class Sweeping:
    """Sweeps the bodies of a model from where it starts."""

    def __init__(self, machines: Machines) -> None:
        self._machines, self._m = machines, machines.m
        self._d = mujoco.MjData(self._m)
        mujoco.mj_kinematics(self._m, self._d)

    def swept(self, way: MachineWay) -> SweptBoxes:
        """What a machine sweeps on a way."""
        m, d, names, boxes = self._m, self._d, list[str](), list[Boxes]()
        for body in (self._machines.bodies[name] for name in way.bodies):
            for geom in self._machines.solid(body):
                box = self._box(geom, d.geom_xpos[geom], d.geom_xmat[geom].reshape(3, 3))
                standing = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
                standing &= abs(abs(d.geom_xmat[geom][8]) - 1.0) < 1e-9
                boxes += self._sweep(body, way, box, bool(standing))
                names += [m.geom(geom).name or way.machine] * len(way.spans)
        for weld in (self._machines.welds[name] for name in way.welds):
            holder, part = int(m.eq_obj1id[weld]), int(m.eq_obj2id[weld])
            turn, place = _turn(m.eq_data[weld][6:10]), m.eq_data[weld][3:6]
            here = d.xmat[holder].reshape(3, 3)
            for geom in self._shapes(part):
                at = d.xpos[holder] + here @ (place + turn @ m.geom_pos[geom])
                box = self._box(geom, at, here @ turn @ _turn(m.geom_quat[geom]))
                boxes += self._sweep(holder, way, box)
                names += [m.geom(geom).name or m.body(part).name] * len(way.spans)
        return SweptBoxes(tuple(names), np.array(boxes).reshape(-1, 2, 3))

    def standing(self, moving: Collection[str]) -> SweptBoxes:
        """What stands on the ground, apart from some bodies: those of machines."""
        m, d = self._m, self._d
        machines = {self._machines.bodies[name] for name in moving}
        bodies = (b for b in range(m.nbody) if not self._machines.root(b) and b not in machines)
        geoms = [
            g for body in bodies for g in self._machines.solid(body) if m.geom_type[g] != PLANE
        ]
        boxes = [self._box(g, d.geom_xpos[g], d.geom_xmat[g].reshape(3, 3)) for g in geoms]
        names = (m.geom(g).name or m.body(m.geom_bodyid[g]).name for g in geoms)
        return SweptBoxes(tuple(names), np.array(boxes).reshape(-1, 2, 3))

    def _sweep(self, body: int, way: MachineWay, box: Boxes, standing: bool = False) -> list[Boxes]:
        """What a box of a body sweeps as joints go over spans, one group after the other. A joint
        that turns about the vertical comes first: it is the body's own. What is in the box may be a
        `standing` cylinder."""
        m, d, boxes = self._m, self._d, list[Boxes]()
        above = {*self._machines.above(body)}
        for group in way.spans:
            swept = box.copy()
            for name, (low, high) in zip(way.joints, group, strict=True):
                joint = self._machines.joints[name]
                if int(m.jnt_bodyid[joint]) not in above:
                    continue
                begin = m.qpos0[m.jnt_qposadr[joint]]
                if m.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
                    turns = np.linspace(low - begin, high - begin, STEPS) * d.xaxis[joint][2]
                    swept = _turned(swept, d.xanchor[joint], turns, standing)
                    continue
                ends = np.outer([low - begin, high - begin], d.xaxis[joint])
                swept += [ends.min(axis=0), ends.max(axis=0)]
            boxes.append(swept)
        return boxes

    def _shapes(self, part: int) -> list[int]:
        """The geoms of a part that can collide: its pieces, or what is drawn of it."""
        geoms = [*self._machines.geoms(part)]
        return [g for g in geoms if self._m.geom_group[g] == PIECES] or geoms

    def _box(self, geom: int, at: Boxes, turn: Boxes) -> Boxes:
        low, half = self._m.geom_aabb[geom][:3], self._m.geom_aabb[geom][3:]
        middle, half = at + turn @ low, np.abs(turn) @ half
        return np.array([middle - half, middle + half])


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
