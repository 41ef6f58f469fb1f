"""Loose parts: a folder of meshes, or a file of bodies, without a tree."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from factory.geometry.alike import alike, shape_of
from factory.geometry.mesh_file import ANEW, UnreadableMesh
from factory.geometry.meshes import Array, Indices
from factory.geometry.solids import colour
from factory.importing.assembling import assemble
from factory.importing.draft import PART, DraftNode, ImportFaults
from factory.importing.labels import file_stem, label_of
from factory.importing.mesh_files import MeshStore
from factory.importing.places import quaternion, rounded
from factory.lang.source import quoted
from factory.planning.source.bodies import Bodies, FileBody, apart, unit_of
from factory.planning.source.faults import check_count
from factory.planning.source.scene_file import MESHES, SCENES, read_one, read_scene
from factory.planning.source.trees import TreeProduct
from factory.problem.pag import PAG, Assembly, Parameter
from factory.support.errors import Diagnostic, InputError, Position
from factory.support.files import MESH, read_bytes
from factory.support.order import natural

STILL = 1e-9
"""A rotation this close to none is none."""


def bodies_in(path: Path) -> Bodies:
    """The bodies of a folder, a part a file, or of a file. Raises InputError (BadFile, BadMesh)
    with every file that cannot be read."""
    if not path.is_dir():
        faults: list[Diagnostic] = []
        found = _read(path, faults)
        if found is None:
            raise InputError(faults)
        return found
    return _folder(path)


def _folder(folder: Path) -> Bodies:
    seen = sorted(p for p in folder.iterdir() if not p.name.startswith("."))
    files = [p for p in seen if p.suffix.lower() in (*MESHES, *SCENES) and not p.is_dir()]
    files.sort(key=lambda path: natural(path.name))
    faults: list[Diagnostic] = []
    found = [made for path in files if (made := _read(path, faults, whole=True)) is not None]
    if faults:
        raise InputError(faults)
    check_count(folder, [path.stem for path in files], "files of meshes")
    left = [p.name for p in seen if p not in files]
    notes = [f"{len(files)} files of meshes, a part each"]
    if left:
        shown = ", ".join(left[:5]) + ", ..." * (len(left) > 5)
        notes.append(f"{len(left)} in the folder are no meshes, and left out: {shown}")
    units = {made.unit for made in found}
    one = found[0] if len(units) == 1 else Bodies(())
    notes += [note for made in found for note in made.notes]
    every = tuple(body for made in found for body in made.found)
    return Bodies(every, one.unit, one.by, one.sure, tuple(notes))


def _read(path: Path, faults: list[Diagnostic], whole: bool = False) -> Bodies | None:
    """The bodies of a file; None after a fault. `whole`: all as one."""
    suffix = path.suffix.lower()
    try:
        content = read_bytes(path, MESH)
        if whole or suffix in MESHES:
            return read_one(path, content)
        made = read_scene(content, suffix)
        return replace(made, notes=(f"{len(made.found)} bodies in {path.name}", *made.notes))
    except (OSError, UnreadableMesh) as error:
        why = error.strerror if isinstance(error, OSError) else error
        message = f"cannot read {quoted(path.name)}: {why}"
        code = "BadFile" if isinstance(error, OSError) else "BadMesh"
        faults.append(Diagnostic(code, message, None, ANEW))
        return None


def loose_product(path: Path, bodies: Bodies, unit: str | None) -> TreeProduct:
    """The product of loose bodies: a mesh a kind, and where each part of the kind is. A single body
    of several pieces is taken to pieces."""
    notes = list(bodies.notes)
    if len(bodies.found) == 1 and len(pieces := apart(bodies.found[0])) > 1:
        bodies = replace(bodies, found=pieces)
        notes.append(f"one body of {len(pieces)} pieces that share no corner: a part each")
    check_count(path, [body.name for body in bodies.found], "bodies")
    metres, said = unit_of(bodies, unit)
    name = file_stem(path.resolve().name if path.is_dir() else path.stem)
    pag, files = _assembled(name, path, bodies.found, metres)
    return TreeProduct(name, pag, files, (*notes, said), bodies.warnings, has_tree=False)


def _assembled(
    name: str, path: Path, bodies: tuple[FileBody, ...], unit: float
) -> tuple[PAG, dict[str, bytes]]:
    """The PAG that mates all bodies at once, and its mesh files. Parts of a kind without a colour
    have the same."""
    here, store = Position(str(path), 1, 1), MeshStore("meshes")
    drafts = [DraftNode(name, here, inputs=list(range(1, len(bodies) + 1)))]
    shapes = [shape_of(*_scaled(body.mesh.merged(), unit)) for body in bodies]
    found, origins, meshes = alike(shapes), dict[int, Array](), dict[int, str]()
    numbers = {kind: number for number, kind in enumerate(dict.fromkeys(found.kinds))}
    for index, body in enumerate(bodies):
        kind, motion = found.kinds[index], found.motions[index]
        if kind == index:
            low, high = shapes[index].vertices.min(axis=0), shapes[index].vertices.max(axis=0)
            origins[kind] = np.round((low + high) / 2, 6)
            vertices, faces = _scaled(body.mesh.merged(), unit)
            content = obj_of(vertices - origins[kind], faces)
            meshes[kind] = store.add(_name(body, index), ".obj", content)
        at = motion.turn @ origins[kind] + motion.shift
        given = [Parameter("mesh", meshes[kind]), Parameter("pos", rounded(at))]
        if np.abs(motion.turn - np.eye(3)).max() > STILL:
            given.append(Parameter("quat", quaternion(motion.turn)))
        plain = Assembly("", PART)
        given.append(Parameter("rgba", body.colour or colour(plain, numbers[kind])))
        drafts.append(DraftNode(_name(body, index), here, PART, [], tuple(given)))
    return assemble(drafts, ImportFaults()), store.files


def _scaled(mesh: tuple[Array, Indices], unit: float) -> tuple[Array, Indices]:
    return mesh[0] * unit, mesh[1]


def _name(body: FileBody, index: int) -> str:
    """A name that begins with a letter: that of the body, or its number."""
    label = label_of(body.name)
    if not label:
        return f"part{index + 1}"
    return label if label[0].isalpha() else f"part-{label}"


def obj_of(vertices: Array, faces: Indices) -> bytes:
    """An OBJ file [m]."""
    lines = ["# made by factory plan; metres"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in (np.round(vertices, 9) + 0.0).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    return ("\n".join(lines) + "\n").encode()
