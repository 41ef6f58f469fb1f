"""The geometry of a product: a solid for each part, in the frame of the finished product.

Shapes written in the PAG are taken as they are; meshes are read from their files, and repaired if
they nearly bound a volume; parts without geometry get a box in a cubic lattice of at most 0.2 m. A
mesh that the engine cannot use, or that remains open, is replaced by its convex hull or its box,
with a warning that names it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from types import MappingProxyType

import numpy as np

from factory.floor.geometry.decomposition import in_pieces
from factory.floor.geometry.limits import (
    FURTHEST,
    METRES,
    SMALLEST,
    beyond,
    size_warnings,
    too_far,
    value_position,
)
from factory.floor.geometry.meshes import (
    SHEETS,
    MassProperties,
    Mesh,
    Remark,
    measured,
    mend_remark,
    usable,
)
from factory.floor.geometry.overlap import MODULES
from factory.floor.geometry.overlapping import stood_in
from factory.floor.geometry.solids import Product, Solid, from_mesh, primitive
from factory.support.arrays import Array, Indices
from factory.support.cache import digest, load_arrays, packed, program, store_arrays, unpacked
from factory.support.errors import Diagnostic, InputError
from factory.support.files import MESH, read_bytes
from factory.support.interruption import side_by_side
from factory.support.meshes.mending import mended
from factory.support.meshes.mesh_file import ANEW, MeshFile, UnreadableMesh
from factory.support.meshes.mesh_reader import read_mesh
from factory.support.meshes.triangles import areas_of
from factory.theory.problem.pag import PAG, SHAPES, Assembly


@dataclass(frozen=True, slots=True)
class Work:
    """The work `to_do` for a mesh whose file is read. `sizes`: invariants of its shape (numbers of
    vertices and faces, logarithm of its area); None if the result is known."""

    to_do: Callable[[], MassProperties | Diagnostic]
    sizes: tuple[float, ...] | None = None


FOLDER = "meshes"
"""The folder of measured meshes in the user's cache."""

PACKAGES = ("trimesh", "numpy", "scipy", "manifold3d", "coacd")
"""Packages that read, measure and decompose meshes."""

LATTICE = 0.2
"""Longest edge of the lattice of parts with no geometry [m]."""

CELL = 0.06
"""Largest cell of that lattice [m]."""


@np.errstate(all="ignore")
def product_geometry(
    pag: PAG,
    files: Mapping[str, bytes] = MappingProxyType({}),
    decomposed: bool = True,
    report: Callable[[int, int], None] = lambda *_: None,
    entered: frozenset[str] | None = None,
) -> Product:
    """The solids of all parts.

    Args:
        pag: the product.
        files: contents of meshes by path, which are looked up before the folder of the PAG.
        decomposed: whether meshes that are not convex are taken apart; else they have their hulls
            for bodies.
        report: called with the number of meshes that are read, and of how many.
        entered: the parts in which others stand, where that is known of another attitude.

    Raises InputError if a mesh cannot be read (BadMesh), or a part is too large, too far away or
    too heavy for the engine (BadValue).
    """
    reader = _Reader(Path(pag.folder), files, decomposed, report)
    leaves = [node for node in pag.postorder() if not node.inputs]
    plain = [node for node in leaves if not _has_shape(node)]
    reader.read([node for node in leaves if node.parameter("mesh") is not None])
    shaped = {n.label: reader.solid(n, i) for i, n in enumerate(leaves) if _has_shape(n)}
    solids = {label: solid for label, solid in shaped.items() if solid is not None}
    if entered is None:
        entered = stood_in([*solids.values()]) if decomposed else frozenset()
    if entered:
        bored = {_file(node) for node in leaves if node.label in entered}
        again = [(n, i) for i, n in enumerate(leaves) if n.label in solids and _file(n) in bored]
        reader.read([node for node, _ in again], entered=True)
        solids |= {n.label: solid for n, i in again if (solid := reader.solid(n, i)) is not None}
    lift = max((float(solid.high[2]) for solid in solids.values()), default=0.0)
    cells = _cells(pag, {node.label for node in plain})
    lattice = _lattice(1 + max(cells.values(), default=-1))
    for number, node in enumerate(plain):
        solids[node.label] = _box_in_lattice(node, number, cells[node.label], lattice, lift)
    faults = [beyond(node, solids[node.label]) for node in leaves if node.label in solids]
    if reader.errors or any(faults):
        raise InputError([*reader.errors, *(fault for fault in faults if fault)])
    low = np.min([s.low for s in solids.values()], axis=0)
    high = np.max([s.high for s in solids.values()], axis=0)
    warnings = (*reader.warnings.values(), *size_warnings(pag, low, high))
    return Product(solids, low, high, warnings, entered=entered)


def _has_shape(node: Assembly) -> bool:
    return any(p.name in SHAPES for p in node.parameters)


def _cells(pag: PAG, plain: Collection[str]) -> dict[str, int]:
    """The cell of each part without a shape, by its label: in each product they are side by side,
    in the order of its tree, as far as they are in no other product before."""
    cells: dict[str, int] = {}
    for product in pag.products:
        parts = [n.label for n in pag.product(product).postorder() if n.label in plain]
        taken = {cells[label] for label in parts if label in cells}
        free = (cell for cell in count() if cell not in taken)
        cells |= {label: next(free) for label in parts if label not in cells}
    return cells


def _lattice(number: int) -> tuple[int, float]:
    """Cells along an edge, and the edge of a cell [m], for a number of parts."""
    edge = 1
    while edge**3 < number:
        edge += 1
    return edge, min(CELL, LATTICE / edge)


def _box_in_lattice(
    node: Assembly, number: int, index: int, lattice: tuple[int, float], lift: float
) -> Solid:
    """A box in the cell `index` of a path that winds through the lattice, so that neighbours on the
    path are neighbours in space; `number` chooses its colour."""
    edge, cell = lattice
    layer, rest = divmod(index, edge * edge)
    row, column = divmod(rest, edge)
    if layer % 2:
        row = edge - 1 - row
    if (row + layer) % 2:
        column = edge - 1 - column
    middle = (edge - 1) / 2
    place = ((column - middle) * cell, (row - middle) * cell, (layer + 0.5) * cell + lift)
    at = np.array(node.parameter("pos", place), float)
    return primitive(node, "box", np.full(3, 0.49 * cell), at, np.array([1.0, 0, 0, 0]), number)


class _Reader:
    """Reads shapes, and collects errors, and warnings by file. A mesh file is read once."""

    def __init__(
        self,
        folder: Path,
        files: Mapping[str, bytes],
        decomposed: bool,
        report: Callable[[int, int], None],
    ) -> None:
        self.folder, self.files, self.decomposed, self.report = folder, files, decomposed, report
        self._read: dict[tuple[str, str], MeshFile] = {}
        self.errors: list[Diagnostic] = []
        self.warnings: dict[tuple[str, str], Diagnostic] = {}
        self._meshes: dict[tuple[str, float], MassProperties | Diagnostic] = {}
        self._numbers: dict[tuple[str, float], int] = {}

    def read(self, nodes: list[Assembly], entered: bool = False) -> None:
        """Read the meshes of these parts; repair, decompose and measure them in parallel.
        `entered`: other parts stand in them."""
        first: dict[tuple[str, float], Assembly] = {}
        for node in nodes:
            first.setdefault(_file(node), node)
        opened = {file: self._opened(node, entered) for file, node in first.items()}
        works = dict(opened.values())
        prepared: dict[str, MassProperties | Diagnostic] = {}
        before = 0
        for keys in _rounds(works):
            tell = partial(self._tell, before, len(works))
            done = side_by_side([works[key].to_do for key in keys], tell)
            prepared.update(zip(keys, done, strict=True))
            before += len(keys)
        for file, (key, _) in opened.items():
            number = self._numbers.setdefault(file, len(self._numbers))
            self._meshes[file] = _named(prepared[key], f"m{number}")

    def _tell(self, before: int, total: int, done: int, _: int) -> None:
        self.report(before + done, total)

    def solid(self, node: Assembly, number: int) -> Solid | None:
        """The solid of a part; None after an error."""
        place = np.array(node.parameter("pos", (0.0, 0.0, 0.0)), float)
        quaternion = np.array(node.parameter("quat", (1.0, 0.0, 0.0, 0.0)), float)
        quaternion /= np.abs(quaternion).max()
        quaternion /= np.linalg.norm(quaternion)
        kind = next(name for name in SHAPES if node.parameter(name) is not None)
        if kind == "mesh":
            prepared = self._mesh(node)
            return (
                None if prepared is None else from_mesh(node, prepared, place, quaternion, number)
            )
        size = _half(kind, np.atleast_1d(np.array(node.parameter(kind), float)))
        if SMALLEST <= size.min() <= size.max() <= FURTHEST:
            return primitive(node, kind, size, place, quaternion, number)
        message = f"the {kind} of '{node.label}' is out of range"
        hint = f"from {2 * SMALLEST:g} to {FURTHEST:g} m; {METRES}"
        self.errors.append(Diagnostic("BadValue", message, value_position(node, kind), hint))
        return None

    def _mesh(self, node: Assembly) -> MassProperties | None:
        """The usable mesh of a part; None after an error."""
        prepared, position = self._meshes[_file(node)], value_position(node, "mesh")
        if isinstance(prepared, Diagnostic):
            if prepared not in self.errors:
                self.errors.append(prepared)
            return None
        if prepared.remark:
            path, remark = _file(node)[0], prepared.remark
            warning = Diagnostic(
                "BadMesh", f"{path} {remark.text}", position, remark.hint, remark.many
            )
            self.warnings.setdefault((path, remark.text), warning)
        return prepared

    def _content(self, path: str) -> bytes:
        content = self.files.get(path)
        return read_bytes(self.folder / path, MESH) if content is None else content

    def _opened(self, node: Assembly, entered: bool) -> tuple[str, Work]:
        """The cache key of a part's mesh, and the work that is left after its file is read: files
        with equal content are measured once."""
        path, scale = _file(node)
        try:
            content, suffix = self._content(path), Path(path).suffix.lower()
            code = program(MODULES, *PACKAGES)
            key = digest(content, suffix, scale, entered, self.decomposed, code)
            kept = _kept(key)
            if kept is not None:
                return key, Work(lambda: kept)
            if (path, suffix) not in self._read:
                self._read[path, suffix] = read_mesh(content, suffix)
            file = self._read[path, suffix]
        except (OSError, UnreadableMesh) as error:
            why = error.strerror if isinstance(error, OSError) else error
            message, position = f"cannot read '{path}': {why}", value_position(node, "mesh")
            fault = Diagnostic("BadMesh", message, position, ANEW)
            return f"{path} {scale}", Work(lambda: fault)
        vertices, faces = file.merged()
        if not np.abs(vertices).max() * scale <= FURTHEST:
            return f"{path} {scale}", Work(partial(too_far, node, "scale", "mesh"))
        to_do = partial(_finished, key, vertices * scale, faces, entered, self.decomposed)
        area = float(areas_of(vertices * scale, faces).sum())
        return key, Work(to_do, (len(vertices), len(faces), round(float(np.log(area)), 3)))


def _rounds(works: Mapping[str, Work]) -> Iterator[list[str]]:
    """The keys of works in rounds, the first of each shape (as far as sizes tell) before the
    others, so that its result is reused for them, whichever thread is faster."""
    left = list(works)
    while left:
        shapes = {works[key].sizes or key: key for key in reversed(left)}
        first = set(shapes.values())
        yield [key for key in left if key in first]
        left = [key for key in left if key not in first]


def _named(prepared: MassProperties | Diagnostic, name: str) -> MassProperties | Diagnostic:
    if isinstance(prepared, Diagnostic):
        return prepared
    return replace(prepared, mesh=replace(prepared.mesh, name=name))


def _file(node: Assembly) -> tuple[str, float]:
    """The file of a part's mesh, and its scale."""
    return str(node.parameter("mesh")), float(node.parameter("scale", 1.0))  # type: ignore[arg-type]


@np.errstate(all="ignore")
def _finished(
    key: str, vertices: Array, faces: Indices, entered: bool, decomposed: bool
) -> MassProperties:
    """The mesh of a file, with vertices merged, as the engine can use it if it is `decomposed`, in
    which other parts stand if it is `entered`; it is cached under a key. Its name is "" here: a
    product names its meshes itself."""
    mesh, remark = usable("", vertices, faces)
    if remark is None:
        vertices, faces, was = mended(mesh.vertices, mesh.faces)
        remark = mend_remark(was) if was else None
        mesh = in_pieces(Mesh(mesh.name, vertices, faces), entered, decomposed)
        remark = SHEETS if len(mesh.faces) < len(faces) else remark
    prepared = measured(mesh, remark)
    _keep(key, prepared)
    return prepared


def _keep(key: str, prepared: MassProperties) -> None:
    remark, mesh = prepared.remark, prepared.mesh
    arrays = {
        "vertices": mesh.vertices,
        "faces": mesh.faces,
        "remark": np.array([remark.text, remark.many, remark.hint] if remark else [], str),
        "volume": np.array(prepared.volume),
        "centre": prepared.centre,
        "inertia": prepared.inertia,
        "hull": prepared.hull,
        **packed(mesh.pieces),
    }
    store_arrays(FOLDER, key, arrays)


def _kept(key: str) -> MassProperties | None:
    """The cached result of `_finished`; None if there is none."""
    kept = load_arrays(FOLDER, key)
    if kept is None:
        return None
    remark = Remark(*map(str, kept["remark"])) if len(kept["remark"]) else None
    mesh = Mesh("", kept["vertices"], kept["faces"], unpacked(kept))
    volume, centre, inertia = float(kept["volume"]), kept["centre"], kept["inertia"]
    return MassProperties(mesh, remark, volume, centre, inertia, kept["hull"])


def _half(kind: str, lengths: Array) -> Array:
    """Half lengths, as MJCF has them, of the full lengths in the PAG."""
    if kind == "cylinder":
        return np.array([lengths[0], lengths[1] / 2])
    return lengths / 2 if kind == "box" else lengths
