"""The geometry of a product: a solid for each part, in the frame of the finished product.

Shapes written in the PAG are taken as they are; meshes are read with trimesh; parts with no
geometry get a box in a cubic lattice of at most 0.2 m. A mesh that the engine cannot use, or that
is open, falls back to its convex hull or its box, with a warning that names it.
"""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from factory.geometry.decomposition import in_pieces
from factory.geometry.limits import (
    FURTHEST,
    SHAPES,
    SMALLEST,
    beyond,
    size_warnings,
    too_far,
    value_position,
)
from factory.geometry.meshes import (
    LEAST_MASS,
    Array,
    Indices,
    Measured,
    Mesh,
    measured,
    sound,
    usable,
)
from factory.geometry.pieces import box_piece, cylinder_piece, sphere_piece
from factory.problem.pag import PAG, Assembly
from factory.support.errors import Diagnostic, InputError

DENSITY = 1000.0
"""Density of a part that states neither mass nor density [kg/m³]."""

LATTICE = 0.2
"""Longest edge of the lattice of parts with no geometry [m]."""

CELL = 0.06
"""Largest cell of that lattice [m]."""

NAMED = 3
"""So many meshes are named that are open or inside out."""

PALETTE = (
    (0.035, 0.58, 0.88),
    (0.560, 0.55, 0.66),
    (0.110, 0.42, 0.95),
    (0.420, 0.36, 0.68),
    (0.960, 0.42, 0.72),
    (0.600, 0.30, 0.86),
    (0.075, 0.62, 0.62),
    (0.760, 0.26, 0.58),
    (0.240, 0.42, 0.74),
    (0.500, 0.50, 0.56),
)
"""Hue, saturation and value of parts with no colour of their own; later rounds turn the hue."""


@dataclass(frozen=True, slots=True)
class Solid:
    """A part as a solid. Arrays are in the frame of the finished product unless said otherwise.

    `kind` is box, cylinder, sphere or mesh; `size` its half lengths as MJCF writes them [m];
    `position` (3,) and `quaternion` (4,) place it; `mass` [kg], `centre` (3,) of mass, `inertia`
    (3, 3) about it [kg m²]; `low`, `high` (3,) its bounding box; `corners` (n, 3) the vertices of
    its hull; `pieces` the vertices (n, 3) of the convex bodies it is made of, as the engine
    collides them (`factory.geometry.pieces` states how exactly): one for most.
    """

    label: str
    kind: str
    size: tuple[float, ...]
    position: Array
    quaternion: Array
    mass: float
    centre: Array
    inertia: Array
    low: Array
    high: Array
    rgba: tuple[float, ...]
    mesh: Mesh | None = None
    corners: Array = field(default_factory=lambda: np.zeros((0, 3)), repr=False)
    pieces: tuple[Array, ...] = field(default=(), repr=False)


@dataclass(frozen=True)
class Product:
    """The solids of a product's parts by label, its bounding box and what there is to warn
    about."""

    solids: Mapping[str, Solid]
    low: Array
    high: Array
    warnings: tuple[Diagnostic, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "solids", MappingProxyType(dict(self.solids)))

    @property
    def middle(self) -> Array:
        """The centre of the bounding box (3,) [m]."""
        return (self.low + self.high) / 2

    @property
    def mass(self) -> float:
        """[kg]"""
        return float(sum(solid.mass for solid in self.solids.values()))


@np.errstate(all="ignore")
def product_geometry(pag: PAG) -> Product:
    """The solids of all parts. Raises InputError where a mesh cannot be read (BadMesh), or a part
    is too large, too far away or too heavy for any engine (BadValue)."""
    reader = _Reader(Path(pag.folder))
    leaves = [node for node in pag.postorder() if not node.inputs]
    plain = [node for node in leaves if not _has_shape(node)]
    cells = _lattice(len(plain))
    solids: dict[str, Solid] = {}
    for number, node in enumerate(leaves):
        if _has_shape(node):
            solid = reader.solid(node, number)
            if solid is not None:
                solids[node.label] = solid
    base = np.max([s.high[2] for s in solids.values()], initial=-np.inf)
    lift = 0.0 if base == -np.inf else float(base)
    for number, node in enumerate(plain):
        solids[node.label] = _box_in_lattice(node, number, cells, lift)
    faults = [beyond(node, solids[node.label]) for node in leaves if node.label in solids]
    if reader.errors or any(faults):
        raise InputError([*reader.errors, *(fault for fault in faults if fault)])
    low = np.min([s.low for s in solids.values()], axis=0)
    high = np.max([s.high for s in solids.values()], axis=0)
    leaks = _first_few(list(reader.leaks.values()))
    warnings = (*reader.warnings, *leaks, *size_warnings(pag, low, high))
    return Product(solids, low, high, warnings)


def _has_shape(node: Assembly) -> bool:
    return any(p.name in SHAPES for p in node.parameters)


def _lattice(count: int) -> tuple[int, float]:
    """Cells along an edge, and the edge of a cell [m], for `count` parts."""
    edge = 1
    while edge**3 < count:
        edge += 1
    return edge, min(CELL, LATTICE / edge)


def _box_in_lattice(node: Assembly, number: int, cells: tuple[int, float], lift: float) -> Solid:
    """A box in the cell `number` of a path that goes to and fro, so neighbours stay neighbours."""
    edge, cell = cells
    layer, rest = divmod(number, edge * edge)
    row, column = divmod(rest, edge)
    if layer % 2:
        row = edge - 1 - row
    if (row + layer) % 2:
        column = edge - 1 - column
    middle = (edge - 1) / 2
    place = np.array([(column - middle) * cell, (row - middle) * cell, (layer + 0.5) * cell + lift])
    given = node.parameter("pos")
    if given is not None:
        place = np.array(given, float)
    half = np.full(3, 0.49 * cell)
    return _primitive(node, "box", half, place, np.array([1.0, 0, 0, 0]), number)


class _Reader:
    """Reads shapes, collecting errors and warnings, those of meshes that are open or inside out in
    `leaks`, by file; a mesh file is read once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.errors: list[Diagnostic] = []
        self.warnings: list[Diagnostic] = []
        self.leaks: dict[str, Diagnostic] = {}
        self._meshes: dict[tuple[str, float], Measured | None] = {}

    def solid(self, node: Assembly, number: int) -> Solid | None:
        place = np.array(node.parameter("pos", (0.0, 0.0, 0.0)), float)
        quaternion = np.array(node.parameter("quat", (1.0, 0.0, 0.0, 0.0)), float)
        quaternion /= np.abs(quaternion).max()
        quaternion /= np.linalg.norm(quaternion)
        for kind in ("box", "cylinder", "sphere"):
            given = node.parameter(kind)
            if given is not None:
                size = _half(kind, np.atleast_1d(np.array(given, float)))
                if not SMALLEST <= size.min() <= size.max() <= FURTHEST:
                    position = value_position(node, kind)
                    message = f"the {kind} of '{node.label}' is out of range"
                    hint = f"from {2 * SMALLEST:g} to {FURTHEST:g} m; lengths are in metres"
                    self.errors.append(Diagnostic("BadValue", message, position, hint))
                    return None
                return _primitive(node, kind, size, place, quaternion, number)
        return self._mesh_solid(node, place, quaternion, number)

    def _mesh_solid(
        self, node: Assembly, place: Array, quaternion: Array, number: int
    ) -> Solid | None:
        path = str(node.parameter("mesh"))
        scale = float(node.parameter("scale", 1.0))  # type: ignore[arg-type]
        key = (path, scale)
        if key not in self._meshes:
            self._meshes[key] = self._read(node, path, scale)
            self._warn(node, path, self._meshes[key])
        found = self._meshes[key]
        if found is None:
            return None
        return _from_mesh(node, found, place, quaternion, number)

    def _warn(self, node: Assembly, path: str, found: Measured | None) -> None:
        """Takes note of a mesh that is not used as it is."""
        position = value_position(node, "mesh")
        hint = "repair the mesh to have it used as it is"
        if found is not None and found.trouble:
            self.warnings.append(Diagnostic("BadMesh", f"{path} {found.trouble}", position, hint))
        elif found is not None and found.leak:
            leak = Diagnostic("BadMesh", f"{path} {found.leak}", position, hint)
            self.leaks.setdefault(path, leak)

    def _read(self, node: Assembly, path: str, scale: float) -> Measured | None:
        import trimesh

        try:
            loaded = trimesh.load(self.folder / path, force="mesh", process=True)
            vertices, faces = np.asarray(loaded.vertices, float), np.asarray(loaded.faces, np.int64)
            if len(faces) == 0 or not np.isfinite(vertices).all():
                raise ValueError("it has no triangles, or vertices that are not finite")
            vertices = vertices * scale
            if not np.abs(vertices).max() <= FURTHEST:
                self.errors.append(too_far(node, "scale", "mesh"))
                return None
            mesh, trouble = usable(f"m{len(self._meshes)}", vertices, faces)
            if not trouble:
                mesh = in_pieces(mesh, lambda: self._as_written(path, scale))
            return measured(mesh, trouble)
        except Exception as error:  # trimesh's readers raise anything on a broken file
            position = value_position(node, "mesh")
            hint = "export it again as .obj, .stl, .ply or .glb with triangles"
            why = "its content is no mesh" if isinstance(error, ImportError) else str(error)
            self.errors.append(
                Diagnostic("BadMesh", f"cannot read '{path}': {why}", position, hint)
            )
            return None

    def _as_written(self, path: str, scale: float) -> tuple[Array, Indices]:
        """Vertices and faces of a mesh file whose vertices in the same place stay apart."""
        import trimesh

        loaded = trimesh.load(self.folder / path, force="mesh", process=False)
        return np.asarray(loaded.vertices, float) * scale, np.asarray(loaded.faces, np.int64)


def _half(kind: str, given: Array) -> Array:
    """Full lengths as the PAG writes them, to the half lengths of MJCF."""
    if kind == "cylinder":
        return np.array([given[0], given[1] / 2])
    return given / 2 if kind == "box" else given


def _primitive(
    node: Assembly, kind: str, size: Array, place: Array, quaternion: Array, number: int
) -> Solid:
    if kind == "box":
        x, y, z = 2 * size
        volume, diagonal = x * y * z, np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12
    elif kind == "cylinder":
        radius, height = size[0], 2 * size[1]
        side = (3 * radius**2 + height**2) / 12
        volume, diagonal = np.pi * radius**2 * height, np.array([side, side, radius**2 / 2])
    else:
        volume, diagonal = 4 / 3 * np.pi * size[0] ** 3, np.full(3, 0.4 * size[0] ** 2)
    mass = _mass(node, float(volume))
    turn = rotation(quaternion)
    corners = _corners(kind, size) @ turn.T + place
    reach = np.abs(turn) @ size if kind == "box" else _round_reach(kind, size, turn)
    inertia = sound(turn @ np.diag(mass * diagonal) @ turn.T)
    return Solid(
        node.label,
        kind,
        tuple(float(s) for s in size),
        place,
        quaternion,
        mass,
        place,
        inertia,
        place - reach,
        place + reach,
        colour(node, number),
        None,
        corners,
        (_piece(kind, size) @ turn.T + place,),
    )


def _corners(kind: str, size: Array) -> Array:
    """Points on the surface whose displacement tells that of the whole."""
    if kind == "sphere":
        return np.asarray(np.concatenate([np.eye(3), -np.eye(3)]) * size[0])
    return box_piece(np.array([size[0], size[0], size[1]]) if kind == "cylinder" else size)


def _piece(kind: str, size: Array) -> Array:
    """The convex body (n, 3) of a primitive, in its own frame."""
    if kind == "box":
        return box_piece(size)
    if kind == "cylinder":
        return cylinder_piece(float(size[0]), float(size[1]))
    return sphere_piece(float(size[0]))


def _round_reach(kind: str, size: Array, turn: Array) -> Array:
    """Half extents of a sphere, or of a cylinder whose axis is the third column of `turn`."""
    if kind == "sphere":
        return np.full(3, size[0])
    axis = np.abs(turn[:, 2])
    return np.asarray(size[1] * axis + size[0] * np.sqrt(np.maximum(0.0, 1 - axis**2)))


def _from_mesh(
    node: Assembly, found: Measured, place: Array, quaternion: Array, number: int
) -> Solid:
    turn = rotation(quaternion)
    mass = _mass(node, found.volume)
    corners = found.hull @ turn.T + place
    return Solid(
        node.label,
        "mesh",
        (),
        place,
        quaternion,
        mass,
        turn @ found.centre + place,
        sound(turn @ (found.inertia * mass / found.volume) @ turn.T),
        corners.min(axis=0),
        corners.max(axis=0),
        colour(node, number),
        found.mesh,
        corners,
        tuple(piece @ turn.T + place for piece in found.mesh.pieces) or (corners,),
    )


def _mass(node: Assembly, volume: float) -> float:
    mass = node.parameter("mass")
    if mass is None:
        mass = float(node.parameter("density", DENSITY)) * volume  # type: ignore[arg-type]
    return max(float(mass), LEAST_MASS)  # type: ignore[arg-type]


def colour(node: Assembly, number: int) -> tuple[float, ...]:
    """The colour written in the PAG, else one of a sequence in which neighbours differ."""
    given = node.parameter("rgba")
    if isinstance(given, tuple):
        return given
    round_, index = divmod(number, len(PALETTE))
    hue, saturation, value = PALETTE[index]
    red, green, blue = colorsys.hsv_to_rgb((hue + 0.045 * round_) % 1.0, saturation, value)
    return (round(red, 3), round(green, 3), round(blue, 3), 1.0)


def rotation(quaternion: Array) -> Array:
    """The rotation matrix (3, 3) of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _first_few(leaks: list[Diagnostic]) -> list[Diagnostic]:
    """At most NAMED of these warnings, and one for all the others: most meshes of bricks are
    open."""
    if len(leaks) <= NAMED + 1:
        return leaks
    message = f"and {len(leaks) - NAMED} more meshes are open or inside out"
    return [*leaks[:NAMED], replace(leaks[NAMED], message=message)]


__all__ = ["Array", "Mesh", "Product", "Solid", "colour", "product_geometry", "rotation"]
