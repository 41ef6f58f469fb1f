"""From the description of a part in a tree or a bill to the parameters of `atomic`, and the frames
of sub-assemblies and parts in the product."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from warnings import catch_warnings

import numpy as np

from factory.api import PAG, Parameter, Value
from factory.apps.importing.draft import ImportFaults
from factory.apps.importing.mesh_files import MeshStore, first_file, path_inside
from factory.support.arrays import Array
from factory.support.errors import Position
from factory.support.files import MESH, read_bytes
from factory.support.meshes.mesh_file import ANEW, UnreadableMesh
from factory.support.meshes.mesh_reader import read_mesh
from factory.support.rotations import rotation
from factory.support.texts import near_file, quoted
from factory.theory.problem.parameters import ParameterKind

CLEAN, NOISE = 0.1, 1e-6
"""A clean rotation is by multiples of so many degrees about the axes; one that differs from it by
no more than such an angle [rad] is that rotation."""

EXACT = 1e-8
"""A place that is so near a whole micrometre is there [m]."""

UNTURNED = (1.0, 0.0, 0.0, 0.0)
"""The quaternion of no rotation."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A frame in the product: a vertex v of it is at turn · v + at [m]. `moved`: whether it differs
    from that of the product."""

    turn: Array = field(default_factory=lambda: np.eye(3))
    at: Array = field(default_factory=lambda: np.zeros(3))
    moved: bool = False

    def inside(self, values: Mapping[str, Value]) -> Placement:
        """The frame at `pos` [m], rotated by `quat`, in this frame; this frame if both are
        missing."""
        if not values.keys() & {"pos", "quat"}:
            return self
        there = self.turn @ np.array(values.get("pos", (0.0, 0.0, 0.0))) + self.at
        unit = np.array(values.get("quat", UNTURNED))
        unit /= np.abs(unit).max()
        return Placement(self.turn @ rotation(unit / np.linalg.norm(unit)), there, True)

    def parameters(self, values: Mapping[str, Value]) -> list[Parameter]:
        """`pos` and `quat` of a part in this frame; unchanged if the frame is the product's."""
        if self.moved:
            whole = self.inside(values)
            turn = quaternion(whole.turn)
            values = {"pos": place(whole.at)} | ({} if turn == UNTURNED else {"quat": turn})
        return [Parameter(name, values[name]) for name in ("pos", "quat") if name in values]


def rounded(numbers: Array) -> tuple[float, ...]:
    """Numbers rounded to nine decimals: to a nanometre."""
    return tuple(float(x) for x in np.round(numbers, 9) + 0.0)


def place(numbers: Array) -> tuple[float, ...]:
    """A place [m] to a nanometre, or to a whole micrometre where it is within EXACT of that: the
    numbers of an STL file have seven digits."""
    whole = np.round(numbers, 6)
    return rounded(np.where(np.abs(numbers - whole) <= EXACT, whole, numbers))


def quaternion(turn: Array) -> tuple[float, ...]:
    """The unit quaternion (w, x, y, z), w >= 0, of the rotation nearest to a matrix; that of a
    clean rotation if it is within NOISE."""
    from scipy.spatial.transform import Rotation

    exact = Rotation.from_matrix(turn)
    with catch_warnings(action="ignore"):  # of angles that are not the only ones
        angles = exact.as_euler("xyz", degrees=True)
    clean = Rotation.from_euler("xyz", np.round(angles / CLEAN) * CLEAN, degrees=True)
    near = (clean * exact.inv()).magnitude() <= NOISE
    nearest = clean if near else exact
    return rounded(nearest.as_quat(canonical=True, scalar_first=True))


LENGTHS = tuple(name for name, kind in ParameterKind.GEOMETRY.items() if kind.long)
"""Parameters in the unit of the file."""


@dataclass(slots=True)
class PartMaker:
    """Makes parts of a tree or a bill. `folder`: the folder of its meshes, each of which is read
    once and added to the `store`; `unit`: the unit of length of the file and its meshes [m]."""

    folder: Path
    store: MeshStore
    unit: float
    faults: ImportFaults
    meshes: dict[str, str | None] = field(default_factory=dict)
    there: dict[tuple[Parameter, ...], list[Position]] = field(default_factory=dict)

    def parameters(
        self, values: Mapping[str, Value], place: Placement, position: Position
    ) -> tuple[Parameter, ...]:
        """The parameters of a part in a frame, with its mesh fetched and lengths in metres. Two
        shapes, and an unknown mesh, are noted as faults."""
        shapes = [name for name in PAG.SHAPES if name in values]
        if len(shapes) > 1:
            message = f"a part has one shape, but '{shapes[0]}' and '{shapes[1]}' are given"
            self.faults.add("BadValue", message, position, f"keep one of {', '.join(PAG.SHAPES)}")
        metres = self.metres(values)
        if "mesh" in values:
            path = self._mesh(str(values["mesh"]), position)
            metres |= {"mesh": path or ""}
            if self.unit != 1:
                metres.setdefault("scale", self.unit)
        placed = shapes or "pos" in values or "quat" in values
        stands = place.parameters(metres) if placed else []
        first = [Parameter(name, metres.pop(name)) for name in shapes]
        rest = [Parameter(name, metres[name]) for name in metres if name not in ("pos", "quat")]
        if self.meshes.get(str(values.get("mesh"))):
            self.there.setdefault((*first, *stands), []).append(position)
        return (*first, *stands, *rest)

    def check_places(self) -> None:
        """Note each mesh that is in the place of an equal one (UsedTwice)."""
        for (mesh, *_), positions in self.there.items():
            name = quoted(str(mesh.value).partition("/")[2])
            self.faults.check_used_once(f"the mesh {name}", positions)

    def metres(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """These parameters with lengths in metres."""
        converted = dict(values)
        for name in LENGTHS:
            value = values.get(name)
            if self.unit != 1 and isinstance(value, tuple):
                converted[name] = tuple(x * self.unit for x in value)
            elif self.unit != 1 and isinstance(value, float):
                converted[name] = value * self.unit
        return converted

    def _mesh(self, name: str, position: Position) -> str | None:
        """The path of a mesh in the output; None if it cannot be used, which is noted for each
        position that names it (BadPath, UnknownMesh, BadMesh)."""
        if self.meshes.get(name) is None:
            self.meshes[name] = self._fetch(name, position)
        return self.meshes[name]

    def _fetch(self, name: str, position: Position) -> str | None:
        inside = path_inside(name)
        if inside is None:
            message = f"{quoted(name)} is outside the folder of the meshes"
            hint = "put the mesh in that folder, or name another by --meshes DIR"
            self.faults.add("BadPath", message, position, hint)
            return None
        named = inside.suffix.lower() in PAG.MESHES
        suffixes = ([""] if named else []) + list(PAG.MESHES)
        path = first_file(self.folder / f"{inside}{suffix}" for suffix in suffixes)
        if path is None:
            message = f"there is no mesh {quoted(name)} in {quoted(str(self.folder))}"
            wanted = str(inside) if named else f"{inside}{PAG.MESHES[1]}"
            hint = near_file(str(self.folder), wanted) or "--meshes DIR names another folder"
            self.faults.add("UnknownMesh", message, position, hint)
            return None
        content = read_bytes(path, MESH)
        try:
            read_mesh(content, path.suffix.lower())
        except UnreadableMesh as error:
            self.faults.add("BadMesh", f"cannot read {quoted(name)}: {error}", position, ANEW)
            return None
        return self.store.add(str(inside.with_suffix("")), path.suffix.lower(), content)
