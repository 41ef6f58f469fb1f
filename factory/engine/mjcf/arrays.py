"""The arrays and options of the engine's model that its physics reads, and their fingerprint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from factory.support.engine import mujoco

Values = NDArray[Any]

DRAWN = (
    *("tex_", "mat_", "cam_", "light_", "skin_", "site_rgba", "tendon_rgba", "geom_rgba"),
    *("mesh_texcoord", "mesh_normal", "mesh_facenormal", "mesh_facetexcoord"),
)
"""Beginnings of the names of arrays that are only drawn."""

Option = float | tuple[float, ...]
"""The value of an option of the engine."""


def arrays_of(m: mujoco.MjModel) -> dict[str, Values]:
    """The arrays of a model by name, without those that are only drawn, or empty."""
    if not _names:
        public = (name for name in dir(m) if name[0] != "_" and not name.startswith(DRAWN))
        _names.extend(name for name in public if isinstance(getattr(m, name), np.ndarray))
    return {name: array for name in _names if (array := getattr(m, name)).size}


_names: list[str] = []
"""The names of the arrays that every model has."""


class OptionReader:
    """Reads the engine's options and the statistic that its solver uses."""

    def __init__(self, m: mujoco.MjModel) -> None:
        self._opt, self._stat = m.opt, m.stat
        names = [n for n in dir(m.opt) if n[0] != "_" and not callable(getattr(m.opt, n))]
        values = {name: getattr(m.opt, name) for name in names}
        self._vectors = {n: v for n, v in values.items() if isinstance(v, np.ndarray)}
        self._scalars = [name for name in names if name not in self._vectors]
        self._of = attrgetter(*self._scalars)

    def read(self) -> dict[str, Option]:
        """Their values by name."""
        values: dict[str, Option] = dict(zip(self._scalars, self._of(self._opt), strict=True))
        values |= {name: tuple(vector.tolist()) for name, vector in self._vectors.items()}
        values["meaninertia"] = self._stat.meaninertia
        return values

    def raw(self) -> object:
        """What differs where a value does, read in a fifth of the time."""
        vectors = [vector.tobytes() for vector in self._vectors.values()]
        return self._of(self._opt), vectors, self._stat.meaninertia


@dataclass(frozen=True, slots=True)
class Fingerprint:
    """What a model was compiled to: a hash of each array, and the options."""

    arrays: Mapping[str, int]
    options: Mapping[str, Option]


def fingerprint_of(m: mujoco.MjModel) -> Fingerprint:
    """The fingerprint of a model as it is now."""
    hashes = {name: crc32(array.tobytes()) for name, array in arrays_of(m).items()}
    return Fingerprint(hashes, OptionReader(m).read())


def element(m: mujoco.MjModel, array: str, row: int) -> str:
    """The name of what a row of an array is of, such as a geom; "" for none."""
    kind = array.partition("_")[0]
    if kind == "dof":
        kind, row = "jnt", int(m.dof_jntid[row])
    elif array in ("bvh_aabb", "bvh_child", "bvh_depth", "bvh_nodeid"):
        kind, row = "body", _owner(m.body_bvhadr, m.body_bvhnum, row)
    elif array in ("mesh_vert", "mesh_face"):
        kind, row = "mesh", _owner(getattr(m, f"{array}adr"), getattr(m, f"{array}num"), row)
    of = {"geom": m.geom, "body": m.body, "jnt": m.joint, "mesh": m.mesh, "eq": m.equality}
    of["actuator"] = m.actuator
    count = {"geom": m.ngeom, "body": m.nbody, "jnt": m.njnt, "mesh": m.nmesh, "eq": m.neq}
    count["actuator"] = len(m.actuator_ctrladr)
    if kind not in of or not 0 <= row < count[kind]:
        return ""
    return str(of[kind](row).name) or f"{kind} {row}"


def _owner(first: Values, count: Values, row: int) -> int:
    """Which of some spans of rows a row is in; -1 for none."""
    inside = np.flatnonzero((first <= row) & (row < first + count))
    return int(inside[0]) if len(inside) else -1
