"""Meshes with their pieces and mass properties, kept in the user's cache by the content of their
file, so that each is measured once."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from factory.geometry.meshes import MassProperties, Mesh, Remark
from factory.support import array_cache
from factory.support.array_cache import PACKED, digest, packed, program, unpacked

FOLDER = "meshes"
"""Where they are, in the user's cache."""

PACKAGES = ("trimesh", "numpy", "scipy", "coacd")
"""What reads, measures and decomposes meshes."""

UNNAMED = ""
"""The name of a mesh here: it is that of the part's file in a product."""

KEYS = ("vertices", "faces", "remark", "volume", "centre", "inertia", "hull", *PACKED)
"""The arrays of an entry."""


def key_of(content: bytes, suffix: str, scale: float) -> str:
    """The name of an entry: what is found depends on the file's content and kind, the scale, the
    modules of this folder and the packages that they use."""
    return digest(content, suffix, scale, program(Path(__file__).parent, *PACKAGES))


def find(key: str) -> MassProperties | None:
    """What was found of a mesh; None where nothing is kept."""
    kept = array_cache.find(FOLDER, key, KEYS)
    if kept is None:
        return None
    remark = Remark(*map(str, kept["remark"])) if len(kept["remark"]) else None
    volume, centre, inertia = float(kept["volume"]), kept["centre"], kept["inertia"]
    mesh = Mesh(UNNAMED, kept["vertices"], kept["faces"], unpacked(kept))
    return MassProperties(mesh, remark, volume, centre, inertia, kept["hull"])


def keep(key: str, found: MassProperties) -> MassProperties:
    """What was found, after it has been kept."""
    said = found.remark
    arrays = {
        "vertices": found.mesh.vertices,
        "faces": found.mesh.faces,
        "remark": np.array([said.text, said.many, said.hint] if said else [], str),
        "volume": np.array(found.volume),
        "centre": found.centre,
        "inertia": found.inertia,
        "hull": found.hull,
        **packed(found.mesh.pieces),
    }
    array_cache.keep(FOLDER, key, arrays)
    return found
