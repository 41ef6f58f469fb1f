"""Bodies as a file has them: triangles in place, name, colour; and the unit of their lengths."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.geometry.mesh_reader import MeshFile
from factory.geometry.meshes import Array
from factory.geometry.pieces import components
from factory.lang.words import UNITS as LENGTHS
from factory.support.errors import Diagnostic

UNITS = {**LENGTHS, "ldu": 0.0004}
"""Units of length [m]; `ldu` is that of LDraw."""

LONGEST = 5.0
"""A product is taken to be no longer than this [m], where a file does not say its unit."""


@dataclass(frozen=True, slots=True)
class FileBody:
    """A part of a file: its triangles where they are in the product, in the file's unit. `name` is
    "" where the file has none; `colour` None likewise."""

    name: str
    mesh: MeshFile = field(repr=False)
    colour: tuple[float, ...] | None = None

    @property
    def size(self) -> float:
        """The diagonal of its bounding box."""
        low, high = box_of(self)
        return float(np.linalg.norm(high - low))


@dataclass(frozen=True, slots=True)
class Bodies:
    """The bodies of a source. `unit` is the one that it states, "" for none; `by` says which rule
    states it."""

    found: tuple[FileBody, ...]
    unit: str = ""
    by: str = ""
    notes: tuple[str, ...] = ()
    warnings: tuple[Diagnostic, ...] = ()


def box_of(body: FileBody) -> tuple[Array, Array]:
    """The bounding box of a body: low (3,), high (3,)."""
    used = np.concatenate([vertices[np.unique(faces)] for vertices, faces in body.mesh.bodies])
    return used.min(axis=0), used.max(axis=0)


def unit_of(bodies: Bodies, asked: str | None) -> tuple[float, str]:
    """The unit of lengths [m], and in words how it is known: asked for, stated by the file, or
    guessed: metres, or millimetres where metres make a product longer than LONGEST."""
    low, high = zip(*map(box_of, bodies.found), strict=True)
    length = float(np.ptp(np.concatenate([low, high]), axis=0).max())
    if asked:
        return UNITS[asked], f"lengths are in {asked}, as asked for: {_long(length, asked)}"
    if bodies.unit and length * UNITS[bodies.unit] <= LONGEST:
        return UNITS[bodies.unit], f"lengths are in {bodies.unit}: {bodies.by}"
    unit = "m" if length <= LONGEST else "mm"
    why = (
        f"{bodies.by}, but that would be a product of {length * UNITS[bodies.unit]:.4g} m"
        if bodies.unit
        else "the files state no unit"
    )
    return UNITS[unit], f"lengths are taken as {unit}: {why}; {_long(length, unit)} (--unit)"


def _long(length: float, unit: str) -> str:
    return f"the product is {length * UNITS[unit]:.4g} m long"


def apart(body: FileBody) -> tuple[FileBody, ...]:
    """The connected components of a body, each as one; the body itself where it is one."""
    vertices, faces = body.mesh.merged()
    number = components(len(vertices), faces)
    if number.max() == 0:
        return (body,)
    found = []
    for index in range(int(number.max()) + 1):
        used, corners = np.unique(faces[number == index], return_inverse=True)
        mesh = MeshFile(((vertices[used], corners.reshape(-1, 3)),))
        found.append(FileBody(f"{body.name}-{index + 1}", mesh, body.colour))
    return tuple(found)
