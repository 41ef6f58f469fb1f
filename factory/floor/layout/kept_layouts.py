"""Layouts that were found, in the user's cache: what `build` has laid out is not laid out again by
`run`.

An entry is named by a digest of all that `lay_out` depends on: the factory and its solids, which
follow from the product's text, its meshes, the operations and the robot types; what is asked for;
and the program. It holds the table of the layout and its certificate. The table is read back as a
`layout.json` is; the certificate is taken as it was proved, since the entry has the digest of its
content, and is of this factory, or of none.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from factory.floor.geometry.solids import Product
from factory.floor.layout.certificate import Certificate
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.layout import Layout
from factory.floor.layout.saved import LayoutTable
from factory.floor.mating.mating import judged
from factory.support.cache import content, digest, load, program, store
from factory.support.collector import collector_paused
from factory.support.tables import table_of, value_of
from factory.theory.plant.factory import Factory

FOLDER = "layouts"
"""Where they are kept, in the user's cache."""

MANY = 12
"""A factory of fewer robots is laid out at once, and not kept."""

ROOMS = ("support", "theory", "floor")
"""The folders of the program that a layout depends on."""

PACKAGES = ("numpy", "scipy", "shapely", "trimesh", "manifold3d")


@dataclass(frozen=True, slots=True)
class FoundLayout:
    """A layout as it is kept: its table, its certificate, and the least travels of robots (index)
    that the search has found out [m]."""

    FOLDER: ClassVar[str] = FOLDER

    table: LayoutTable
    certificate: Certificate
    travels: tuple[tuple[int, float], ...] = ()

    def laid_out(self, factory: Factory, product: Product, hands: Hands) -> Layout:
        """The layout, as `hands` have learned of it. Raises ValueError where it is of another
        factory, or its certificate does not hold."""
        if not self.certificate.is_of(factory):
            raise ValueError("the certificate is of another factory")
        laid = self.table.laid_out(factory, product, factory, self.certificate)
        hands.travels.update(self.travels)
        return laid


@collector_paused()
def kept_or(
    find: Callable[[], Layout], factory: Factory, product: Product, hands: Hands, *asked: object
) -> Layout:
    """The layout of a factory, with hands to choose from, for what is `asked`: as it is kept, or
    else as `find` finds it, which is kept then."""
    if len(factory.robots) < MANY:
        return find()
    name = _name(factory, product, hands, asked)
    entry = load(FOLDER, name)
    if entry is not None:
        with suppress(ValueError):
            kept = value_of(FoundLayout, json.loads(entry))
            return kept.laid_out(judged(factory, product), product, hands)
    layout = find()
    assert layout.certificate is not None
    made = FoundLayout(LayoutTable.of(layout), layout.certificate, (*hands.travels.items(),))
    store(FOLDER, name, json.dumps(table_of(made)).encode())
    return layout


def _name(factory: Factory, product: Product, hands: Hands, asked: object) -> str:
    solids = product.solids, product.low, product.high
    return digest(content((factory, solids, hands.chosen_by, asked)), _program())


def _program() -> str:
    package = Path(__file__).resolve().parents[2]
    inside = (path for room in ROOMS for path in (package / room).rglob("*") if path.is_dir())
    return program((*(package / room for room in ROOMS), *sorted(inside)), *PACKAGES)
