"""The trees of a product in its pose: searched for its other parts first, onto a base, with the
screws driven in afterwards."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import zip_longest
from math import inf

import numpy as np

from factory.api import PAG, Node, Template, product_geometry
from factory.apps.planning.bases import EQUAL, likely, worth
from factory.apps.planning.blocking import NO_RELATION, Blocking, Unheld
from factory.apps.planning.divisions import KnownDivisions
from factory.apps.planning.drivers import Drivers
from factory.apps.planning.exact import Expected
from factory.apps.planning.falling import held_by, senseless
from factory.apps.planning.fastening import fastened, renumbered
from factory.apps.planning.judging import Judged
from factory.apps.planning.parts import InPlace
from factory.apps.planning.searching import Aim, Sought, Trees, least, trees
from factory.apps.planning.subsets import BLOCKED, MOST, ROOT_AXIS, Stance
from factory.apps.planning.threads import threads
from factory.apps.planning.turning import only
from factory.apps.planning.writing import leaves, planned_product
from factory.floor.mating.mating import matings
from factory.support.allowance import Allowance
from factory.support.arrays import Array

DWELL = 1.0
"""The time that a driver turns a screw [s], as its template states."""


@dataclass(frozen=True)
class Seeking:
    """A search for the trees of a `source` whose blocking `graphs` say what rests on what, in some
    `stances`; `screws`: the units that are screws. `told` is called with each tree."""

    source: InPlace
    graphs: Blocking
    screws: tuple[int, ...]
    stances: tuple[Stance, ...]
    expected: Expected
    templates: Mapping[str, Template] = field(repr=False)
    aim: Aim
    told: Callable[[Judged], None] = field(repr=False)
    known: KnownDivisions = field(default_factory=KnownDivisions, compare=False, repr=False)

    def trees(self, budget: Allowance) -> Trees:
        """Candidate trees."""
        return self._trees(self.screws, (), budget)

    def _trees(self, screws: tuple[int, ...], plain: Collection[int], budget: Allowance) -> Trees:
        """Candidate trees if some units are screws, and others are joined as other parts although
        they are rings on screws (`plain`): those onto the likeliest base, in which as little falls
        as can be, and if something does, or they are slower, in turn with those in which neither
        matters."""
        assert self.graphs.feet is not None
        whole = replace(self.graphs, worth=worth(self.graphs, self.graphs.feet.mass, screws))
        if len(self._task(whole, screws, plain, budget)[1]) > MOST:
            return self._with(screws, plain, budget, whole)
        free = replace(whole, rests=NO_RELATION, worth=np.zeros(0))
        fastest = least(self._task(free, screws, plain, budget)[0]) or (inf, inf)
        based, seconds = self._based(whole, screws, plain, budget)
        onto_base = self._with(screws, plain, budget, based)
        others = Trees((), optimal=True)
        if seconds > EQUAL * fastest[1] or any(judged.senseless for judged in onto_base.all):
            others = self._with(screws, plain, budget, free)
        firm, seen = held_by(whole, screws), dict[object, Judged]()
        turns = zip_longest(onto_base.all, others.all)
        for judged in (judged for pair in turns for judged in pair if judged is not None):
            falls, under = senseless(firm, judged.tree)
            odd = based.base >= 0 and based.base != leaves(judged.tree)[0]
            sense = replace(judged, falls=falls, under=under + odd)
            seen.setdefault((judged.tree, judged.stance), sense)
        return Trees(tuple(seen.values()), onto_base.optimal and others.optimal)

    def _based(
        self, whole: Blocking, screws: Collection[int], plain: Collection[int], budget: Allowance
    ) -> tuple[Blocking, float]:
        """The graphs with the likeliest base with which nothing costs more than with any, and the
        cycle then [s]."""
        tried = [whole.base] if whole.base >= 0 else likely(whole)
        free = least(self._task(replace(whole, base=-1), screws, plain, budget)[0]) or (inf, inf)
        for unit in tried:
            graphs = replace(whole, base=unit)
            price, seconds = least(self._task(graphs, screws, plain, budget)[0]) or (inf, inf)
            if price <= free[0] or whole.base >= 0:
                return graphs, seconds
        return whole, free[1]

    def without(self, unheld: Collection[Unheld]) -> Seeking | None:
        """The same, with more known that no hand can hold; None if all of it was known."""
        more = self.graphs.unheld | {*unheld}
        if more == self.graphs.unheld:
            return None
        return replace(self, graphs=replace(self.graphs, unheld=more))

    def _task(
        self,
        graphs: Blocking,
        screws: Collection[int],
        plain: Collection[int],
        budget: Allowance,
    ) -> tuple[Sought, list[int]]:
        """The search for the units without screws and what follows these, and these units."""
        made = threads(self.source, graphs, tuple(screws), plain)
        after = {*screws, *(ring for one in made for ring in one.follow)}
        rest = [n for n in range(len(graphs)) if n not in after]
        groups = [[n, *(one.screw for one in made if one.into == n)] for n in rest]
        others = graphs.grouped(groups) if after else graphs
        prices = _kept_prices(only(self.source, others.labels), self.templates)
        search = self.aim, budget, self.told, self.stances, self.known
        return Sought(others, self.expected, prices, *search), rest

    def _with(
        self,
        screws: tuple[int, ...],
        plain: Collection[int],
        budget: Allowance,
        graphs: Blocking,
    ) -> Trees:
        """Candidate trees, with screws; `plain`: rings that are joined as other parts."""
        task, rest = self._task(graphs, screws, plain, budget)
        candidates = trees(task)
        if not screws:
            return candidates
        made, drivers = threads(self.source, graphs, screws, plain), Drivers(self.source)
        joined = [
            fastened(graphs, renumbered(judged, rest), made, DWELL, drivers)
            for judged in candidates.all
        ]
        if all(left for _, left in joined):
            lost = min((left for _, left in joined), key=len)
            kept = tuple(n for n in screws if n not in lost)
            return self._trees(kept, {*plain, *lost}, budget)
        return Trees(tuple(judged for judged, left in joined if not left), optimal=False)


def _kept_prices(source: InPlace, templates: Mapping[str, Template]) -> Callable[[Stance], Array]:
    """The prices (2, n) of a source's units by stance, if the inputs of each come along x, or y, of
    the floor. Sub-trees that are kept have operations that may be blocked along one axis, or on one
    side, and not on another; all other units cost nothing."""
    kept = {keep.label: keep for keep in source.kept}
    labels = [label for label, _ in source.units()]

    @cache
    def price(label: str, stance: Stance) -> float:
        parts = tuple(part for part in source.parts if part.label in kept[label].parts)
        alone = replace(source, parts=parts, kept=(kept[label],))
        pag = PAG(label, planned_product(alone, label, stance.rotation).pag.nodes)
        judged = matings(Node.expand(pag, templates), product_geometry(pag, source.files))
        return BLOCKED * len(judged.of_kind("blocked"))

    def prices(stance: Stance) -> Array:
        x, y, z = stance.axes
        table = np.zeros((2, len(labels)))
        for number, label in enumerate(labels):
            if label in kept:
                table[ROOT_AXIS, number] = price(label, stance)
                table[1 - ROOT_AXIS, number] = price(label, Stance((y, x, z), stance.up))
        return table

    return prices
