"""What the engine has compiled, kept: beside the MJCF that is written, and in the user's cache.

The engine compiles a large model in seconds and reads the result back in a tenth of one. But it
trusts a binary file blindly, and a damaged one may end the process. So beside each lies its seal, a
digest of all that the model is made from, the engine's version and the binary itself. Only bytes
that their seal is right for are ever given to the engine; where it is not, the model is compiled
again, which gives the same one.
"""

from __future__ import annotations

import contextlib
import hashlib
import platform
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from factory.mjcf.model import Model
from factory.support.files import user_cache, write_all

if TYPE_CHECKING:
    from factory.support.engine import mujoco

ENDING = ".mjb"

LEAST = 2**20
"""What is made from fewer bytes of XML and meshes is not kept in the cache: the engine compiles it
in about 0.1 s at most."""

MOST = 500 * 10**6
"""The cache is kept below this size [bytes]: what was not used for longest goes first."""


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


def cached(model: Model) -> mujoco.MjModel | None:
    """What the engine made of the model before, None where the cache does not have it."""
    if not _is_large(model):
        return None
    from factory.support.engine import mujoco

    key = key_of(model)
    path, name = _place(key), f"model{ENDING}"
    content = kept(path, key)
    if content is None:
        return None
    with contextlib.suppress(OSError):
        path.touch()
        seal_of(path).touch()
    with contextlib.suppress(ValueError):
        return mujoco.MjModel.from_binary_path(name, {name: content})
    return None


def keep(model: Model, m: mujoco.MjModel) -> None:
    """Put what the engine made of a large model in the cache, where that can be written."""
    if not _is_large(model):
        return
    key, content = key_of(model), packed(m)
    path = _place(key)
    if len(content) > MOST:
        return
    with contextlib.suppress(OSError):
        write_all(sealed(path, key, content))
        _shrink(path.parent)


def _is_large(model: Model) -> bool:
    return len(model.xml) + sum(map(len, model.files.values())) >= LEAST


def _place(key: str) -> Path:
    return user_cache() / "models" / f"{key}{ENDING}"


def _shrink(folder: Path) -> None:
    """Remove the files that were not used for longest until the rest is no larger than MOST.
    Raises OSError."""
    found = [(file, file.stat()) for file in folder.iterdir()]
    size = sum(status.st_size for _, status in found)
    for file, status in sorted(found, key=lambda pair: pair[1].st_mtime_ns):
        if size <= MOST:
            break
        file.unlink(missing_ok=True)
        size -= status.st_size
