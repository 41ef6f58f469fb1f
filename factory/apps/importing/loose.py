"""Loose parts: a folder of meshes, or a file of bodies, without a tree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from factory.api import PAG, Diagnostic, InputError, Parameter
from factory.apps.importing.alike import alike
from factory.apps.importing.bodies import Bodies, FileBody, apart, check_count, unit_of
from factory.apps.importing.colours import colours_by_size, kinds_of
from factory.apps.importing.draft import (
    PART,
    DraftNode,
    ImportFaults,
    assemble,
    file_stem,
    label_of,
)
from factory.apps.importing.importer import Imported
from factory.apps.importing.mesh_files import MeshStore, natural, obj_of
from factory.apps.importing.part_maker import Placement
from factory.apps.importing.scene_file import MESHES, SCENES, read_one, read_scene
from factory.support.arrays import Array, Indices
from factory.support.errors import Position
from factory.support.files import MESH, read_bytes
from factory.support.meshes.alike import PartShape, shape_of
from factory.support.meshes.mesh_file import ANEW, UnreadableMesh
from factory.support.texts import quoted


def bodies_in(path: Path) -> Bodies:
    """The bodies of a folder, one part per file, or of a single file. Raises InputError (BadFile,
    BadMesh) with every file that cannot be read."""
    if not path.is_dir():
        faults: list[Diagnostic] = []
        bodies = _read(path, faults)
        if bodies is None:
            raise InputError(faults)
        return bodies
    return _folder(path)


def _folder(folder: Path) -> Bodies:
    seen = sorted(p for p in folder.iterdir() if not p.name.startswith("."))
    files = [p for p in seen if p.suffix.lower() in (*MESHES, *SCENES) and not p.is_dir()]
    files.sort(key=lambda path: natural(path.name))
    faults: list[Diagnostic] = []
    sources = [source for path in files if (source := _read(path, faults, whole=True)) is not None]
    if faults:
        raise InputError(faults)
    check_count(folder, [path.stem for path in files], "mesh files")
    left = [p.name for p in seen if p not in files]
    notes = [f"{len(files)} mesh files, one part each"]
    if left:
        shown = ", ".join(left[:5]) + ", ..." * (len(left) > 5)
        notes.append(f"{len(left)} files in the folder are not meshes and are ignored: {shown}")
    units = {source.unit for source in sources}
    one = sources[0] if len(units) == 1 else Bodies(())
    notes += [note for source in sources for note in source.notes]
    every = tuple(body for source in sources for body in source.bodies)
    return Bodies(every, one.unit, one.by, one.sure, tuple(notes))


def _read(path: Path, faults: list[Diagnostic], whole: bool = False) -> Bodies | None:
    """The bodies of a file; None after a fault. `whole`: all bodies as one."""
    suffix = path.suffix.lower()
    try:
        content = read_bytes(path, MESH)
        if whole or suffix in MESHES:
            return read_one(path, content)
        made = read_scene(content, suffix)
        return replace(made, notes=(f"{len(made.bodies)} bodies in {path.name}", *made.notes))
    except (OSError, UnreadableMesh) as error:
        why = error.strerror if isinstance(error, OSError) else error
        message = f"cannot read {quoted(path.name)}: {why}"
        code = "BadFile" if isinstance(error, OSError) else "BadMesh"
        faults.append(Diagnostic(code, message, None, ANEW))
        return None


def loose_product(path: Path, bodies: Bodies, unit: str | None) -> Imported:
    """The product of loose bodies: one mesh per kind, and the place of each part. A single body is
    split into its connected components."""
    notes = list(bodies.notes)
    if len(bodies.bodies) == 1 and len(pieces := apart(bodies.bodies[0])) > 1:
        bodies = replace(bodies, bodies=pieces)
        notes.append(f"one body of {len(pieces)} disconnected pieces: one part each")
    check_count(path, [body.name for body in bodies.bodies], "bodies")
    metres, unit_note = unit_of(bodies, unit)
    name = file_stem(_title(path.resolve()))
    pag, meshes = _assembled(name, path, bodies.bodies, metres)
    return Imported(name, pag, meshes, path.name, (*notes, unit_note), has_tree=False)


def _title(path: Path) -> str:
    """The name of a product: that of its file or folder or, where that is the name of a format, as
    in `lamp/stl`, that of the folder around it."""
    name = path.name if path.is_dir() else path.stem
    formats = {suffix.lstrip(".") for suffix in (*MESHES, *SCENES)}
    around = path.parent.name
    return around if name.lower().rstrip("s") in {*formats, "mesh", "meshe"} and around else name


def _assembled(
    name: str, path: Path, bodies: tuple[FileBody, ...], unit: float
) -> tuple[PAG, dict[str, bytes]]:
    """The PAG that mates all bodies at once, and its mesh files. Parts of one kind that have no
    colour get the same one, by their size."""
    here, store = Position(str(path), 1, 1), MeshStore("meshes")
    drafts = [DraftNode(name, here, inputs=list(range(1, len(bodies) + 1)))]
    surfaces = [_scaled(body.mesh.merged(), unit) for body in bodies]
    shapes = [shape_of(*surface) for surface in surfaces]
    kinds, origins, meshes = alike(shapes), dict[int, Array](), dict[int, str]()
    names = [_name(body, index) for index, body in enumerate(bodies)]
    paints = colours_by_size(kinds_of(kinds.kinds, names, *_sizes(shapes)))
    for index, body in enumerate(bodies):
        kind, motion = kinds.kinds[index], kinds.motions[index]
        if kind == index:
            low, high = shapes[index].vertices.min(axis=0), shapes[index].vertices.max(axis=0)
            origins[kind] = np.round((low + high) / 2, 6)
            vertices, faces = surfaces[index]
            content = obj_of(vertices - origins[kind], faces, "made by factory plan; metres")
            meshes[kind] = store.add(_name(body, index), ".obj", content)
        at = motion.turn @ origins[kind] + motion.shift
        stands = Placement(motion.turn, at, moved=True).parameters({})
        rgba = body.colour or paints[kind]
        parameters = (Parameter("mesh", meshes[kind]), *stands, Parameter("rgba", rgba))
        drafts.append(DraftNode(_name(body, index), here, PART, [], parameters))
    return assemble(drafts, ImportFaults()), store.files


def _sizes(shapes: Sequence[PartShape]) -> tuple[list[float], float]:
    """The diagonal of the box round each shape, and of that round all [m]."""
    boxes = np.array([(s.vertices.min(axis=0), s.vertices.max(axis=0)) for s in shapes])
    whole = boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)
    each = np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1)
    return each.tolist(), max(float(np.linalg.norm(whole)), 1e-12)


def _scaled(mesh: tuple[Array, Indices], unit: float) -> tuple[Array, Indices]:
    return mesh[0] * unit, mesh[1]


def _name(body: FileBody, index: int) -> str:
    """A name that begins with a letter, from that of the body or its number."""
    label = label_of(body.name)
    if not label:
        return f"part{index + 1}"
    return label if label[0].isalpha() else f"part-{label}"
