"""STEP files as bodies: OpenCASCADE (cascadio) makes triangles of them, in a process of its own.

So a file that makes it fail, or take all memory, ends that process alone; what it prints is not
seen; and a signal is heard at once.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from factory.geometry.glb_reader import Colour, GlbBody, read_glb
from factory.geometry.mesh_file import EXPECTED, UnreadableMesh
from factory.support.extras import optional
from factory.support.files import MESH, read_bytes

MEMORY = 8 << 30
"""The most address space of the process [bytes]."""

CONVERT = f"""
import resource, sys
hard = resource.getrlimit(resource.RLIMIT_AS)[1]
most = {MEMORY} if hard == resource.RLIM_INFINITY else min(hard, {MEMORY})
resource.setrlimit(resource.RLIMIT_AS, (most, hard))
import cascadio
cascadio.step_to_glb(sys.argv[1], sys.argv[2])
"""

BEGIN = b"ISO-10303-21"


def read_step(content: bytes) -> list[GlbBody]:
    """The components of a STEP file that have faces, in metres, in the colours that it states.
    Raises UnreadableMesh, and MissingError without cascadio."""
    optional("cascadio", "cascadio", "reading STEP", "step", "export it as GLB or 3MF")
    if BEGIN not in content[:4096]:
        raise UnreadableMesh(f"it is not {EXPECTED['.step']}")
    with TemporaryDirectory() as folder:
        source, made = Path(folder) / "a.step", Path(folder) / "a.glb"
        source.write_bytes(content)
        none = subprocess.DEVNULL
        words = [sys.executable, "-c", CONVERT, str(source), str(made)]
        done = subprocess.run(words, cwd=folder, stdin=none, stdout=none, stderr=none, check=False)
        if not made.exists():
            ended = f"; it ended with status {done.returncode}" if done.returncode else ""
            why = f"OpenCASCADE finds no faces in it{ended}; it should be {EXPECTED['.step']}"
            raise UnreadableMesh(why)
        try:
            glb = read_bytes(made, MESH)
        except OSError:
            raise UnreadableMesh("it has too many triangles: export it as GLB, coarser") from None
    return [
        GlbBody(body.names, body.bodies, tuple(map(_stated, body.colours)))
        for body in read_glb(glb)
    ]


def _stated(linear: Colour) -> Colour:
    """A colour as STEP states it: glTF has its light in its place (IEC 61966-2-1)."""
    if linear is None:
        return None
    light = [12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055 for x in linear[:3]]
    return (*(round(x, 3) for x in light), linear[3])
