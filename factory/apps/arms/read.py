"""Serial chains of MJCF: any model with one chain of hinge and slide joints from a fixed base, and
a site at the tool.

All is read from the model that the engine compiles, so the compiler's settings, such as degrees or
radians, are those of the file. Speeds and accelerations, for which MJCF has no place, are numerics
`speed` and `acceleration` of its `custom` section, unless they are given. Raises InputError
(BadArm) that says what the file has and what would be valid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from factory.api import Diagnostic, InputError
from factory.apps.arms.chain import ConvexBody, JointLimits, LinkInertia, SerialChain, steiner
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.errors import Position
from factory.support.rotations import rotation

SIDES = 16
"""Number of sides of the prism round a cylinder."""


def chain_of(m: mujoco.MjModel, file: str, tool: str = "tool") -> SerialChain:
    """The chain of a model.

    Args:
        m: the model.
        file: what errors call its file.
        tool: name of the site at the tool.
    """
    return _Reader(m, file, tool).chain()


def bad_arm(file: str, message: str, hint: str) -> InputError:
    """What is said of a file that is no arm (BadArm)."""
    return InputError(Diagnostic("BadArm", message, Position(file, 1, 1), hint))


class _Reader:
    """The reading of one compiled model."""

    def __init__(self, m: mujoco.MjModel, file: str, tool: str) -> None:
        self.m, self.file = m, file
        self._refuse_joints()
        sites = [m.site(k).name for k in range(m.nsite)]
        if tool not in sites:
            there = f"its sites are {', '.join(filter(None, sites))}" if any(sites) else "none"
            self._refuse(
                f"has no site '{tool}'", f'add <site name="{tool}"/> at the tool ({there})'
            )
        self.site = sites.index(tool)
        self.path = self._path(int(m.site_bodyid[self.site]))
        self._refuse_branches()
        self.base = 0 if m.body_jntnum[self.path[1]] else self.path[1]
        self.place, self.turn = self._poses()

    def _refuse(self, message: str, hint: str) -> None:
        raise bad_arm(self.file, message, hint)

    def _joint(self, number: int) -> str:
        return f"joint '{self.m.joint(number).name or number + 1}'"

    def _refuse_joints(self) -> None:
        """Refuse what no serial chain of limited hinges and slides has."""
        kinds = {int(mujoco.mjtJoint.mjJNT_BALL): "ball", int(mujoco.mjtJoint.mjJNT_FREE): "free"}
        valid = "an arm is one chain of hinge and slide joints from a fixed base"
        if not self.m.njnt:
            self._refuse("has no joints", valid)
        for number, kind in enumerate(self.m.jnt_type.tolist()):
            if kind in kinds:
                self._refuse(f"{self._joint(number)} is a {kinds[kind]} joint", valid)
            if not self.m.jnt_limited[number]:
                hint = "give it a range; one of several turns where it has no stop"
                self._refuse(f"{self._joint(number)} has no limits", hint)
            if np.any(self.m.jnt_stiffness[number]):
                hint = "an arm is moved by its drives and its weight alone"
                self._refuse(f"{self._joint(number)} has a spring", hint)
        if self.m.neq or self.m.ntendon:
            hint = "an arm is moved by one drive at each joint; fix the fingers of a gripper"
            self._refuse("has equality constraints or tendons", hint)

    def _path(self, body: int) -> list[int]:
        """The bodies from the world to one, in order."""
        path = [body]
        while path[-1]:
            path.append(int(self.m.body_parentid[path[-1]]))
        return path[::-1]

    def _refuse_branches(self) -> None:
        off = [n for n, body in enumerate(self.m.jnt_bodyid) if int(body) not in self.path]
        if off:
            hint = "fix the fingers of a gripper, and leave out what the arm does not carry"
            message = f"is not one chain: {self._joint(off[0])} is not between base and tool"
            self._refuse(message, hint)

    def _poses(self) -> tuple[Array, Array]:
        """Places (bodies, 3) and orientations (bodies, 3, 3) of all bodies in the frame of the
        base, every joint where the file draws it."""
        place, turn = np.zeros((self.m.nbody, 3)), np.tile(np.eye(3), (self.m.nbody, 1, 1))
        for body in range(1, self.m.nbody):
            parent = int(self.m.body_parentid[body])
            place[body] = place[parent] + turn[parent] @ self.m.body_pos[body]
            turn[body] = turn[parent] @ rotation(self.m.body_quat[body])
        home = turn[self.base].T
        return (place - place[self.base]) @ home.T, home @ turn

    def chain(self) -> SerialChain:
        """The chain."""
        m, count = self.m, self.m.njnt
        owner = m.jnt_bodyid
        place = np.array([self.place[b] + self.turn[b] @ m.jnt_pos[j] for j, b in enumerate(owner)])
        place, turn = np.vstack([np.zeros(3), place]), np.stack([np.eye(3), *self.turn[owner]])
        before = np.swapaxes(turn[:-1], 1, 2)
        anchor = (before @ np.diff(place, axis=0)[..., None])[..., 0]
        tool = int(m.site_bodyid[self.site])
        at = self.place[tool] + self.turn[tool] @ m.site_pos[self.site]
        stand = self.turn[tool] @ rotation(m.site_quat[self.site])
        frames = self._frames()
        return SerialChain(
            tuple(m.joint(j).name or f"joint {j + 1}" for j in range(count)),
            m.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE,
            anchor,
            before @ turn[1:],
            np.array(m.jnt_axis),
            np.array(m.qpos0),
            turn[-1].T @ (at - place[-1]),
            turn[-1].T @ stand,
            self._limits(),
            self._inertia(frames, place, turn),
            tuple(self._bodies(frames, place, turn)),
        )

    def _frames(self) -> list[int]:
        """The frame that each body moves with; -1 for what does not belong to the arm."""
        frames = [-1] * self.m.nbody
        for body in range(self.m.nbody):
            count = int(self.m.body_jntnum[body])
            parent = frames[int(self.m.body_parentid[body])]
            frames[body] = int(self.m.body_jntadr[body]) + count if count else parent
            if body == self.base:
                frames[body] = 0
        return frames

    def _limits(self) -> JointLimits:
        m = self.m
        speed, acceleration = self._values("speed"), self._values("acceleration")
        torque = np.full(m.njnt, np.inf)
        limited = m.jnt_actfrclimited.astype(bool)
        torque[limited] = np.abs(m.jnt_actfrcrange[limited]).min(axis=1)
        for drive in range(m.nu):
            if m.actuator_trntype[drive] == mujoco.mjtTrn.mjTRN_JOINT:
                joint, gear = int(m.actuator_trnid[drive, 0]), abs(m.actuator_gear[drive, 0])
                torque[joint] = min(torque[joint], gear * self._force(drive))
        return JointLimits(m.jnt_range[:, 0], m.jnt_range[:, 1], speed, acceleration, torque)

    def _force(self, drive: int) -> float:
        """The greatest force of an actuator [N m, N]."""
        m = self.m
        force = float("inf")
        if m.actuator_forcelimited[drive]:
            force = float(np.abs(m.actuator_forcerange[drive]).min())
        is_motor = not m.actuator_biastype[drive] and not m.actuator_dyntype[drive]
        if is_motor and m.actuator_ctrllimited[drive]:
            control = float(np.abs(m.actuator_ctrlrange[drive]).min())
            force = min(force, control * abs(float(m.actuator_gainprm[drive, 0])))
        return force

    def _values(self, name: str) -> Array:
        """Limits of a kind."""
        rows = {self.m.numeric(k).name: self.m.numeric(k).data for k in range(self.m.nnumeric)}
        row = np.array(rows.get(name, ()), float)
        count = self.m.njnt
        valid = f"{name} = [...], {count} numbers above 0, one for each joint [rad, m, s]"
        if not row.size:
            self._refuse(f"says no {name} of its joints", valid)
        if row.shape != (count,) or not (np.isfinite(row) & (row > 0)).all():
            self._refuse(f"has the {name} {row.tolist()}", valid)
        return row

    def _inertia(self, frames: Sequence[int], place: Array, turn: Array) -> LinkInertia:
        """The inertia of all bodies of each link together."""
        m, count = self.m, self.m.njnt
        rows = [self._link(frames, k, place[k], turn[k]) for k in range(1, count + 1)]
        columns = [np.array(column) for column in zip(*rows, strict=True)]
        mass, center, moment, weight, weight_center = columns
        return LinkInertia(mass, center, moment, weight, weight_center, np.array(m.dof_armature))

    def _link(
        self, frames: Sequence[int], frame: int, place: Array, turn: Array
    ) -> tuple[float, Array, Array, float, Array]:
        """Mass, centre and moment of what moves with a frame; weight and its centre."""
        m = self.m
        bodies = [b for b, k in enumerate(frames) if k == frame]
        mass = m.body_mass[bodies]
        at = np.array([self.place[b] + self.turn[b] @ m.body_ipos[b] for b in bodies])
        at = (at.reshape(-1, 3) - place) @ turn
        weight = mass * (1 - m.body_gravcomp[bodies])
        center = mass @ at / max(float(mass.sum()), 1e-300)
        moment = np.zeros((3, 3))
        for body, offset in zip(bodies, at - center, strict=True):
            axes = turn.T @ self.turn[body] @ rotation(m.body_iquat[body])
            moment += axes @ np.diag(m.body_inertia[body]) @ axes.T
            moment += steiner(float(m.body_mass[body]), offset)
        total = float(weight.sum())
        middle = weight @ at / total if abs(total) > 1e-12 else np.zeros(3)
        return float(mass.sum()), center, moment, total, middle

    def _bodies(self, frames: Sequence[int], place: Array, turn: Array) -> list[ConvexBody]:
        """The convex bodies of what can touch; of all geoms of the arm, if none can."""
        m = self.m
        endless = int(mujoco.mjtGeom.mjGEOM_PLANE), int(mujoco.mjtGeom.mjGEOM_HFIELD)
        mine = [g for g in range(m.ngeom) if frames[int(m.geom_bodyid[g])] >= 0]
        mine = [g for g in mine if int(m.geom_type[g]) not in endless]
        solid = (m.geom_contype != 0) | (m.geom_conaffinity != 0)
        bodies = []
        for geom in [g for g in mine if solid[g]] or mine:
            body = int(m.geom_bodyid[geom])
            frame = frames[body]
            points, radius = _convex(m, geom)
            points = points @ rotation(m.geom_quat[geom]).T + m.geom_pos[geom]
            points = points @ self.turn[body].T + self.place[body]
            name = m.geom(geom).name or f"geom {geom + 1}"
            bodies.append(ConvexBody(name, frame, (points - place[frame]) @ turn[frame], radius))
        return bodies


def _convex(m: mujoco.MjModel, geom: int) -> tuple[Array, float]:
    """Points (k, 3) in the frame of a geom, and a radius, whose hull contains the geom."""
    kind, size = m.geom_type[geom], m.geom_size[geom]
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_SPHERE:
        return np.zeros((1, 3)), float(size[0])
    if kind == kinds.mjGEOM_CAPSULE:
        return np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), float(size[0])
    if kind == kinds.mjGEOM_CYLINDER:
        angle = 2 * np.pi * np.arange(SIDES) / SIDES
        rim = size[0] / np.cos(np.pi / SIDES) * np.column_stack([np.cos(angle), np.sin(angle)])
        ends = np.repeat([-size[1], size[1]], SIDES)
        return np.column_stack([np.vstack([rim, rim]), ends]), 0.0
    if kind == kinds.mjGEOM_MESH:
        return _hull(m, int(m.geom_dataid[geom])), 0.0
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    return signs * size, 0.0


def _hull(m: mujoco.MjModel, mesh: int) -> Array:
    """The vertices (k, 3) of a mesh's convex hull; all of them where the engine made no hull."""
    start = int(m.mesh_vertadr[mesh])
    vertices = m.mesh_vert[start : start + int(m.mesh_vertnum[mesh])].astype(float)
    graph = int(m.mesh_graphadr[mesh])
    if graph < 0:
        return np.asarray(vertices)
    count = int(m.mesh_graph[graph])
    corners = m.mesh_graph[graph + 2 + count : graph + 2 + 2 * count]
    return np.asarray(vertices[corners])
