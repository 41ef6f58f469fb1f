"""The project of a cell: the factory of an arm with the ground that it is laid out on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from factory.api import (
    Factory,
    Ground,
    InputError,
    Layout,
    LayoutSearch,
    Product,
    Project,
    Settings,
)
from factory.apps.arms.arming import armed, from_one_side, on_rails, piles_of
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.crew import arms_in, asked_arms
from factory.apps.arms.joint_way import WayLimits
from factory.apps.arms.model import KINDS, ArmModel
from factory.support.errors import Position


@dataclass(frozen=True, slots=True)
class CellGround(Ground):
    """The floor of a cell.

    Attributes:
        model: the kind of its arms.
        arms: the arms.
        source: the project of the product as it was given.
        rails: by label of what carriers bring, its project on rails, from which the carrier's line
            is taken; the first is that of the product.
    """

    model: ArmModel | None = field(default=None, compare=False, repr=False)
    arms: tuple[CellArm, ...] = field(default=(), compare=False, repr=False)
    source: Project | None = field(default=None, compare=False, repr=False)
    rails: Mapping[str, Project] = field(default_factory=dict, compare=False, repr=False)

    @property
    def machines(self) -> str:
        return "pads, feeders and the tray"

    @property
    def is_named(self) -> bool:
        return self.model is None or self.model.kind in KINDS

    @property
    def reach_bound(self) -> bool:
        return True

    def lay_out(self, factory: Factory, product: Product, settings: Settings, *_: Any) -> Layout:
        """The layout of the cell. Raises RunError (Layout, Unreachable, NoWay)."""
        from factory.apps.arms.laying import laid_out

        assert self.model is not None
        joined = LayoutSearch(factory, product).judged
        factory, product = from_one_side(joined), product.repeated(factory)
        rails = dict[int, Layout]()
        for label, project in self.rails.items():
            carrier = factory.by_label[label].carrier
            rails[carrier] = project.with_settings(settings).layout
        pace = WayLimits(settings.speed, settings.acceleration)
        return laid_out(factory, product, rails, self.model, pace)


class CellProject(Project):
    """The project of a product that is made by a cell."""

    @cached_property
    def hands(self) -> Any:
        """The hands of the carrier are chosen on rails; an arm has a tool of its own."""
        assert isinstance(self.ground, CellGround)
        return next(iter(self.ground.rails.values())).hands

    @cached_property
    def no_grips(self) -> tuple[()]:
        """What an arm cannot hold is found as its cell is laid out."""
        return ()


def with_arm(project: Project, asked: str) -> Project:
    """The project in which arms place all parts but the first.

    Args:
        project: of the product.
        asked: the kind of arm, or the path of its MJCF; with `=2` for two of them.

    Raises InputError: Usage for an unknown kind, BadArm, NoCell for what a cell cannot make.
    """
    return cell_of(project, *asked_arms(asked))


def with_arms(project: Project, table: Mapping[str, Mapping[str, Any]], at: Position) -> Project:
    """The project in which the arms of a table do so.

    Args:
        project: of the product.
        table: what is said of each arm, by its name.
        at: where the table is; the files of arms are named from there.

    Raises InputError: BadValue for a table that is not valid, BadArm, NoCell.
    """
    try:
        return cell_of(project, *arms_in(table, Path(at.file).parent))
    except InputError as error:
        raise InputError(replace(d, position=d.position or at) for d in error.diagnostics) from None


def cell_of(project: Project, model: ArmModel, arms: tuple[CellArm, ...]) -> CellProject:
    """The project in which arms of a kind place all parts but the first. Raises InputError (NoCell)
    for what a cell cannot make."""
    made = armed(project, model, arms)
    piles = made.pag.root, *piles_of(made.pag)
    rails = {pile: on_rails(project, made.pag, pile) for pile in piles}
    values = {one.name: getattr(made, one.name) for one in fields(made)}
    ground = CellGround(model=model, arms=arms, source=project, rails=rails)
    return CellProject(**{**values, "ground": ground})
