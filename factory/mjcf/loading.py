"""The engine's model of a factory."""

from __future__ import annotations

from factory.mjcf.model import Model
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic, InputError
from factory.support.interruption import awaited


def load(model: Model) -> mujoco.MjModel:
    """The engine's model of a factory. Raises InputError (BadMesh, BadValue, Engine) where the
    engine refuses it."""
    files = {f"meshes/{name}": content for name, content in model.files.items()}
    try:
        return awaited(lambda: mujoco.MjModel.from_xml_string(model.xml, files))
    except ValueError as error:
        raise InputError(_explained(model, str(error))) from error


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
