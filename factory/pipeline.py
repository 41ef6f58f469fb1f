"""The stages from a PAG to a laid-out factory, for the command line and the Python API.

Stages that need numpy are imported where they begin: a product without shapes needs none to be
checked.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from factory.floor.layout.request import Ground, hands_of
from factory.floor.robots.catalogue import load_catalogue
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings
from factory.support.tables import MISFITS, misfit
from factory.theory.compiler.assigning import beside, shared
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.expanding import Node
from factory.theory.compiler.turning import check_shapes, placed
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates, is_shipped
from factory.theory.plant.approaches import Approach
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_types import Catalogue
from factory.theory.problem.template import Template

if TYPE_CHECKING:
    from factory.floor.geometry.overlapping import DrawnOverlaps
    from factory.floor.geometry.solids import Product
    from factory.floor.layout.hands.choosing import Hands
    from factory.floor.layout.hands.misses import NoGrip
    from factory.floor.layout.layout import Layout
    from factory.floor.layout.saved import LayoutTable
    from factory.floor.mating.findings import Matings


@dataclass(frozen=True)
class Project:
    """A PAG with all that follows from it: its geometry, factory and layout, each computed when it
    is first used.

    Attributes:
        pag: the product assembly graph.
        templates: the operations it is compiled with, by name.
        catalogue: the robot types it is compiled with.
        settings: those that it is laid out for.
        ground: the floor and the variant that it is laid out for.
        plan: the variant of the factory.
        laid: the table of its layout; None where one is searched.
        lowered: by operation, the input that is to be lowered there, if it can be.
        axes: by operation, the axis of the product along which inputs come, if no line tells it.

    Raises InputError (BadValue) where relays are asked for of robots with several tours.
    """

    pag: PAG
    templates: Mapping[str, Template] = field(repr=False)
    catalogue: Catalogue = field(default_factory=load_catalogue, repr=False)
    settings: Settings = field(default_factory=Settings)
    ground: Ground = field(default_factory=Ground)
    plan: Plan = field(default_factory=Plan)
    laid: LayoutTable | None = field(default=None, repr=False)
    lowered: Mapping[str, str] = field(default_factory=dict, repr=False)
    axes: Mapping[str, int] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        self.ground.check(self.pag.mix is not None or bool(self.plan.turns))

    @classmethod
    def of_made(cls, made: Factory | Layout, settings: Settings | None = None) -> Project:
        """The project of a factory or a layout, neither of which is made again. Without `settings`
        they are the default ones, with the clearance of a layout."""
        layout = None if isinstance(made, Factory) else made
        plain = made if isinstance(made, Factory) else (made.plain or made).factory
        ground, stages = Ground(), dict[str, Any](plain=plain, planned=plain)
        if layout is not None:
            settings = settings or Settings(clearance=layout.clearance)
            ground = Ground(relay=layout.plain is not None)
            stages["layout"] = layout
            if plain.period == 1:
                stages["product"] = layout.product
        used = {o.template.name: o.template for o in plain.operations}
        conditions = settings or Settings(), ground, plain.plan
        project = cls(plain.pag, {**all_templates(), **used}, load_catalogue(), *conditions)
        project.__dict__.update(stages)
        return project

    def with_pag(self, pag: PAG) -> Project:
        """The same parts with another PAG."""
        return self._changed({"product"}, pag=pag)

    def with_plan(self, plan: Plan) -> Project:
        """The same product by another plan."""
        same = {"matings", "compiled", "approached"} if plan.forms == self.plan.forms else set()
        return self._changed({"product", *same}, plan=plan)

    def with_settings(self, settings: Settings) -> Project:
        """The same factory under other settings."""
        kept = {"product", "matings", "compiled", "approached", "planned"}
        return self._changed(kept, settings=settings)

    def with_ground(self, ground: Ground) -> Project:
        """The same factory on another ground."""
        kept = {"product", "matings", "compiled", "approached", "planned", "plain", "hands"}
        return self._changed(kept, ground=ground)

    def _changed(self, kept: Collection[str], **values: Any) -> Project:
        """With other values, and what is `kept` of it already."""
        made = replace(self, **values, laid=None)
        made.__dict__.update({name: self.__dict__[name] for name in kept & self.__dict__.keys()})
        return made

    @property
    def file(self) -> Path:
        """The file of the PAG."""
        return Path(self.pag.file)

    @property
    def name(self) -> str:
        """What files about it are called: the name of the PAG's file without its ending."""
        return self.file.stem.strip("<>") or "factory"

    @cached_property
    def product(self) -> Product:
        """The solids of its parts. Raises InputError where a mesh cannot be read."""
        from factory.floor.geometry.product import product_geometry

        return product_geometry(self.pag)

    @cached_property
    def each(self) -> tuple[Project, ...]:
        """A project for each product of a mix, alone; itself for one product."""
        if self.pag.mix is None:
            return (self,)
        from factory.theory.compiler.mixing import lowered_alike

        made, pag = self.with_plan(self._single), self.pag
        alone = [made.with_pag(pag.product(x)).with_product(self.product) for x in pag.products]
        for number, lowered in lowered_alike([project.approached for project in alone]).items():
            alone[number] = alone[number]._changed({"product"}, lowered=lowered)
        return tuple(alone)

    @property
    def has_geometry(self) -> bool:
        """Whether its solids have been computed."""
        return "product" in self.__dict__

    @property
    def approaches(self) -> Mapping[str, Approach]:
        """How the inputs of its operations can come together; empty for a product none of whose
        parts has a shape of its own: its default boxes can always slide."""
        return self.matings.approaches if self.matings else {}

    @cached_property
    def matings(self) -> Matings | None:
        """What was found of how its inputs come together; None for a product of default boxes."""
        if not self.pag.is_shaped:
            return None
        if self.pag.mix is not None:
            from factory.floor.mating.findings import together

            return together(filter(None, (one.matings for one in self.each)))
        return self._judged(as_drawn=False)

    def _judged(self, as_drawn: bool) -> Matings:
        from factory.floor.mating.mating import matings

        nodes = Node.expand(self.pag, self.templates, self._single)
        lowered = {**placed(nodes, self.catalogue), **self.lowered}
        return matings(nodes, self.product, True, lowered, as_drawn, self.axes)

    def with_product(self, product: Product, as_drawn: bool = False) -> Project:
        """The same product with solids that have been computed. `as_drawn`: its ways are those of
        parts as they are drawn, without what the bodies overlap that collide in runs."""
        made = self._changed(set())
        made.__dict__["product"] = product
        if as_drawn:
            made.__dict__["matings"] = made._judged(as_drawn)
        return made

    @property
    def overlaps(self) -> DrawnOverlaps:
        """Which parts overlap in the finished product; none of default boxes."""
        from factory.floor.geometry.overlapping import DrawnOverlaps, overlaps_of

        if not self.pag.is_shaped:
            return DrawnOverlaps()
        return overlaps_of(self.product, *(self.pag.insides if self.pag.mix else ()))

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What is wrong with the geometry of its parts, which touch no others, what overlaps, what
        is blocked, and what no hand can hold, unless the product is of an unlikely size."""
        apart: tuple[Diagnostic, ...] = ()
        if self.pag.is_shaped:
            from factory.floor.geometry.touching_groups import apart_in

            apart = apart_in(self.product, *(self.pag.insides if self.pag.mix else ()))
        product = () if self.pag.is_plain else self.product.warnings
        blocked = self.matings.faults(self.pag.allowed) if self.matings else ()
        sized = any(warning.code == "Size" for warning in product)
        grips = () if sized else tuple(no_grip.warning() for no_grip in self.no_grips)
        overlaps = self.overlaps.faults(self.pag.allowed) if self.pag.is_shaped else ()
        return (*product, *apart, *overlaps, *blocked, *grips)

    @cached_property
    def hands(self) -> Hands:
        """The hands to choose from."""
        unlifted = not self.plain.adjusted and "_unlifted" in self.__dict__
        return self._unlifted if unlifted else hands_of(self.plain, self.product, self.settings)

    @cached_property
    def _unlifted(self) -> Hands:
        """The hands to choose from before robots get lifts for what they bring on their tours."""
        return hands_of(self.planned, self.product, self.settings)

    @cached_property
    def no_grips(self) -> tuple[NoGrip, ...]:
        """What no hand can hold; nothing for a product of default boxes."""
        if not self.pag.is_shaped:
            return ()
        from factory.floor.layout.hands.nearest import no_grips

        return no_grips(self.hands)

    @cached_property
    def plain(self) -> Factory:
        """The factory of the plan, without relays. Raises InputError where there is none."""
        factory, plan = self.planned, self.planned.plan
        if not plan.turns or plan.lifts is not None:
            return factory
        from factory.floor.layout.hands.adjusting import lifts_for
        from factory.theory.compiler.tees import on_stems

        lifts, (_, place) = lifts_for(self._unlifted, self.catalogue), on_stems(factory)
        plan = replace(plan, lifts=frozenset(r for r, at in enumerate(place) if at in lifts))
        return self._shared(plan) if plan.lifts else replace(factory, plan=plan)

    @cached_property
    def planned(self) -> Factory:
        """The same, but for lifts of robots with several tours."""
        if self.plan.turns or self.plan.names or self.plan.tees:
            return self._shared(self.plan)
        if self.pag.mix is None:
            return self.compiled
        from factory.floor.layout.sequencing import sequenced

        inputs = self.pag.mix, self.product, self.catalogue, self.settings
        return self._shared(sequenced(self.approached, *inputs))

    def _shared(self, plan: Plan) -> Factory:
        return shared(self.approached, plan, self.catalogue)

    @cached_property
    def approached(self) -> Factory:
        """`compiled`, with how inputs come together where that is free: in default boxes."""
        from factory.floor.mating.mating import judged

        if self.pag.mix is not None:
            return beside(self.pag, [one.approached for one in self.each])
        return judged(self.compiled, self.product)

    @property
    def _single(self) -> Plan:
        """The plan with a robot for each tour, and without relays."""
        return Plan(self.plan.forms)

    @cached_property
    def compiled(self) -> Factory:
        """The factory of the plan, with a robot for each tour and without relays. Raises InputError
        where there is no such factory."""
        if self.pag.mix is not None:
            return beside(self.pag, [one.compiled for one in self.each])
        factory = compile_pag(
            self.pag, self.templates, self.catalogue, self.approaches, self._single
        )
        check_shapes(factory, self.pag.is_shaped)
        users = {name for name, template in self.templates.items() if not is_shipped(template)}
        tried = users and users & {operation.template.name for operation in factory.operations}
        if tried and not self.axes:  # of those no line is on rails
            from factory.floor.modes.modes import check_modes

            check_modes(factory, [self.templates[name] for name in sorted(tried)], self.product)
        return factory

    @property
    def unshaped(self) -> Factory:
        """The factory of the plan without regard to shapes: no mesh is read. Raises as `plain`."""
        made = compile_pag(self.pag, self.templates, self.catalogue, {}, self.plan)
        return shared(made, self.plan, self.catalogue)

    @cached_property
    def layout(self) -> Layout:
        """The factory laid out: as it was, where it is kept (`laid`), or with relays where its
        ground asks for them. Raises InputError, as BadPlan where what is kept is of another
        factory, and as BadRobot where a drive is too weak; RunError (Layout) where there is no
        room."""
        from factory.engine.mjcf.driving import check_drives

        if self.laid is not None:
            laid = self._laid_out(self.laid)
        else:
            inputs = self.plain, self.product, self.settings, self.hands
            draft = [self.draft] if "draft" in self.__dict__ else []
            laid = self.ground.lay_out(*inputs, *draft)
        check_drives(laid, self.settings)
        return laid

    @cached_property
    def draft(self) -> Layout:
        """The layout of `plain` before it is certified, which may move it."""
        return self.ground.drafted(self.plain, self.product, self.settings, self.hands)

    def _laid_out(self, laid: LayoutTable) -> Layout:
        from factory.floor.mating.mating import judged
        from factory.theory.compiler.relays import with_relays

        factory = plain = judged(self.plain, self.product)
        if relays := self.plan.relays:
            factory = with_relays(plain, relays, self.templates, self.catalogue)
        try:
            return laid.laid_out(factory, self.product, plain)
        except MISFITS as error:
            message = f"the layout that is kept is not of this factory: {misfit(error)}"
            raise InputError(Diagnostic("BadPlan", message)) from error

    @property
    def factory(self) -> Factory:
        """The factory with the relays of its layout if its ground asks for them, else the plain
        one. Raises as these do."""
        return self.layout.factory if self.ground.relays else self.plain


def read(
    path: str | PathLike[str],
    folders: Sequence[str | PathLike[str]] = (),
    settings: Settings | None = None,
    ground: Ground = Ground(),  # noqa: B008 (frozen)
) -> Project:
    """The project of a PAG file. Raises InputError with every error found in the file."""
    templates = all_templates(folders)
    made = load_pag(path, templates), templates, load_catalogue()
    return Project(*made, settings or Settings(), ground)
