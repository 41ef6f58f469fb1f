"""The engine's model of a factory."""

from __future__ import annotations

from hashlib import sha256
from typing import TypeAlias

from factory.engine.mjcf.arrays import Fingerprint, fingerprint_of
from factory.engine.mjcf.model import Model
from factory.support.compiling import compiled
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError

EngineModel: TypeAlias = mujoco.MjModel
"""The type of the engine's models."""

KEPT = 8
"""Number of models whose fingerprints are kept."""

_fingerprints: dict[bytes, Fingerprint] = {}


def load(model: Model) -> mujoco.MjModel:
    """The engine's model of a factory.

    Args:
        model: the model as MJCF.

    Raises InputError (BadMesh, BadValue, Engine) where the engine refuses it.
    """
    try:
        m = compiled(model.xml, model.files)
    except ValueError as error:
        raise InputError(_explained(model, str(error))) from error
    if len(_fingerprints) >= KEPT:
        del _fingerprints[next(iter(_fingerprints))]
    _fingerprints[_digest(model)] = fingerprint_of(m)
    return m


def fingerprint(model: Model) -> Fingerprint:
    """The fingerprint of the engine's model of a factory: that of when it was loaded, or else it is
    compiled once more."""
    kept = _fingerprints.get(_digest(model))
    return kept or fingerprint_of(compiled(model.xml, model.files))


def _digest(model: Model) -> bytes:
    digest = sha256(model.xml.encode())
    for name in sorted(model.files):
        digest.update(name.encode())
        digest.update(model.files[name])
    return digest.digest()


def _explained(model: Model, words: str) -> Diagnostic:
    """The engine's error, at the line of the part it speaks of where it names one."""
    for solid in model.layout.product.solids.values():
        mesh = f"mesh/{solid.mesh.name}" if solid.mesh else ""
        if f"part/{solid.label}#" in words or (mesh and mesh in words):
            position = model.factory.pag[solid.label].position
            hint = "repair the mesh of this part" if solid.mesh else "give it another shape or mass"
            code = "BadMesh" if solid.mesh else "BadValue"
            return Diagnostic(code, words.strip(), position, hint)
    return Diagnostic("Engine", words.strip(), None, "please report this as a bug of factory")
