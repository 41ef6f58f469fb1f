"""The project of a cell: the factory of an arm with the ground that it is laid out on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from factory.api import Factory, Ground, Layout, Product, Project, Settings, usage_error
from factory.apps.arms.arming import armed, from_one_side, on_rails, piles_of
from factory.apps.arms.joint_way import WayLimits
from factory.apps.arms.model import ArmModel


@dataclass(frozen=True, slots=True)
class CellGround(Ground):
    """The floor of a cell.

    Attributes:
        model: the kind of its arms.
        arms: how many there are.
        source: the project of the product as it was given.
        rails: by label of what carriers bring, its project on rails, from which the carrier's line
            is taken; the first is that of the product.
    """

    model: ArmModel | None = field(default=None, compare=False, repr=False)
    arms: int = field(default=1, compare=False, repr=False)
    source: Project | None = field(default=None, compare=False, repr=False)
    rails: Mapping[str, Project] = field(default_factory=dict, compare=False, repr=False)

    @property
    def machines(self) -> str:
        return "pads, feeders and the tray"

    @property
    def reach_bound(self) -> bool:
        return True

    def lay_out(self, factory: Factory, product: Product, settings: Settings, *_: Any) -> Layout:
        """The layout of the cell. Raises RunError (Layout, Unreachable, NoWay)."""
        from factory.apps.arms.laying import laid_out
        from factory.floor.geometry.fused_bodies import repeated
        from factory.floor.mating.mating import judged

        assert self.model is not None
        factory, product = from_one_side(judged(factory, product)), repeated(product, factory)
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
    name, _, number = asked.partition("=")
    if number not in ("", "1", "2"):
        raise usage_error(f"--arm {asked}: a cell has one arm or two", f"--arm {name}=2")
    return cell_of(project, ArmModel.of(name), int(number or 1))


def cell_of(project: Project, model: ArmModel, arms: int) -> CellProject:
    """The project in which so many arms of a kind place all parts but the first. Raises InputError
    (NoCell) for what a cell cannot make."""
    made = armed(project, model, arms)
    piles = made.pag.root, *piles_of(made.pag)
    rails = {pile: on_rails(project, made.pag, pile) for pile in piles}
    values = {name: getattr(made, name) for name in made.__dataclass_fields__}
    ground = CellGround(model=model, arms=arms, source=project, rails=rails)
    return CellProject(**{**values, "ground": ground})
