"""Scene files: GLB, 3MF and STEP, in which each part has one or more bodies.

OpenCASCADE (cascadio) converts STEP to triangles in a separate process. A file that makes it crash,
or use up all memory, ends only that process; its output is not shown; and signals are handled at
once.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from factory.apps.importing import threemf_file
from factory.apps.importing.bodies import MOST_PARTS, Bodies, FileBody, most_of, solids_of
from factory.support.errors import listing
from factory.support.files import MESH, read_bytes
from factory.support.meshes.glb_reader import Colour, GlbBody, read_glb
from factory.support.meshes.mesh_file import EXPECTED, MeshFile, UnreadableMesh, checked
from factory.support.meshes.mesh_reader import read_mesh
from factory.support.version import optional

STEP, SCENES = (".step", ".stp"), (".glb", ".3mf", ".step", ".stp")
"""Suffixes of files whose bodies have names."""

MESHES = (".obj", ".stl", ".ply", ".off")
"""Suffixes of files with one body."""

STATED = {
    ".glb": ("m", "a GLB file is in metres by its standard", False),
    ".step": ("m", "a STEP file states its unit", True),
}
"""The unit of length by format, the rule that states it, and whether the file itself does."""

Y_UP = "y is up in a GLB file by its standard; --up -y where it was written with z up"
"""The note on the axes of a GLB file, which become x, -z, y."""

NAMELESS = re.compile(
    r"(?i)(|=>.*|\W*\d*\W*|(nauo|node|mesh|object|geometry|solid|body|group|component|world)"
    r"[ _.\-]*\d*|[0-9a-f\-]{16,})"
)
"""Names that programs generate."""

SHOWN = 6
"""The most parts of several bodies that a note names."""


MEMORY = 8 << 30
"""The limit of the address space of the process [bytes]."""

CONVERT = f"""
import resource, sys
hard = resource.getrlimit(resource.RLIMIT_AS)[1]
most = {MEMORY} if hard == resource.RLIM_INFINITY else min(hard, {MEMORY})
resource.setrlimit(resource.RLIMIT_AS, (most, hard))
sys.modules["trimesh"] = None  # cascadio registers a handler there, and runs without
import cascadio
cascadio.step_to_glb(sys.argv[1], sys.argv[2], float(sys.argv[3]))
"""

BEGIN = b"ISO-10303-21"

STEPS = FINE, _, COARSE = 0.01, 0.03, 0.1
"""Distances of triangles from the faces of a STEP file [mm]. Fits are seen by the first."""

SHARE = 1e-4
"""The distance is at most this share of the longest edge of a component's box: a fine step would
give a large component a hundred thousand triangles."""

SMALL = 0.98 * STEPS[1] / SHARE
"""Components below this size [mm] are read finely, however coarse the triangles are by which it is
known."""

POINTS = re.compile(rb"CARTESIAN_POINT\s*\(\s*'[^']*'\s*,\s*\(([^)]*)\)")
MILLIMETRES, LOOKED_AT = re.compile(rb"\.MILLI\.\s*,\s*\.METRE\."), 1 << 22
"""Points of a STEP file, what says that they are in millimetres, and in how many bytes these are
sought."""


def read_scene(content: bytes, suffix: str) -> Bodies:
    """The named bodies of a file with this suffix, in lower case; each solid of a STEP component is
    a body. Raises UnreadableMesh, and MissingError if the package that reads the format is
    missing."""
    kind = ".step" if suffix in STEP else suffix
    if not content.strip():
        raise UnreadableMesh("it is empty")
    if kind == ".3mf":
        meshes, unit = threemf_file.read_3mf(content)
        metres = threemf_file.UNITS.get(unit)
        if metres is None:
            raise UnreadableMesh(f"it states a unit that 3MF does not have: {unit[:20]}")
        bodies = [_body(body, kind, metres) for body in _few(meshes)]
        stated = "m", f"the 3MF file states {unit}", True
    else:
        meshes = (read_step if kind == ".step" else read_glb)(content)
        bodies = [_body(body, kind) for body in _few(meshes)]
        stated = STATED[kind]
    if not bodies:
        checked((), kind)
    if kind != ".step":
        axes = (Y_UP,) * (kind == ".glb")
        return Bodies(tuple(bodies), *stated, (*axes, *_merged(bodies)))
    parts = [solids_of(body) for body in bodies]
    notes = [
        f"component '{body.name}' has {len(solids)} solids: one part each"
        for body, solids in zip(bodies, parts, strict=True)
        if len(solids) > 1
    ]
    apart = [body for solids in parts for body in solids]
    return Bodies(tuple(apart), *stated, tuple(dict.fromkeys(notes)))


def _few(bodies: list[GlbBody]) -> list[GlbBody]:
    """The bodies, if they are no more than can be planned."""
    if len(bodies) > MOST_PARTS:
        raise UnreadableMesh(f"it has {len(bodies)} bodies; at most {MOST_PARTS} are planned")
    return bodies


def _body(body: GlbBody, suffix: str, unit: float = 1.0) -> FileBody:
    """A body of a file, scaled by a unit."""
    name = next((name for name in body.names if not NAMELESS.fullmatch(name)), "")
    mesh = checked([(vertices * unit, faces) for vertices, faces in body.bodies], suffix)
    return FileBody(name, mesh, most_of(mesh.areas(), body.colours), body.colours)


def _merged(bodies: Sequence[FileBody]) -> tuple[str, ...]:
    """A note on the bodies that the file groups into one part; empty if there are none."""
    counts = [(body.name, count) for body in bodies if (count := len(solids_of(body))) > 1]
    if not counts:
        return ()
    shown = [f"'{name}' of {count}" for name, count in counts]
    return (f"bodies grouped in the file are one part: {listing(shown, SHOWN)}",)


def read_one(path: Path, content: bytes) -> Bodies:
    """All bodies of a file as one body, named after the file. Raises UnreadableMesh."""
    suffix = path.suffix.lower()
    if suffix in MESHES:
        return Bodies((FileBody(path.stem, read_mesh(content, suffix)),))
    scene = read_scene(content, suffix)
    meshes = tuple(body for part in scene.bodies for body in part.mesh.bodies)
    colours = {part.colour for part in scene.bodies}
    colour = colours.pop() if len(colours) == 1 else None
    many = len(scene.bodies)
    notes = (f"{path.name} has {many} bodies: one part, as each file of a folder",) * (many > 1)
    return Bodies(
        (FileBody(path.stem, MeshFile(meshes), colour),), scene.unit, scene.by, scene.sure, notes
    )


def read_step(content: bytes) -> list[GlbBody]:
    """The components of a STEP file that have faces, in metres, with the colours that the file
    states. Raises UnreadableMesh, and MissingError without cascadio."""
    if BEGIN not in content[:4096]:
        raise UnreadableMesh(f"it is not {EXPECTED['.step']}")
    with TemporaryDirectory() as folder:
        source = Path(folder) / "a.step"
        source.write_bytes(content)
        made = {FINE: _triangles(source, FINE)} if _seems_small(content) else {}
        if not made or any(_longest(body) > SMALL for body in made[FINE]):
            made[COARSE] = _triangles(source, COARSE)
        wanted = [_deflection(body) for body in made[max(made)]]
        made |= {one: _triangles(source, one) for one in {*wanted} - {*made}}
    finest = made[min(made)]
    if any(len(bodies) != len(finest) for bodies in made.values()):
        wanted = [min(made)] * len(finest)
    bodies = [made[deflection][number] for number, deflection in enumerate(wanted)]
    return [GlbBody(body.names, body.bodies, tuple(map(_stated, body.colours))) for body in bodies]


def _seems_small(content: bytes) -> bool:
    """Whether all points of a STEP file are so near each other that each component is likely to be
    read finely."""
    if not MILLIMETRES.search(content):
        return False
    words = b",".join(POINTS.findall(content[:LOOKED_AT])).split(b",")
    try:
        return bool(np.ptp(np.array(words, float)) < SMALL)
    except ValueError:
        return False


def _longest(body: GlbBody) -> float:
    """The longest edge of the box of a component [mm]."""
    points = np.concatenate([vertices for vertices, _ in body.bodies])
    return 1e3 * float(np.ptp(points, axis=0).max())


def _deflection(body: GlbBody) -> float:
    """How far the triangles of a component may be from its faces [mm]: a step between FINE and
    COARSE that is at most a SHARE of the longest edge of its box."""
    return max((step for step in STEPS if step <= SHARE * _longest(body)), default=FINE)


def _triangles(source: Path, deflection: float) -> list[GlbBody]:
    """The components of a STEP file, at most so far from their faces [mm]. Raises
    UnreadableMesh, and MissingError without cascadio, which takes long to load."""
    made, none = source.with_suffix(".glb"), subprocess.DEVNULL
    made.unlink(missing_ok=True)
    words = [sys.executable, "-c", CONVERT, str(source), str(made), str(deflection)]
    done = subprocess.run(
        words, cwd=source.parent, stdin=none, stdout=none, stderr=none, check=False
    )
    if not made.exists():
        optional("cascadio", "cascadio", "reading STEP", "step", "export it as GLB or 3MF")
        ended = f"; it ended with status {done.returncode}" if done.returncode else ""
        why = f"OpenCASCADE finds no faces in it{ended}; it should be {EXPECTED['.step']}"
        raise UnreadableMesh(why)
    try:
        glb = read_bytes(made, MESH)
    except OSError:
        raise UnreadableMesh("it has too many triangles: export it as GLB, coarser") from None
    return read_glb(glb, np.eye(4))  # the axes are those of the STEP file


def _stated(colour: Colour) -> Colour:
    """A colour as STEP states it. What is fully transparent is opaque here: SolveSpace writes
    opacity in place of transparency."""
    return colour and (*colour[:3], colour[3] or 1.0)
