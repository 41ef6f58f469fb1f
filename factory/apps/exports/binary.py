"""What the engine has compiled, kept beside the MJCF that is written.

Beside the binary lies its seal, a digest of all that the model is made from, the engine's version
and the binary itself. Where it is right, a build leaves the engine alone, which compiles a large
model in seconds; where it is not, the model is compiled again, which gives the same one.
"""

from __future__ import annotations

import hashlib
import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from factory.api import Model

if TYPE_CHECKING:
    from factory.support.engine import mujoco

ENDING = ".mjb"


def beside(mjcf: Path) -> Path | None:
    """Where the binary of an MJCF file lies; None beside what is no plain file (a pipe)."""
    if mjcf.exists() and not mjcf.is_file():
        return None
    name = mjcf.name if mjcf.suffix.lower() == ENDING else mjcf.stem
    return mjcf.with_name(f"{name}{ENDING}")


def seal_of(path: Path) -> Path:
    """Where the seal of a binary lies."""
    return path.with_name(f"{path.name}.seal")


def key_of(model: Model) -> str:
    """A digest of all that decides what the engine compiles: its version and the kind of machine,
    the XML, the meshes."""
    digest = hashlib.sha256(f"mujoco {version('mujoco')} {platform.machine()}".encode())
    xml = model.xml.encode(errors="surrogateescape")
    for name, content in (("", xml), *sorted(model.files.items())):
        digest.update(f" {name!a} {len(content)} ".encode())
        digest.update(content)
    return digest.hexdigest()


def sealed(path: Path, key: str, content: bytes) -> dict[Path, bytes]:
    """A binary with its seal: what to write where."""
    return {path: content, seal_of(path): _seal(key, content)}


def _seal(key: str, content: bytes) -> bytes:
    digest = hashlib.sha256(key.encode())
    digest.update(content)
    return f"{digest.hexdigest()}\n".encode()


def kept(path: Path, key: str) -> bytes | None:
    """The binary at `path`, None where there is none, or it is damaged or of something else."""
    try:
        seal, content = seal_of(path).read_bytes(), path.read_bytes()
    except OSError:
        return None
    return content if seal == _seal(key, content) else None


def packed(m: mujoco.MjModel) -> bytes:
    """A model of the engine as the bytes of a binary file."""
    from factory.support.engine import mujoco

    content = np.empty(mujoco.mj_sizeModel(m), np.uint8)
    mujoco.mj_saveModel(m, None, content)
    return content.tobytes()
