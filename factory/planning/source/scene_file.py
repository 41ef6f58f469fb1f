"""Scene files: GLB, 3MF and STEP with a body, or several, in each part."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from factory.geometry.mesh_reader import MeshFile, UnreadableMesh, checked, read_mesh, reading
from factory.planning.source.bodies import Bodies, FileBody
from factory.support.extras import optional

if TYPE_CHECKING:
    import trimesh

STEP, SCENES = (".step", ".stp"), (".glb", ".3mf", ".step", ".stp")
"""Endings of files whose bodies have names."""

MESHES = (".obj", ".stl", ".ply", ".off")
"""Endings of files with one body."""

STATED = {
    ".glb": ("m", "a GLB file is in metres by its standard"),
    ".step": ("m", "a STEP file states its unit"),
}
"""The unit of what trimesh makes of a file, and the rule that says so."""

IN_3MF = {
    "micron": 1e-6,
    "millimeter": 1e-3,
    "centimeter": 1e-2,
    "inch": 0.0254,
    "foot": 0.3048,
    "meter": 1.0,
}
"""The units that a 3MF file may state [m]."""

NAMELESS = re.compile(
    r"(?i)(|=>.*|\W*\d*\W*|(nauo|node|mesh|object|geometry|solid|body|group|component|world)"
    r"[ _.\-]*\d*|[0-9a-f\-]{16,})"
)
"""Names that programs make up."""


def read_scene(content: bytes, suffix: str) -> Bodies:
    """The bodies of a file with this ending, lower case, by their names. Raises UnreadableMesh, and
    MissingError where the package is missing that reads it."""
    kind = ".step" if suffix in STEP else suffix
    if not content.strip():
        raise UnreadableMesh("it is empty")
    if kind == ".step":
        optional("cascadio", "cascadio", "reading STEP", "step", "export it as GLB or 3MF")
    if kind == ".3mf":
        optional("lxml.etree", "lxml", "reading 3MF", "3mf", "export it as GLB")
    import trimesh

    with reading(kind), _muted(kind == ".step"):
        scene = trimesh.load_scene(io.BytesIO(content), file_type=kind[1:], process=False)
        found = [_body(scene, node, kind) for node in sorted(scene.graph.nodes_geometry)]
    bodies = tuple(body for body in found if body is not None)
    if not bodies:
        checked((), kind)
    if kind != ".3mf":
        return Bodies(bodies, *STATED[kind])
    unit = str(scene.units or "millimeter").removesuffix("s")
    metres = _scaled(bodies, IN_3MF.get(unit, 1e-3))
    return Bodies(metres, "m", f"the 3MF file states {unit}")


def _body(scene: trimesh.Scene, node: str, suffix: str) -> FileBody | None:
    """The body at a node of a scene; None for what has no triangles."""
    import trimesh

    matrix, geometry = scene.graph[node]
    mesh = scene.geometry[geometry]
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        return None
    vertices = np.array(mesh.vertices, float) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.array(mesh.faces, np.int64)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    name = next((n for n in (node, geometry) if not NAMELESS.fullmatch(str(n))), "")
    return FileBody(str(name), checked([(vertices, faces)], suffix), _colour(mesh))


def _colour(mesh: Any) -> tuple[float, ...] | None:
    """The colour of a mesh, None where the file gives it none."""
    kind = getattr(mesh.visual, "kind", None)
    if kind not in ("face", "vertex", "texture"):
        return None
    material: Any = getattr(mesh.visual, "material", None)
    if kind == "texture" and getattr(material, "baseColorFactor", material) is None:
        return None
    found = material.main_color if kind == "texture" else mesh.visual.main_color
    return tuple(round(float(x) / 255, 3) for x in np.asarray(found)[:4])


def _scaled(bodies: tuple[FileBody, ...], unit: float) -> tuple[FileBody, ...]:
    """Bodies with their lengths times a unit."""
    return tuple(
        FileBody(b.name, MeshFile(tuple((v * unit, f) for v, f in b.mesh.bodies)), b.colour)
        for b in bodies
    )


def read_one(path: Path, content: bytes) -> Bodies:
    """The bodies of a file as one body, named after the file. Raises UnreadableMesh."""
    suffix = path.suffix.lower()
    if suffix in MESHES:
        return Bodies((FileBody(path.stem, read_mesh(content, suffix)),))
    scene = read_scene(content, suffix)
    every = tuple(body for found in scene.found for body in found.mesh.bodies)
    colours = {found.colour for found in scene.found}
    colour = colours.pop() if len(colours) == 1 else None
    return Bodies((FileBody(path.stem, MeshFile(every), colour),), scene.unit, scene.by)


@contextmanager
def _muted(muted: bool) -> Iterator[None]:
    """Within it nothing that a library prints past Python is seen: the reader of STEP does."""
    if not muted:
        yield
        return
    sys.stdout.flush()
    sys.stderr.flush()
    kept, nowhere = (os.dup(1), os.dup(2)), os.open(os.devnull, os.O_WRONLY)
    try:
        for stream in (1, 2):
            os.dup2(nowhere, stream)
        yield
    finally:
        for stream, old in zip((1, 2), kept, strict=True):
            os.dup2(old, stream)
            os.close(old)
        os.close(nowhere)
