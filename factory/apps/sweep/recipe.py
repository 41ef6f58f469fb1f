"""The recipe of a sweep: everything that its runs share; and the identity of a sweep."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from hashlib import sha256
from importlib.metadata import version
from typing import Any

import numpy as np

from factory.api import (
    Factory,
    Ground,
    Layout,
    LayoutTable,
    Product,
    Project,
    load_catalogue,
    proved,
    write_pag,
    write_template,
)
from factory.apps.runs.options import check_ideal
from factory.apps.sweep.grid import DEFAULTS, SETTINGS, GridAxis, Point, Value
from factory.support.errors import usage_error
from factory.support.resources import mjcf_folder
from factory.support.tables import table_of
from factory.support.version import __version__


@dataclass(frozen=True)
class Recipe:
    """A factory, the solids of its product, the `fixed` values of keys, the simulated time after
    which a run is stopped [s], the `ground` of its layout, whether joined parts become one body
    (None: if it pays), and its layout if it is given (`laid`). A worker needs nothing else and
    reads no file of the user."""

    factory: Factory
    product: Product
    fixed: Mapping[str, Value]
    max_time: float | None = None
    ground: Ground = Ground()  # noqa: RUF009
    fuse: bool | None = None
    laid: Layout | None = None

    def at(self, point: Point) -> dict[str, Value]:
        """The value of every key at a point."""
        return {**DEFAULTS, **self.fixed, **dict(point)}

    def identity(self, axes: Sequence[GridAxis]) -> dict[str, Any]:
        """What must not change if a sweep is resumed: product, versions, fixed values, and the keys
        that vary. The values of these may change: a grid may grow."""
        varied = sorted(axis.key for axis in axes)
        fixed = {k: v for k, v in self.at(()).items() if k not in varied}
        return {
            "product": self.factory.pag.root,
            "digest": digest(self.factory, self.product),
            **versions(),
            "varied": varied,
            "max_time": self.max_time,
            "floor": list(self.ground.floor) if self.ground.floor else None,
            "relay": self.ground.relay,
            "cycle": self.ground.cycle,
            **({"tile": self.ground.tile} if self.ground.tile else {}),
            "plan": table_of(self.factory.plan),
            "fuse": self.fuse,
            **({"layout": table_of(LayoutTable.of(self.laid))} if self.laid else {}),
            **fixed,
        }


def recipe_of(
    project: Project,
    axes: Sequence[GridAxis],
    shared: Mapping[str, Value],
    max_time: float | None = None,
    fuse: bool | None = None,
) -> Recipe:
    """The recipe of a sweep of a project along axes, with `shared` values of the keys in DEFAULTS,
    None where they are not given. Its net is proved, and it is laid out unless the clearance
    varies, so that what does not fit its floor is refused before the first run. Raises InputError,
    of code Usage for a value that is given and varied; RunError."""
    for axis in axes:
        if shared.get(axis.key) is not None:
            raise usage_error(f"{axis.key} is both given and varied", "leave one of them out")
    worlds = next((axis.values for axis in axes if axis.key == "world"), (shared.get("world"),))
    if set(worlds) == {"ideal"}:
        check_ideal(fuse)
    varies = any(axis.key == "clearance" for axis in axes)
    proved((project.plain if varies else project.layout.factory).net)
    fixed = {name: getattr(project.settings, name) for name in SETTINGS}
    fixed |= {key: shared[key] for key in DEFAULTS if shared.get(key) is not None}
    laid = project.layout if project.laid else None
    about = max_time, project.ground, fuse, laid
    return Recipe(project.plain, project.product, fixed, *about)


def versions() -> dict[str, str]:
    """The versions that the figures of a run depend on."""
    return {"factory": __version__, "mujoco": version("mujoco")}


def digest(factory: Factory, product: Product) -> str:
    """SHA-256 of a product and its compilation: the PAG's canonical text, the solids of its meshes,
    its templates, and the files of the robot types."""
    made = sha256(write_pag(factory.pag).encode())
    for name, template in sorted({o.template.name: o.template for o in factory.operations}.items()):
        made.update(f"{name}\n{write_template(template)}".encode())
    for label in sorted(product.solids):
        for piece in _bytes(product.solids[label]):
            made.update(piece)
    shipped = sorted(mjcf_folder().rglob("*"))
    types = {robot.mjcf for robot in load_catalogue().types.values()}
    for path in (*shipped, *sorted(types - {*shipped})):
        if path.is_file():
            made.update(path.name.encode() + path.read_bytes())
    return made.hexdigest()


def _bytes(value: Any) -> Iterable[bytes]:
    """A value of arrays, numbers and texts as bytes."""
    if is_dataclass(value):
        for field in fields(value):
            yield from _bytes(getattr(value, field.name))
    elif isinstance(value, np.ndarray):
        yield str((value.dtype, value.shape)).encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, tuple):
        yield str(len(value)).encode()
        for item in value:
            yield from _bytes(item)
    else:
        yield repr(value).encode()


def name_of(point: Point) -> str:
    """Name of a point in the database: JSON with sorted keys."""
    return json.dumps(dict(point), sort_keys=True, separators=(",", ":"))
