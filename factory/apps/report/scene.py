"""The drawable data of a factory in the engine, and its 3-D view: coloured triangles, shared by
bodies of the same shape, and the robot or label of each body."""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from math import atan2, degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.api import Factory, Geoms, Operation, Replica, names
from factory.apps.drawing.canvas import hexadecimal
from factory.apps.exports.geoms import triangles
from factory.film.dress import dressed
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.meshes.triangles import joined
from factory.support.rotations import rotation

VIEW = (-0.62, -1.0, 0.78)
"""Where the camera stands, seen from the factory."""

ROLE = "role/"
"""What the names of the materials of robots begin with, by what these do."""

PLAIN = 0.0, 0.4
"""Metallic share and roughness of what has no material."""


class Pack:
    """A growing buffer. `index`: for each array by name its type, first byte and count."""

    def __init__(self) -> None:
        self.index: dict[str, tuple[str, int, int]] = {}
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, name: str, values: NDArray[Any]) -> None:
        """Add an array, of type f4, u4 or u1, starting at a multiple of four bytes."""
        kind = {"f": "f4", "u": f"u{values.dtype.itemsize}"}[values.dtype.kind]
        content = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
        content += bytes(-len(content) % 4)
        self.index[name] = kind, self._size, int(values.size)
        self._parts.append(content)
        self._size += len(content)

    def text(self) -> str:
        """The buffer, compressed with gzip (the same bytes at any time), in base 64."""
        return b64encode(gzip.compress(b"".join(self._parts), 9, mtime=0)).decode()


@dataclass(frozen=True)
class DrawnFactory:
    """A factory and the engine's model `m` of it. `position` (bodies, 3) [m] and `quaternion`
    (bodies, 4) of each body at the start, of one that has a parent relative to that or, of a run
    that is not over, to the world; `reach` (2, bodies, 3): the least and the greatest position;
    `places`: where the body of each part is in the finished product [m]; `stations`: where the
    payload is held as operations of several robots end (x, y) [m], each with the labels they make.
    `drawn`: the same in which what it is made of is seen, with the same bodies.
    """

    factory: Factory
    m: mujoco.MjModel = field(repr=False)
    position: Array = field(repr=False)
    quaternion: Array = field(repr=False)
    reach: Array = field(repr=False)
    places: Mapping[str, Iterable[float]] = field(repr=False)
    stations: Mapping[tuple[float, float], list[str]] = field(repr=False)
    drawn: mujoco.MjModel = field(repr=False)

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """What each robot is for, as its paint shows: output, carrier, fed or tool, else shared."""
        m = self.m
        paints = dict(enumerate(self._paints(m)))
        by_robot = []
        for robot in self.factory.robots:
            body = m.body(names.carriage(robot.name))
            first = int(body.geomadr[0])
            worn = (int(m.geom_matid[g]) for g in range(first, first + int(body.geomnum[0])))
            by_robot.append(next(filter(None, map(paints.get, worn)), "shared"))
        return tuple(by_robot)

    @property
    def paints(self) -> dict[str, str]:
        """The colours of roles, as `#rrggbb`, which are those of the robots in 3-D."""
        m = self.drawn
        return {role: hexadecimal(m.mat(i).rgba) for i, role in enumerate(self._paints(m)) if role}

    @staticmethod
    def _paints(m: mujoco.MjModel) -> list[str]:
        """The role that each material of a model is for; "" for any other."""
        every = (m.mat(i).name for i in range(m.nmat))
        return [name.removeprefix(ROLE) if name.startswith(ROLE) else "" for name in every]


def drawn(m: mujoco.MjModel, xml: str, files: Mapping[str, bytes]) -> mujoco.MjModel:
    """The drawn model of a run's model `m`, whose MJCF and mesh files these are; what is written on
    it is read from where the camera stands."""
    text = dressed(xml, m, degrees(atan2(VIEW[1], VIEW[0])))
    return mujoco.MjModel.from_xml_string(text, dict(files))


def stations(
    factory: Factory, m: mujoco.MjModel, ends: Iterable[tuple[Operation, Array]]
) -> dict[tuple[float, float], list[str]]:
    """The stations of operations, each with the state of the engine (nq,) as it ends."""
    replica, sites = Replica(m), {m.site(number).name for number in range(m.nsite)}
    stations: dict[tuple[float, float], list[str]] = {}
    for operation, qpos in ends:
        nest = f"{factory.robots[operation.carrier].name}/nest"
        if len(operation.robots) < 2 or nest not in sites:
            continue
        replica.place(qpos)
        x, y = (round(float(v), 3) for v in replica.d.site_xpos[m.site(nest).id][:2])
        stations.setdefault((x, y), []).append(operation.label)
    return stations


def placed(m: mujoco.MjModel, geom: int) -> tuple[Array, NDArray[np.int64]]:
    """A geom's vertices, in the frame of its body [m], and faces."""
    points, faces = triangles(m, geom)
    return points @ rotation(m.geom_quat[geom]).T + m.geom_pos[geom], faces


def _look(m: mujoco.MjModel, geoms: Sequence[int]) -> tuple[list[NDArray[Any]], float]:
    """Several geoms of a body as one: vertices (n, 3) [m] in its frame, faces (k, 3), colours
    (n, 3) and metallic share and roughness (n, 2) from 0 to 255; and how opaque it is."""
    meshes = [placed(m, geom) for geom in geoms]
    paints = np.array([Geoms(m).colour(geom) for geom in geoms])
    counts = [len(points) for points, _ in meshes]
    vertices, faces = joined(meshes)
    finishes = np.array([_finish(m, int(m.geom_matid[geom])) for geom in geoms])
    values = np.round(255 * np.clip(np.hstack([paints[:, :3], finishes]), 0, 1)).astype(np.uint8)
    corners = np.repeat(values, counts, axis=0)
    made = [
        vertices.astype(np.float32),
        faces.astype(np.uint32),
        corners[:, :3],
        corners[:, 3:],
    ]
    return made, float(paints[:, 3].min())


def _finish(m: mujoco.MjModel, material: int) -> tuple[float, float]:
    """The metallic share and the roughness of a material; what it does not say is that of none."""
    if material < 0:
        return PLAIN
    metallic, rough = float(m.mat_metallic[material]), float(m.mat_roughness[material])
    return (metallic if metallic >= 0 else PLAIN[0]), (rough if rough >= 0 else PLAIN[1])


def scene(stage: DrawnFactory, labels: dict[str, int], pack: Pack) -> dict[str, Any]:
    """The geometry, into the pack, and the list of things: each a shape, the body it moves with,
    and what it stands for (`robot` or `label`, by number)."""
    m = stage.drawn
    robots = {robot.name: robot.index for robot in stage.factory.robots}
    shapes: dict[bytes, int] = {}
    alphas: list[float] = []
    things = []
    for body, geoms in _groups(m):
        made, alpha = _look(m, geoms)
        key = sha256(b"".join(a.tobytes() for a in made) + repr(alpha).encode()).digest()
        if key not in shapes:
            shapes[key] = number = len(shapes)
            alphas.append(round(alpha, 3))
            for letter, values in zip("vfcm", made, strict=True):
                pack.add(f"{letter}{number}", values)
        name = owner(m.geom(geoms[0]).name) if body == 0 else m.body(body).name
        things.append({"shape": shapes[key], "body": body, **stands_for(name, robots, labels)})
    places = _places(stage, labels)
    return {"alphas": alphas, "things": things, "places": places, "view": VIEW}


def _groups(m: mujoco.MjModel) -> Iterator[tuple[int, list[int]]]:
    """The geoms that make one thing: those of a body; of the world those of a robot."""
    owned: dict[str, list[int]] = {}
    for geom in Geoms(m).shown(0):
        owned.setdefault(owner(m.geom(geom).name), []).append(geom)
    for geoms in owned.values():
        yield 0, geoms
    for body in range(1, m.nbody):
        if geoms := list(Geoms(m).shown(body)):
            yield body, geoms


def owner(geom: str) -> str:
    """What a geom of the world belongs to, by its name: `feeder/part1` of `feeder/part1/cap`."""
    return geom.rpartition("/")[0]


def stands_for(name: str, robots: Mapping[str, int], labels: Mapping[str, int]) -> dict[str, int]:
    """What a body, or a geom of the world, is about: a robot, or a part with its feeder and what
    moves in that."""
    head, _, rest = name.partition("/")
    if head in robots:
        return {"robot": robots[head]}
    if head == "part" and names.label_of(name) in labels:
        return {"label": labels[names.label_of(name)], "copy": 1}
    if head == "feeder":
        label = rest if rest in labels else rest.rpartition("/")[0]
        return {"label": labels[label]} if label in labels else {}
    return {}


def _places(stage: DrawnFactory, labels: dict[str, int]) -> dict[str, list[float]]:
    """Where the body of each part, by its label's number, is in the finished product [m]."""
    places = stage.places.items()
    return {str(labels[k]): [round(x, 6) for x in v] for k, v in places if k in labels}
