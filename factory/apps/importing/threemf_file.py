"""3MF files as bodies: a ZIP archive of XML, parsed as a stream.

The size of the unpacked archive and the numbers of placed objects and triangles are bounded before
memory is allocated: each object may place others twice, forty deep.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from array import array
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from factory.support.files import MESH, MIB
from factory.support.meshes.glb_reader import MOST, GlbBody
from factory.support.meshes.mesh_file import EXPECTED, UnreadableMesh
from factory.support.meshes.triangles import moved_by

UNITS = {
    "micron": 1e-6,
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}
"""The units that a 3MF file may state [m]."""

PLACES = 100_000
"""The most placed objects, nested ones included."""

NESTED = 100
"""The greatest nesting depth of objects."""

ROOT = "3d/3dmodel.model"

ZIP_FAULTS = (
    *(zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError),
    *(NotImplementedError, OverflowError, RuntimeError, ValueError),
)
"""Exceptions of zipfile for an archive that is invalid, damaged, or encrypted."""

Matrix = NDArray[np.float64]
Key = tuple[str, str]
"""The file of an object in the archive, in lower case, and the object's id in it."""


@dataclass(frozen=True, slots=True)
class _Placed:
    """An object placed in another one, or on the plate; `name` "" for that of the object."""

    key: Key
    matrix: Matrix
    name: str = ""


@dataclass(slots=True)
class _Object:
    """An object: its mesh, or the objects that it places."""

    name: str
    vertices: array[float] = field(default_factory=lambda: array("d"))
    corners: array[int] = field(default_factory=lambda: array("q"))
    places: list[_Placed] = field(default_factory=list)


def read_3mf(content: bytes) -> tuple[list[GlbBody], str]:
    """The meshes on the plate of a 3MF file, one body each, in the file's unit; and that unit.
    Raises UnreadableMesh."""
    files = _files(content)
    root = next((name for name in files if name.endswith(ROOT)), None)
    if root is None:
        raise _broken("it has no 3D/3dmodel.model")
    objects: dict[Key, _Object] = {}
    first = _Model(root, objects)
    first.read(files[root])
    left = {place.key[0] for entry in objects.values() for place in entry.places} - {root}
    for name in sorted(left & files.keys()):
        _Model(name, objects).read(files[name])
    return _bodies(first.plate, objects), first.unit


def _broken(why: str = "") -> UnreadableMesh:
    return UnreadableMesh(f"it is not {EXPECTED['.3mf']}" + (f": {why}" if why else ""))


def _files(content: bytes) -> dict[str, bytes]:
    """The models in an archive, by lower-case names."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            models = [i for i in archive.infolist() if i.filename.lower().endswith(".model")]
            if sum(info.file_size for info in models) > MESH:
                raise UnreadableMesh(f"it unpacks to more than {MESH // MIB} MiB, the limit")
            return {i.filename.lower().strip("/"): archive.read(i) for i in models}
    except ZIP_FAULTS:
        raise _broken() from None


class _Model:
    """Reads one model: the handlers of an XML parser."""

    def __init__(self, file: str, objects: dict[Key, _Object]) -> None:
        self.file, self.objects, self.unit = file, objects, "millimeter"
        self.plate: list[_Placed] = []
        self.open: _Object | None = None

    def read(self, text: bytes) -> None:
        """Read the objects, and the items on the plate."""
        parser = expat.ParserCreate()
        parser.StartElementHandler = self._start
        parser.StartDoctypeDeclHandler = self._doctype
        try:
            parser.Parse(text, True)
        except expat.ExpatError as error:
            raise _broken(f"line {error.lineno} of {self.file} is not XML") from None
        except (LookupError, ValueError):
            raise _broken(f"{self.file} has an encoding that is not read: write UTF-8") from None

    def _doctype(self, *_: object) -> None:
        raise _broken("a document type declaration is not accepted")

    def _start(self, tag: str, attributes: Mapping[str, str]) -> None:
        tag = tag.rpartition(":")[2]
        if tag == "vertex" and self.open is not None:
            self.open.vertices.extend(_floats([attributes.get(k, "") for k in "xyz"]))
        elif tag == "triangle" and self.open is not None:
            self.open.corners.extend(_indices([attributes.get(k, "") for k in ("v1", "v2", "v3")]))
        elif tag == "object":
            self.open = _Object(attributes.get("name", ""))
            self.objects[self.file, attributes.get("id", "")] = self.open
        elif tag == "component" and self.open is not None:
            self.open.places.append(self._placed(attributes))
        elif tag == "item":
            self.plate.append(self._placed(attributes))
        elif tag == "model":
            self.unit = attributes.get("unit", self.unit)

    def _placed(self, attributes: Mapping[str, str]) -> _Placed:
        path = next((v for k, v in attributes.items() if k.rpartition(":")[2] == "path"), self.file)
        matrix = np.eye(4)
        if "transform" in attributes:
            rows = np.array(_floats(attributes["transform"].split()))
            if rows.size != 12:
                raise _broken("a transform is not 12 numbers")
            matrix[:3] = rows.reshape(4, 3).T
        key = path.lower().strip("/"), attributes.get("objectid", "")
        return _Placed(key, matrix, attributes.get("partnumber", ""))


def _floats(words: list[str]) -> list[float]:
    try:
        return [float(word) for word in words]
    except ValueError:
        raise _broken("a coordinate is not a number") from None


def _indices(words: list[str]) -> list[int]:
    if all(word.isascii() and word.isdigit() and len(word) < 10 for word in words):
        return [int(word) for word in words]
    raise _broken("a triangle refers to a vertex by something other than a number")


@np.errstate(all="ignore")
def _bodies(plate: list[_Placed], objects: Mapping[Key, _Object]) -> list[GlbBody]:
    """A body for each mesh that is placed on the plate, in the order of the file."""
    stack = [(place, np.eye(4), 1) for place in reversed(plate)]
    bodies, seen, triangles = [], 0, 0
    while stack:
        place, above, depth = stack.pop()
        entry, seen = objects.get(place.key), seen + 1
        if entry is None:
            continue
        if depth > NESTED or seen + len(stack) > PLACES:
            raise UnreadableMesh(
                f"it places more than {PLACES} objects, or places them {NESTED} deep"
            )
        matrix = above @ place.matrix
        stack += [(below, matrix, depth + 1) for below in reversed(entry.places)]
        triangles += len(entry.corners) // 3
        if triangles > MOST:
            raise UnreadableMesh(f"its objects have more than {MOST} triangles together")
        if entry.corners:
            vertices = np.array(entry.vertices).reshape(-1, 3)
            faces = np.array(entry.corners, np.int64).reshape(-1, 3)
            body = moved_by(matrix, vertices, faces)
            bodies.append(GlbBody((place.name, entry.name), (body,), (None,)))
    return bodies
