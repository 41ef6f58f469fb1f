"""The engine's model of a factory."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import TypeAlias

from factory.engine.mjcf.arrays import Fingerprint, fingerprint_of
from factory.engine.mjcf.model import Model
from factory.support.engine import mujoco, unwarned
from factory.support.errors import Diagnostic, InputError
from factory.support.interruption import awaited

EngineModel: TypeAlias = mujoco.MjModel
"""The type of the engine's models."""

MANY = 20_000
"""A model of more geoms is read in pieces."""

PIECE = 10_000
"""Elements of a piece."""

BODY = re.compile(r"^    <body .*?^    </body>\n", re.M | re.S)
"""A body of the world, with all that is in it, in a text whose levels are indented by two spaces,
as `Model.with_tree` does."""

SHARED = re.compile(r"^  <compiler .*?/>\n|^  <default>.*?^  </default>\n", re.M | re.S)
"""What every piece has of it, too."""

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


def compiled(xml: str, meshes: Mapping[str, bytes]) -> mujoco.MjModel:
    """The engine's model of an XML with mesh files, by their names. Raises ValueError where the
    engine refuses it."""
    files = {f"meshes/{name}": content for name, content in meshes.items()}
    read = _by_pieces if xml.count("<geom") > MANY else mujoco.MjModel.from_xml_string
    return awaited(lambda: read(xml, files))


def _by_pieces(xml: str, files: Mapping[str, bytes]) -> mujoco.MjModel:
    """The same model to the last byte, read piece by piece. Each element that the engine's reader
    adds makes it list all that it has read, so that reading is quadratic in the size of a piece."""
    bodies, shared = BODY.findall(xml), "".join(SHARED.findall(xml))
    spec = mujoco.MjSpec.from_string(BODY.sub("", xml), assets=dict(files))
    with unwarned():  # that names could clash: here they are those of one model
        for some in _blocks(bodies):
            piece = f"<mujoco>{shared}<worldbody>{some}</worldbody></mujoco>"
            child = mujoco.MjSpec.from_string(piece)
            spec.attach(child, prefix="", frame=spec.worldbody.add_frame())
        return spec.compile()


def _blocks(bodies: list[str]) -> Iterator[str]:
    """Bodies with PIECE elements, or a body more, at a time; they are taken out of the list."""
    bodies.reverse()
    while bodies:
        some, size = list[str](), 0
        while bodies and size <= PIECE:
            some.append(bodies.pop())
            size += some[-1].count("<") - some[-1].count("</")
        yield "".join(some)


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
