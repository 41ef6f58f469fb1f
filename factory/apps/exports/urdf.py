"""URDF of the machine that `build` writes as MJCF: a prismatic joint for each robot, each lift,
each slider and the outfeed, a revolute one for a tool that turns, a floating joint for each part;
meshes are in a folder beside the file.

Joints have the coordinates of that MJCF, which are 0 at the start of a run, and its ranges; links
have the names of the bodies there, in the log and in the MCAP.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import atan2, hypot
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.api import names, physical_model
from factory.apps.exports.stock import write
from factory.apps.exports.subject import Subject
from factory.support.arrays import Array
from factory.support.meshes.triangles import convex_hull, stl
from factory.support.rotations import rotation, upright
from factory.support.xml_writer import add, exact, numbers

if TYPE_CHECKING:
    from factory.support.engine import mujoco

FORMAT, TAKES, RAILS = "urdf", "pag", True

GRAM = 1e-3
"""[kg]"""


def export(subject: Subject) -> str | Mapping[str, bytes]:
    """The URDF; with its meshes, where there are any."""
    from factory.api import load

    project = subject.project
    model = physical_model(project.layout, 1, project.settings, project.catalogue, finish=write)
    folder = f"{subject.name.rpartition('.')[0] or subject.name or subject.stem}_meshes"
    speed = project.settings.speed
    speeds = {names.joint(axis): speed / axis.motion.lever for axis in project.factory.axes}
    writer = _Writer(load(model), speed, speeds, folder)
    text = writer.text(subject.stem)
    if not writer.files:
        return text
    return {"": text.encode(), **{f"{folder}/{name}": c for name, c in writer.files.items()}}


class _Writer:
    """Writes the bodies of a compiled model as links; `files`: the meshes that these refer to.
    Joints go at a `speed` [m/s], but for those with `speeds` of their own."""

    def __init__(
        self, m: mujoco.MjModel, speed: float, speeds: Mapping[str, float], folder: str
    ) -> None:
        from factory.support.engine import mujoco

        self.m, self.speed, self.speeds, self.folder = m, speed, speeds, folder
        self.geom, joint = mujoco.mjtGeom, mujoco.mjtJoint
        self.kinds = {int(joint.mjJNT_SLIDE): "prismatic", int(joint.mjJNT_HINGE): "revolute"}
        self.files: dict[str, bytes] = {}
        pairs = zip(m.actuator_trnid[:, 0].tolist(), m.actuator_forcerange[:, 1], strict=True)
        self.force = {joint: float(most) for joint, most in pairs}

    def text(self, name: str) -> str:
        """The document."""
        root = Element("robot", {"name": name})
        add(add(root, "mujoco"), "compiler", strippath="false", fusestatic="false", meshdir=".")
        for body in (n for n in range(self.m.nbody) if self.m.body(n).name != names.COMPASS):
            self._link(root, body)
            if body:
                self._joint(root, body)
        ElementTree.indent(root)
        return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"

    def _link(self, root: Element, body: int) -> None:
        from factory.api import Geoms

        m, seen = self.m, set(Geoms(self.m).shown(body))
        link = add(root, "link", name=m.body(body).name)
        if m.body_jntnum[body]:
            self._inertial(link, body)
        first = m.body_geomadr[body]
        for geom in range(first, first + m.body_geomnum[body]):
            if geom in seen:
                rgba = numbers(round(float(c), 4) for c in Geoms(m).colour(geom))
                for visual in self._shapes(link, "visual", geom):
                    add(add(visual, "material", name=f"geom{geom}"), "color", rgba=rgba)
            collides = m.geom_contype[geom] or m.geom_conaffinity[geom]
            if collides and m.geom_type[geom] != self.geom.mjGEOM_PLANE:  # URDF has no planes
                self._shapes(link, "collision", geom)

    def _inertial(self, link: Element, body: int) -> None:
        inertial = add(link, "inertial")
        _origin(inertial, self.m.body_ipos[body], self.m.body_iquat[body])
        add(inertial, "mass", value=exact([self.m.body_mass[body]]))
        ixx, iyy, izz = (exact([moment]) for moment in self.m.body_inertia[body])
        add(inertial, "inertia", ixx=ixx, iyy=iyy, izz=izz, ixy="0", ixz="0", iyz="0")

    def _joint(self, root: Element, body: int) -> None:
        m, name = self.m, self.m.body(body).name
        joint = m.body_jntadr[body]
        kind = self.kinds.get(int(m.jnt_type[joint]), "floating") if joint >= 0 else "fixed"
        speed = self.speeds.get(m.joint(joint).name, self.speed) if joint >= 0 else self.speed
        element = add(root, "joint", name=m.joint(joint).name if joint >= 0 else name, type=kind)
        at, turn = m.body_pos[body], m.body_quat[body]
        if kind == "prismatic":
            at = at - rotation(turn) @ m.jnt_axis[joint] * m.qpos0[m.jnt_qposadr[joint]]
        if kind == "revolute":
            w, _, _, z = upright(-m.jnt_axis[joint][2] * m.qpos0[m.jnt_qposadr[joint]])
            w, z = turn[0] * w - turn[3] * z, turn[0] * z + turn[3] * w
            turn = np.array([w, 0.0, 0.0, z])
        _origin(element, at, turn)
        parent = m.body(m.body_parentid[body]).name
        child = name if m.body_jntnum[body] < 2 else m.joint(joint + 1).name
        add(element, "parent", link=parent)
        add(element, "child", link=child)
        if kind in ("prismatic", "revolute"):
            self._limit(element, joint, speed)
        if child != name:
            self._across(root, joint + 1, child, name)

    def _across(self, root: Element, joint: int, parent: str, child: str) -> None:
        """The second slide of a body, on a link of its own of a gram: a joint has one axis."""
        m, inertial = self.m, add(add(root, "link", name=parent), "inertial")
        add(inertial, "mass", value=exact([GRAM]))
        moments = dict.fromkeys(("ixx", "iyy", "izz"), exact([GRAM * GRAM]))
        add(inertial, "inertia", **moments, ixy="0", ixz="0", iyz="0")
        element = add(root, "joint", name=m.joint(joint).name, type="prismatic")
        at = -m.jnt_axis[joint] * m.qpos0[m.jnt_qposadr[joint]]
        _origin(element, at, np.array([1.0, 0.0, 0.0, 0.0]))
        add(element, "parent", link=parent)
        add(element, "child", link=child)
        self._limit(element, joint, self.speed)

    def _limit(self, element: Element, joint: int, speed: float) -> None:
        m = self.m
        add(element, "axis", xyz=numbers(m.jnt_axis[joint]))
        low, high, most = (numbers([value]) for value in (*m.jnt_range[joint], speed))
        effort = exact([self.force.get(int(joint), 0.0)])
        add(element, "limit", lower=low, upper=high, effort=effort, velocity=most)

    def _shapes(self, link: Element, tag: str, geom: int) -> list[Element]:
        """The elements of a geom's shape; a capsule has three. A mesh is a file: of one that
        collides its convex hull, as which the engine takes it."""
        from factory.apps.exports.geoms import half_sizes

        m, size = self.m, self.m.geom_size[geom]
        kind, radius = self.geom(m.geom_type[geom]), numbers([size[0]])
        shapes = [("box", {"size": numbers(2 * half_sizes(m, geom))}, 0.0)]
        if kind == self.geom.mjGEOM_MESH:
            shapes = [("mesh", {"filename": self._mesh(geom, tag == "collision")}, 0.0)]
        elif kind == self.geom.mjGEOM_SPHERE:
            shapes = [("sphere", {"radius": radius}, 0.0)]
        elif kind in (self.geom.mjGEOM_CYLINDER, self.geom.mjGEOM_CAPSULE):
            shapes = [("cylinder", {"radius": radius, "length": numbers([2 * size[1]])}, 0.0)]
            if kind == self.geom.mjGEOM_CAPSULE:
                shapes += [("sphere", {"radius": radius}, end) for end in (-size[1], size[1])]
        at, turn, elements = m.geom_pos[geom], m.geom_quat[geom], []
        for shape, attributes, along in shapes:
            elements.append(add(link, tag))
            _origin(elements[-1], at + rotation(turn) @ [0.0, 0.0, along], turn)
            add(add(elements[-1], "geometry"), shape, **attributes)
        return elements

    def _mesh(self, geom: int, hull: bool) -> str:
        """The name of a mesh's file, or of the file of its convex hull."""
        name = self.m.mesh(int(self.m.geom_dataid[geom])).name
        name = f"{name}{'.hull' if hull else ''}.stl"
        if name not in self.files:
            from factory.api import Geoms

            vertices, faces = Geoms(self.m).mesh(geom)
            self.files[name] = stl(*(convex_hull(vertices) if hull else (vertices, faces)))
        return f"{self.folder}/{name}"


def _origin(parent: Element, at: Iterable[float], quaternion: Array) -> None:
    add(parent, "origin", xyz=numbers(at), rpy=numbers(roll_pitch_yaw(quaternion)))


def roll_pitch_yaw(quaternion: Array) -> tuple[float, float, float]:
    """The angles [rad] about the fixed axes x, y and z, in that order, of a unit quaternion."""
    turn = rotation(quaternion)
    pitch = atan2(-turn[2, 0], hypot(turn[0, 0], turn[1, 0]))
    if abs(turn[2, 0]) > 1 - 1e-12:  # only roll and yaw together are determined
        return atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0
    return atan2(turn[2, 1], turn[2, 2]), pitch, atan2(turn[1, 0], turn[0, 0])
