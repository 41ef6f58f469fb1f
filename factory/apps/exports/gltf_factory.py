"""glTF 2.0 of the whole factory in metres, y upwards: robots, feeders, outfeed, floor and parts; of
a PAG in its initial state, of a log at a time (`--of SECONDS`, its end by default); .glb or .gltf
by the ending of the file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from factory.api import Diagnostic, InputError, Mesh, Model, names, physical_model
from factory.apps.exports.chain_rest import joints_at_rest, key_values
from factory.apps.exports.gltf import new_scene, pose, shaded, written
from factory.apps.exports.subject import Subject
from factory.apps.log import Log
from factory.support.arrays import Array
from factory.support.rotations import rotation

if TYPE_CHECKING:
    from factory.api import Replica

FORMAT, TAKES, BINARY, OF, ENDING = "gltf-factory", "factory", True, "a time of a log [s]", "glb"

FACTORY = "/factory"
"""The outermost node of the factory."""

FLOOR, MARGIN, THICK = (0.93, 0.935, 0.94, 1.0), 0.2, 0.002
"""Colour of the floor, its margin around the geoms [m], and its thickness [m]."""


def export(subject: Subject) -> bytes:
    """The file. Raises InputError for a time that the log does not have."""
    binary = not subject.name.lower().endswith(".gltf")
    return write_factory(_state(subject), binary)


def _state(subject: Subject) -> Replica:
    """The engine's model in the requested state."""
    from factory.api import Replica, load
    from factory.apps.log.model import model_of

    if isinstance(subject.source, Log):
        replica = Replica(model_of(subject.log))
        replica.place(subject.log.qpos[_row(subject.log, subject.of)])
        return replica
    if subject.of:
        message = "--of is a time of a log; a PAG gives the factory at its start"
        raise InputError(Diagnostic("Usage", message, None, "leave it out, or give a log"))
    project = subject.project
    model = physical_model(project.layout, 1, project.settings, project.catalogue)
    replica = Replica(load(model))
    replica.place(key_values(replica.m, joints_at_rest(project.layout))[0])
    return replica


def _row(log: Log, at: str) -> int:
    """The row of a log at a time [s]; the last without one."""
    if not at:
        return -1
    try:
        row = log.row_at(float(at)) if float(at) >= 0 else len(log)
    except ValueError:
        row = len(log)
    if row >= len(log):
        hint = f"give a time from 0 to {int(100 * log.time[-1] + 1e-6) / 100:.2f} s"
        raise InputError(Diagnostic("Usage", f"--of '{at}' is no time of the log", None, hint))
    return row


def write_factory(replica: Replica, binary: bool) -> bytes:
    """A factory in its present state as a glTF: a node for each body, named as in the MJCF, within
    it one for each shape; shapes of equal size and colour share a mesh. Spare parts are left
    out."""
    from factory.api import Geoms
    from factory.apps.exports.geoms import triangles

    m, d = replica.m, replica.d
    scene = new_scene(FACTORY)
    geoms: list[int] = []
    meshes: dict[tuple[object, ...], str] = {}
    for body in range(m.nbody):
        if body and (d.xpos[body, 2] < Model.HIDDEN or m.body(body).name == names.COMPASS):
            continue
        node = _node(replica, body)
        if body:
            parent = int(m.body_parentid[body])
            there, here = _pose(replica, parent), _pose(replica, body)
            scene.graph.update(node, _node(replica, parent), matrix=np.linalg.solve(there, here))
        for geom in Geoms(m).shown(body):
            kind, colour = (int(m.geom_type[geom]), int(m.geom_dataid[geom])), Geoms(m).colour(geom)
            key = (*kind, *m.geom_size[geom].tolist(), *colour.tolist())
            if key not in meshes:
                meshes[key] = f"mesh{len(meshes)}"
                mesh = Mesh("shape", *triangles(m, geom))
                scene.geometry[meshes[key]] = shaded(mesh, colour)
            name = m.geom(geom).name or f"geom{geom}"
            name = f"{name}/shape" if name in scene.graph.nodes else name
            place = pose(m.geom_pos[geom], rotation(m.geom_quat[geom]))
            scene.graph.update(name, node, matrix=place, geometry=meshes[key])
            geoms.append(geom)
    low, high = _ground(replica, geoms)
    scene.geometry["floor"] = shaded(_slab(high - low), FLOOR)
    middle = (*(low + high) / 2, -THICK / 2)
    scene.graph.update("floor", FACTORY, matrix=pose(middle, np.eye(3)), geometry="floor")
    return written(scene, binary)


def _node(replica: Replica, body: int) -> str:
    return replica.m.body(body).name if body else FACTORY


def _pose(replica: Replica, body: int) -> Array:
    return pose(replica.d.xpos[body], replica.d.xmat[body].reshape(3, 3))


def _ground(replica: Replica, geoms: list[int]) -> tuple[Array, Array]:
    """The corners (2,) of a floor under all geoms [m]."""
    at, reach = replica.d.geom_xpos[geoms, :2], replica.m.geom_rbound[geoms][:, None] + MARGIN
    return (at - reach).min(axis=0), (at + reach).max(axis=0)


def _slab(size: Array) -> Mesh:
    from trimesh import creation

    made = creation.box(extents=(*size, THICK))
    return Mesh("floor", np.asarray(made.vertices, float), np.asarray(made.faces, np.int64))
