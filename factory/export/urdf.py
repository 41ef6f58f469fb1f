"""URDF of the factory as the engine has it: a prismatic joint for each robot, lift and the outfeed
(its position is the arc length or height of the run's log), a floating one for each part; meshes
stand beside the file in a folder of its name.

Links have the names of the bodies in the MJCF, the log and the MCAP.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import atan2, hypot
from typing import TYPE_CHECKING
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.export.subject import Subject
from factory.geometry.meshes import Array, Mesh, hull_mesh
from factory.geometry.solids import rotation
from factory.mjcf import names
from factory.mjcf.elements import add, exact, numbers
from factory.mjcf.mesh_files import stl
from factory.simulation.modelling import physical_model

if TYPE_CHECKING:
    from factory.support.engine import mujoco

FORMAT, TAKES = "urdf", "pag"


def export(subject: Subject) -> str | Mapping[str, bytes]:
    """The URDF; with its meshes, where there are any."""
    from factory.mjcf.loading import load

    project = subject.project
    model = physical_model(project.layout, 1, project.settings, project.catalogue)
    folder = f"{subject.name.rpartition('.')[0] or subject.name or subject.stem}_meshes"
    writer = _Writer(load(model), project.settings.speed, folder)
    text = writer.text(subject.stem)
    if not writer.files:
        return text
    return {"": text.encode(), **{f"{folder}/{name}": c for name, c in writer.files.items()}}


class _Writer:
    """Writes the bodies of a compiled model as links; notes the meshes that it meets."""

    def __init__(self, m: mujoco.MjModel, speed: float, folder: str) -> None:
        self.m, self.speed, self.folder = m, speed, folder
        self.files: dict[str, bytes] = {}
        self.force = {
            int(joint): float(most)
            for (joint, _), (_, most) in zip(m.actuator_trnid, m.actuator_forcerange, strict=True)
        }

    def text(self, name: str) -> str:
        """The document."""
        root = Element("robot", {"name": name})
        extension = add(root, "mujoco")
        add(extension, "compiler", strippath="false", fusestatic="false", meshdir=".")
        world, *bodies = (n for n in range(self.m.nbody) if self.m.body(n).name != names.COMPASS)
        self._link(root, world)
        for body in bodies:
            self._link(root, body)
            self._joint(root, body)
        ElementTree.indent(root)
        return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"

    def _link(self, root: Element, body: int) -> None:
        from factory.mjcf.replica import paint, shown
        from factory.support.engine import mujoco

        m, seen = self.m, set(shown(self.m, body))
        link = add(root, "link", name=m.body(body).name)
        if m.body_jntnum[body]:
            self._inertial(link, body)
        first = m.body_geomadr[body]
        for geom in range(first, first + m.body_geomnum[body]):
            if m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE:
                continue  # the floor has no end, and URDF no word for that
            if geom in seen:
                for offset, shape in self._shapes(geom, False):
                    visual = self._shape(link, "visual", geom, offset, shape)
                    material = add(visual, "material", name=f"geom{geom}")
                    rgba = (round(float(c), 4) for c in paint(m, geom))
                    add(material, "color", rgba=numbers(rgba))
            if m.geom_contype[geom] or m.geom_conaffinity[geom]:
                for offset, shape in self._shapes(geom, True):
                    self._shape(link, "collision", geom, offset, shape)

    def _inertial(self, link: Element, body: int) -> None:
        m = self.m
        inertial = add(link, "inertial")
        _origin(inertial, m.body_ipos[body], m.body_iquat[body])
        add(inertial, "mass", value=exact([m.body_mass[body]]))
        moments = zip(("ixx", "iyy", "izz"), m.body_inertia[body], strict=True)
        products = {"ixy": "0", "ixz": "0", "iyz": "0"}
        add(inertial, "inertia", **{axis: exact([i]) for axis, i in moments}, **products)

    def _joint(self, root: Element, body: int) -> None:
        from factory.support.engine import mujoco

        m, name = self.m, self.m.body(body).name
        joint = m.body_jntadr[body]
        slides = joint >= 0 and int(m.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
        word = "prismatic" if slides else "floating" if joint >= 0 else "fixed"
        element = add(root, "joint", name=m.joint(joint).name if joint >= 0 else name, type=word)
        at, turn = m.body_pos[body], m.body_quat[body]
        if slides:
            axis = m.jnt_axis[joint]
            at = at - rotation(turn) @ axis * m.qpos0[m.jnt_qposadr[joint]]
        _origin(element, at, turn)
        add(element, "parent", link=m.body(m.body_parentid[body]).name)
        add(element, "child", link=name)
        if slides:
            add(element, "axis", xyz=numbers(m.jnt_axis[joint]))
            low, high = m.jnt_range[joint]
            effort = exact([self.force.get(int(joint), 0.0)])
            limit = {"lower": numbers([low]), "upper": numbers([high]), "effort": effort}
            add(element, "limit", **limit, velocity=numbers([self.speed]))

    def _shapes(self, geom: int, colliding: bool) -> Iterator[tuple[Array, Element]]:
        """The shapes of a geom, and how far along its axis each is."""
        from factory.mjcf.replica import half_sizes
        from factory.support.engine import mujoco

        m, size, here = self.m, self.m.geom_size[geom], np.zeros(3)
        kind = mujoco.mjtGeom(m.geom_type[geom])
        if kind == mujoco.mjtGeom.mjGEOM_MESH:
            yield here, self._mesh(geom, colliding)
        elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
            yield here, Element("sphere", {"radius": numbers([size[0]])})
        elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
            length = {"radius": numbers([size[0]]), "length": numbers([2 * size[1]])}
            yield here, Element("cylinder", length)
            if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
                for end in (-size[1], size[1]):
                    ball = Element("sphere", {"radius": numbers([size[0]])})
                    yield np.array([0.0, 0.0, end]), ball
        else:
            yield here, Element("box", {"size": numbers(2 * half_sizes(m, geom))})

    def _mesh(self, geom: int, colliding: bool) -> Element:
        """A mesh as a file; of one that collides the hull, as which it does."""
        from factory.mjcf.replica import mesh_of

        mesh = Mesh("", *mesh_of(self.m, geom))
        name = self.m.mesh(int(self.m.geom_dataid[geom])).name
        name = f"{name}{'.hull' if colliding else ''}.stl"
        if name not in self.files:
            self.files[name] = stl(hull_mesh(name, mesh.vertices) if colliding else mesh)
        return Element("mesh", {"filename": f"{self.folder}/{name}"})

    def _shape(self, link: Element, tag: str, geom: int, offset: Array, shape: Element) -> Element:
        """A shape of a link, where its geom is and the offset along."""
        turn = self.m.geom_quat[geom]
        element = add(link, tag)
        _origin(element, self.m.geom_pos[geom] + rotation(turn) @ offset, turn)
        add(element, "geometry").append(shape)
        return element


def _origin(parent: Element, at: Iterable[float], quaternion: Array) -> None:
    add(parent, "origin", xyz=numbers(at), rpy=numbers(roll_pitch_yaw(quaternion)))


def roll_pitch_yaw(quaternion: Array) -> tuple[float, float, float]:
    """The angles [rad] about the fixed axes x, y and z, in that order, of a unit quaternion."""
    turn = rotation(quaternion)
    pitch = atan2(-turn[2, 0], hypot(turn[0, 0], turn[1, 0]))
    if abs(turn[2, 0]) > 1 - 1e-12:  # only roll and yaw together are determined
        return atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0
    return atan2(turn[2, 1], turn[2, 2]), pitch, atan2(turn[1, 0], turn[0, 0])
