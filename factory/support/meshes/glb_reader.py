"""GLB files (binary glTF 2.0) as triangles, with names, places and colours.

Every count and offset is checked against the size of the file, and against MOST, before memory is
allocated: a file of a kilobyte may declare gigabytes.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array, Indices
from factory.support.meshes.mesh_file import EXPECTED, UnreadableMesh
from factory.support.meshes.triangles import moved_by
from factory.support.rotations import rotation

__all__ = ["MOST", "UPRIGHT", "Colour", "GlbBody", "read_glb"]

MOST = 10_000_000
"""The most numbers of an accessor, and the most triangles of all placed bodies."""

TEXT = 32 << 20
"""The largest JSON chunk [bytes]."""

NESTED = 500
"""The greatest nesting depth of nodes."""

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Number types by `componentType`."""

WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
"""Numbers per element."""

TRIANGLES, STRIP, FAN = 4, 5, 6
"""The modes of primitives that have triangles."""

Object = dict[str, Any]
Matrix = NDArray[np.float64]

UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From y upwards, as in glTF by its standard (section 3.4), to z upwards."""


Colour = tuple[float, ...] | None
"""Red, green, blue and opacity, from 0 to 1; None where a file states none."""
Triangles = tuple[Array, Indices]
"""Vertices (n, 3) and faces (m, 3)."""


@dataclass(frozen=True, slots=True)
class GlbBody:
    """A mesh at a node: the names of node and mesh, "" for none; its primitives in place, in the
    file's unit, and the colour of each in sRGB, None for none."""

    names: tuple[str, str]
    bodies: tuple[Triangles, ...] = field(repr=False)
    colours: tuple[Colour, ...] = ()


@np.errstate(all="ignore")
def read_glb(content: bytes, upright: Matrix = UPRIGHT) -> list[GlbBody]:
    """The bodies of a GLB file, one per node that has triangles, in the order of the scene, turned
    `upright` (4, 4): y is up in the file, and z in what is returned. Raises UnreadableMesh."""
    glb = _Glb(*_chunks(content))
    bodies, total = [], 0
    for node, matrix in glb.nodes():
        shape = glb.shape(node["mesh"])
        total += sum(len(faces) for _, faces in shape.bodies)
        if total > MOST:
            raise _broken(f"its nodes have more than {MOST} triangles together")
        if shape.bodies:
            placed = tuple(moved_by(upright @ matrix, *body) for body in shape.bodies)
            bodies.append(GlbBody((_name(node), shape.names[1]), placed, shape.colours))
    return bodies


def gamma_encoded(light: float) -> float:
    """A linear component of a colour in sRGB (IEC 61966-2-1); colours of glTF are linear (section
    3.9.2)."""
    return float(12.92 * light if light <= 0.0031308 else 1.055 * light ** (1 / 2.4) - 0.055)


def _chunks(content: bytes) -> tuple[Object, bytes]:
    """The JSON document and the binary chunk of a file."""
    if content[:4] != b"glTF" or len(content) < 20:
        raise _broken()
    if struct.unpack_from("<I", content, 4)[0] != 2:
        raise _broken("its version is not 2")
    parts: dict[bytes, bytes] = {}
    at = 12
    while at + 8 <= len(content):
        size, kind = struct.unpack_from("<I4s", content, at)
        if at + 8 + size > len(content):
            raise _broken(f"{at + 8 + size} bytes are declared, {len(content)} are there")
        parts.setdefault(kind, content[at + 8 : at + 8 + size])
        at += 8 + size
    text = parts.get(b"JSON", b"")
    if len(text) > TEXT:
        raise _broken(f"its JSON is larger than {TEXT >> 20} MiB, the most that is read")
    try:
        document = json.loads(text)
    except (ValueError, RecursionError):
        raise _broken("its first chunk is not JSON") from None
    if not isinstance(document, dict):
        raise _broken("its JSON is not an object")
    return document, parts.get(b"BIN\0", b"")


def _broken(why: str = "") -> UnreadableMesh:
    return UnreadableMesh(f"it is not {EXPECTED['.glb']}" + (f": {why}" if why else ""))


def _name(entry: Object) -> str:
    name = entry.get("name")
    return name if isinstance(name, str) else ""


def _kind(entry: Object) -> str | None:
    """The number type of an accessor; None where it names none."""
    number = entry.get("componentType")
    return TYPES.get(number) if isinstance(number, int) else None


def _whole(value: object, what: str, most: int = MOST) -> int:
    """A whole number from 0."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise _broken(f"{what} is not a whole number from 0 to {most}")
    return value


def _numbers(value: object, count: int, what: str) -> Array:
    """A given number of finite numbers."""
    good = isinstance(value, list) and len(value) == count
    if good and all(isinstance(x, int | float) and abs(x) < 1e30 for x in value):  # type: ignore[attr-defined]
        return np.array(value, float)
    raise _broken(f"{what} is not {count} numbers")


PACKED = {"KHR_draco_mesh_compression": "Draco", "EXT_meshopt_compression": "meshopt"}
"""What extensions are called that compress triangles."""


class _Glb:
    """A document, its binary chunk, and the meshes that were read."""

    def __init__(self, document: Object, arrays: bytes) -> None:
        self.document, self.arrays = document, arrays
        self._shapes: dict[int, GlbBody] = {}
        needed = self.document.get("extensionsRequired")
        for name in needed if isinstance(needed, list) else ():
            if "compression" in str(name):
                how = PACKED.get(str(name), str(name)[:40])
                remedy = "export it without compression, or as .stl, .step or .3mf"
                raise UnreadableMesh(f"its triangles are compressed ({how}): {remedy}")

    def entry(self, kind: str, number: object) -> Object:
        """An element of one of the document's lists, such as nodes, meshes or accessors."""
        every = self.document.get(kind)
        many = len(every) if isinstance(every, list) else 0
        if type(number) is not int or not 0 <= number < many:
            raise _broken(f"it names one of its {kind} that does not exist")
        entry = every[number]  # type: ignore[index]
        if not isinstance(entry, dict):
            raise _broken(f"one of its {kind} is not an object")
        return entry

    def listed(self, entry: Object, key: str) -> list[Any]:
        """A list in an entry; empty if it is missing."""
        values = entry.get(key, [])
        if not isinstance(values, list):
            raise _broken(f"'{key}' is not a list")
        return values

    def nodes(self) -> Iterator[tuple[Object, Matrix]]:
        """The nodes with a mesh, parents first, and their placements (4, 4)."""
        stack = [(number, np.eye(4), 1) for number in reversed(self._roots())]
        seen: set[int] = set()
        while stack:
            number, above, depth = stack.pop()
            node = self.entry("nodes", number)
            if number in seen:
                raise _broken("one of its nodes is below two others, or below itself")
            if depth > NESTED:
                raise _broken(f"its nodes are nested more than {NESTED} deep")
            seen.add(number)
            matrix = above @ _placed(node)
            if "mesh" in node:
                yield node, matrix
            below = self.listed(node, "children")
            stack += [(child, matrix, depth + 1) for child in reversed(below)]

    def _roots(self) -> list[Any]:
        """The root nodes of the default scene; without scenes, the nodes that are no children."""
        if self.document.get("scenes"):
            scene = self.entry("scenes", self.document.get("scene", 0))
            return self.listed(scene, "nodes")
        every = self.listed(self.document, "nodes")
        below = {
            child
            for number in range(len(every))
            for child in self.listed(self.entry("nodes", number), "children")
            if isinstance(child, int)
        }
        return [number for number in range(len(every)) if number not in below]

    def shape(self, number: object) -> GlbBody:
        """A mesh in its own frame, at no node, with its primitives that have triangles; read
        once."""
        mesh = self.entry("meshes", number)
        if number not in self._shapes:
            self._shapes[number] = self._read(mesh)  # type: ignore[index]
        return self._shapes[number]  # type: ignore[index]

    def _read(self, mesh: Object) -> GlbBody:
        primitives = []
        for primitive in self.listed(mesh, "primitives"):
            if not isinstance(primitive, dict):
                raise _broken("one of its primitives is not an object")
            body = self._triangles(primitive)
            if len(body[1]):
                primitives.append((body, self._colour(primitive)))
        bodies, colours = tuple(b for b, _ in primitives), tuple(c for _, c in primitives)
        return GlbBody(("", _name(mesh)), bodies, colours)

    def _triangles(self, primitive: Object) -> Triangles:
        mode, attributes = primitive.get("mode", TRIANGLES), primitive.get("attributes")
        where = attributes.get("POSITION") if isinstance(attributes, dict) else None
        if mode not in (TRIANGLES, STRIP, FAN) or where is None:
            return np.zeros((0, 3)), np.zeros((0, 3), np.int64)
        vertices = self.accessor(where, 3).astype(float)
        if "indices" in primitive:
            order = self.accessor(primitive["indices"], 1).ravel()
            if order.dtype.kind != "u":
                raise _broken("its indices are not whole numbers")
            order = order.astype(np.int64)
        else:
            order = np.arange(len(vertices))
        faces = _faces(order, mode)
        if len(faces) and not faces.max() < len(vertices):
            raise _broken("a triangle refers to a vertex that does not exist")
        return vertices, faces

    def _colour(self, primitive: Object) -> Colour:
        """The colour of a primitive's material; None if it states none."""
        if "material" not in primitive:
            return None
        surface = self.entry("materials", primitive["material"]).get("pbrMetallicRoughness")
        if not isinstance(surface, dict) or "baseColorFactor" not in surface:
            return None
        factor = np.clip(_numbers(surface["baseColorFactor"], 4, "a colour"), 0, 1)
        light = [*map(gamma_encoded, factor[:3]), float(factor[3])]
        return tuple(round(x, 3) for x in light)

    def accessor(self, number: object, width: int) -> NDArray[Any]:
        """The numbers (n, width) of an accessor."""
        entry = self.entry("accessors", number)
        kind = _kind(entry)
        if kind is None or WIDTHS.get(str(entry.get("type"))) != width:
            raise _broken("an accessor has a type that it may not have here")
        count = _whole(entry.get("count"), "the count of an accessor", MOST // width)
        if "bufferView" in entry:
            numbers = self._viewed(entry, count, np.dtype(kind), width)
        else:
            numbers = np.zeros((count, width), kind)
        if "sparse" in entry:
            numbers = self._sparse(entry["sparse"], numbers.copy())
        if entry.get("normalized") is True and numbers.dtype.kind in "iu":
            numbers = np.maximum(numbers / float(np.iinfo(numbers.dtype).max), -1.0)
        return numbers

    def _sparse(self, entry: object, numbers: NDArray[Any]) -> NDArray[Any]:
        """An array with some rows replaced."""
        parts = [entry.get(key) for key in ("indices", "values")] if isinstance(entry, dict) else []
        if not all(isinstance(part, dict) for part in parts) or not isinstance(entry, dict):
            raise _broken("a sparse accessor has no indices, or no values")
        count = _whole(entry.get("count"), "the count of a sparse accessor", len(numbers))
        at, values = parts
        kind = _kind(at)  # type: ignore[arg-type]
        if kind is None or "u" not in kind:
            raise _broken("the indices of a sparse accessor are not whole numbers")
        rows = self._viewed(at, count, np.dtype(kind), 1).ravel()  # type: ignore[arg-type]
        if len(rows) and not rows.max() < len(numbers):
            raise _broken("a sparse accessor has a row that does not exist")
        numbers[rows] = self._viewed(values, count, numbers.dtype, numbers.shape[1])  # type: ignore[arg-type]
        return numbers

    def _viewed(self, entry: Object, count: int, kind: np.dtype[Any], width: int) -> NDArray[Any]:
        """Numbers (count, width) from the binary chunk."""
        view = self.entry("bufferViews", entry.get("bufferView"))
        buffer = self.entry("buffers", view.get("buffer"))
        if view.get("buffer") != 0 or "uri" in buffer:
            raise _broken("its arrays are in another file; a GLB file has them itself")
        size = len(self.arrays)
        start = _whole(view.get("byteOffset", 0), "an offset", size)
        end = start + _whole(view.get("byteLength"), "the length of an array", size)
        start += _whole(entry.get("byteOffset", 0), "an offset", size)
        row = kind.itemsize * width
        stride = _whole(view.get("byteStride", row), "a stride", 252) or row
        if not 0 <= start + (stride * (count - 1) + row if count else 0) <= min(end, size):
            raise _broken("an array reaches beyond its bytes")
        strides = (stride, kind.itemsize)
        return np.ndarray((count, width), kind, self.arrays, start if count else 0, strides)


def _placed(node: Object) -> Matrix:
    """The placement (4, 4) of a node in its parent."""
    if "matrix" in node:
        return _numbers(node["matrix"], 16, "a matrix").reshape(4, 4).T
    matrix = np.eye(4)
    if "rotation" in node:
        x, y, z, w = _numbers(node["rotation"], 4, "a rotation")
        length = float(np.linalg.norm((x, y, z, w)))
        if length < 1e-6:
            raise _broken("a rotation is not a unit quaternion")
        matrix[:3, :3] = rotation(np.array([w, x, y, z]) / length)
    if "scale" in node:
        matrix[:3, :3] *= _numbers(node["scale"], 3, "a scale")
    if "translation" in node:
        matrix[:3, 3] = _numbers(node["translation"], 3, "a translation")
    return matrix


def _faces(order: Indices, mode: int) -> Indices:
    """The triangles (m, 3) of a primitive's vertices."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == FAN:
        return np.column_stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]])
    faces = np.column_stack([order[:-2], order[1:-1], order[2:]])
    faces[1::2] = faces[1::2, ::-1]
    return np.asarray(faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)])
