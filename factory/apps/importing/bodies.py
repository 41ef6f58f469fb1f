"""Bodies of a file: triangles in place, names, colours, and the unit of length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from factory.api import Diagnostic, InputError, Solid
from factory.apps.importing.zipping import zipped
from factory.support.arrays import Array, Indices
from factory.support.decimals import UNITS as LENGTHS
from factory.support.meshes.bodies import bodies as shells
from factory.support.meshes.glb_reader import Colour
from factory.support.meshes.mesh_file import MeshFile
from factory.support.meshes.triangles import areas_of, components, is_closed, submeshes, volume_of
from factory.support.texts import quoted

UNITS = {**LENGTHS, "ldu": 0.0004}
"""Units of length [m]; `ldu` is that of LDraw."""

LIKELY = 2.5
"""The greatest plausible length of a product [m], where the format of the file fixes the unit: not
every program respects it."""

DOUBTFUL, SHEET = (1.0, 30.0), (0.1, 2.0)
"""The range of lengths in which a product may be in metres, centimetres or inches alike. A longer
product may still be in the latter two if the thickness of its median part is within SHEET."""


MOST_PARTS = 5000
"""The most parts of a plan, which has tables of all pairs of parts: for so many they take a
gigabyte."""


@dataclass(frozen=True, slots=True)
class FileBody:
    """A part of a file: its triangles at their place in the product, in the file's unit. `name` is
    "" and `colour` None if the file has none. `colours`: those of the bodies of its mesh; empty if
    unknown."""

    name: str
    mesh: MeshFile = field(repr=False)
    colour: Colour = None
    colours: tuple[Colour, ...] = ()

    @property
    def size(self) -> float:
        """The diagonal of its bounding box."""
        low, high = box_of(self)
        return float(np.linalg.norm(high - low))


@dataclass(frozen=True, slots=True)
class Bodies:
    """The bodies of a source. `unit`: the unit of length that is stated, "" for none; `by`: the
    rule that states it; `sure`: whether this file itself states it."""

    bodies: tuple[FileBody, ...]
    unit: str = ""
    by: str = ""
    sure: bool = False
    notes: tuple[str, ...] = ()


def check_count(path: Path, labels: Sequence[str], what: str = "parts") -> None:
    """Raises InputError if a source has no part or only one (TooFewParts), or more than can be
    planned (TooLarge)."""
    if len(labels) > MOST_PARTS:
        message = f"{quoted(path.name)} has {len(labels)} {what}; at most {MOST_PARTS} are planned"
        raise InputError(Diagnostic("TooLarge", message, None, "plan sub-assemblies of it"))
    if len(labels) > 1:
        return
    if labels:
        message = f"{quoted(path.name)} has one part, '{labels[0]}': there is nothing to assemble"
        hint = "export each part as a mesh of its own, or as a body with a name, where it is"
    else:
        message = f"{quoted(path.name)} has no {what}"
        hint = "a folder of .obj, .stl, .ply, .off, .glb, .3mf or .step files, one part each"
    raise InputError(Diagnostic("TooFewParts", message, None, hint))


def box_of(body: FileBody) -> tuple[Array, Array]:
    """The bounding box of a body: low (3,), high (3,)."""
    used = np.concatenate([vertices[faces.ravel()] for vertices, faces in body.mesh.bodies])
    return used.min(axis=0), used.max(axis=0)


def unit_of(bodies: Bodies, asked: str | None) -> tuple[float, str]:
    """The unit of length [m], and a note on its origin: given by the user, stated by the file, or
    guessed (metres, or millimetres if metres would make the product too long). Raises InputError
    (Unit) if several units are plausible."""
    low, high = (np.array(ends) for ends in zip(*map(box_of, bodies.bodies), strict=True))
    extents = high.max(axis=0) - low.min(axis=0)
    length = float(extents.max())
    if asked:
        return UNITS[asked], f"lengths are in {asked}, as given by --unit: {_sizes(extents, asked)}"
    if bodies.unit and (bodies.sure or length * UNITS[bodies.unit] <= LIKELY):
        return UNITS[bodies.unit], f"lengths are in {bodies.unit}: {bodies.by}"
    why = (
        f"{bodies.by}, but that would be a product of {length * UNITS[bodies.unit]:.4g} m"
        if bodies.unit
        else "the files state no unit"
    )
    thinnest = float(np.median((high - low).min(axis=1)))
    if DOUBTFUL[0] < length < DOUBTFUL[1] or (
        length >= DOUBTFUL[1] and SHEET[0] < thinnest < SHEET[1]
    ):
        ways = ", ".join(f"{length * UNITS[unit]:.3g} m in {unit}" for unit in ("m", "cm", "mm"))
        message = (
            f"the unit of length is unknown: {why}; the product is {length:.4g} units long, "
            f"{ways}, {length * UNITS['in']:.3g} m in inches"
        )
        raise InputError(Diagnostic("Unit", message, None, "give it with --unit m, cm, mm or in"))
    unit = "m" if length <= DOUBTFUL[0] else "mm"
    return UNITS[unit], f"lengths are taken as {unit}: {why}; {_sizes(extents, unit)} (--unit)"


def _sizes(extents: Array, unit: str) -> str:
    sizes = " x ".join(f"{extent * UNITS[unit]:.4g}" for extent in extents)
    return f"the product is {sizes} m"


def most_of(areas: Array, colours: Sequence[Colour]) -> Colour:
    """The colour of the largest total area; each area has one."""
    total: dict[Colour, float] = {}
    for area, colour in zip(areas.tolist(), colours, strict=True):
        total[colour] = total.get(colour, 0.0) + area
    return max(total, key=total.__getitem__)


def solids_of(body: FileBody) -> tuple[FileBody, ...]:
    """The solids of a body, separated where they touch, each with its cavities and in its
    predominant colour; the body itself if it is one solid, or cannot be closed."""
    vertices, drawn = body.mesh.merged()
    faces = zipped(vertices, drawn)
    if not is_closed(faces):
        return (body,)
    number = shells(vertices, faces)
    count = int(number.max()) + 1
    volume = np.array([volume_of(vertices, faces[number == n]) for n in range(count)])
    outer = np.flatnonzero(volume > 0)
    if len(outer) < 2 or count > Solid.MOST_PIECES:
        whole = replace(body, mesh=MeshFile(((vertices, faces),)), colours=())
        return (body if faces is drawn else whole,)
    boxes = np.array([_box(vertices[faces[number == n]].reshape(-1, 3)) for n in range(count)])
    of = np.arange(count)
    for n in np.flatnonzero(volume <= 0):
        around = (boxes[outer, 0] <= boxes[n, 0]) & (boxes[outer, 1] >= boxes[n, 1])
        near = outer[around.all(axis=1)]
        of[n] = min(near if len(near) else outer, key=volume.__getitem__)
    return _divided(body, vertices, faces, np.unique(of[number], return_inverse=True)[1])


def _divided(
    body: FileBody, vertices: Array, faces: Indices, number: Indices
) -> tuple[FileBody, ...]:
    """The bodies of the triangles with equal numbers, 0, 1, ..., each in its predominant colour.
    `faces` are those of the body, and perhaps others that close it."""
    areas, paint = areas_of(vertices, faces), np.full(len(faces), -1)
    sizes = [len(triangles) for _, triangles in body.mesh.bodies]
    if body.colours and sum(sizes) <= len(faces):
        paint[: sum(sizes)] = np.repeat(np.arange(len(sizes)), sizes)
    colours = (*body.colours, body.colour)
    return tuple(
        FileBody(
            body.name and f"{body.name}-{n + 1}",
            MeshFile((mesh,)),
            most_of(areas[number == n], [colours[shade] for shade in paint[number == n].tolist()]),
        )
        for n, mesh in enumerate(submeshes(vertices, faces, number))
    )


def _box(points: Array) -> Array:
    return np.array([points.min(axis=0), points.max(axis=0)])


def apart(body: FileBody) -> tuple[FileBody, ...]:
    """The connected components of a body; the body itself if it is connected."""
    vertices, faces = body.mesh.merged()
    number = components(len(vertices), faces)
    return _divided(body, vertices, faces, number) if number.max() > 0 else (body,)
