"""Trees laid out as factories, and the best of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite
from time import perf_counter

import numpy as np

from factory.api import (
    FactoryError,
    Ground,
    InputError,
    Plan,
    Product,
    Project,
    Settings,
    Template,
    load_catalogue,
    pace,
    product_geometry,
    read_pag,
)
from factory.apps.few_robots.sharing import with_lines
from factory.apps.planning.bases import EQUAL
from factory.apps.planning.blocking import Unheld
from factory.apps.planning.exact import Tree
from factory.apps.planning.judging import Judged
from factory.apps.planning.parts import InPlace
from factory.apps.planning.searching import Aim
from factory.apps.planning.subsets import Stance
from factory.apps.planning.writing import Screwed, planned_product, screw_lines, screws_in
from factory.apps.planning.writing import Tree as LabelTree
from factory.support.allowance import Allowance
from factory.support.errors import listing

LAID = 120
"""Trees are laid out until they have more robots together, unless a time is given."""

ALIKE = 0.01
"""Figures that differ by less than this share are equal."""


class OutOfTime(Exception):
    """The time is over, or a signal came, while parts are decomposed for a first layout."""


@dataclass(frozen=True)
class LaidOut:
    """A judged tree, as a `tree` of labels and as a `project`; `kinds`: the number of different
    sub-assemblies; `lines`: the screws that share a robot, and `apart`: why others do not."""

    judged: Judged
    tree: LabelTree = field(repr=False)
    project: Project = field(repr=False)
    kinds: int
    lines: tuple[tuple[str, ...], ...] = ()
    apart: tuple[str, ...] = ()

    @cached_property
    def blocked(self) -> int:
        """The number of operations that `check` calls blocked."""
        matings = self.project.matings
        return len(matings.of_kind("blocked")) if matings else 0

    @cached_property
    def held(self) -> int:
        """The number of sub-assemblies that no hand can hold."""
        return len(self.project.no_grips)

    @cached_property
    def seconds(self) -> float:
        """The predicted cycle time [s]; infinite if there is no layout."""
        try:
            return pace(self.project.layout, self.project.settings)[0].seconds
        except FactoryError:
            return inf

    @property
    def robots(self) -> int:
        """The number of robots, tools included."""
        return len(self.project.factory.robots)

    @cached_property
    def area(self) -> float:
        """The area of the floor [m²]; infinite if there is no layout."""
        try:
            return float(self.project.layout.area)
        except FactoryError:
            return inf

    @property
    def aims(self) -> Mapping[Aim, float]:
        """Its figure for each aim."""
        return {"cycle": self.seconds, "robots": float(self.robots), "floor": self.area}

    def rank(self, aim: Aim) -> tuple[float, ...]:
        """The rank of a factory, less is better: blocked operations, sub-assemblies that cannot be
        held, the aim, then the number of kinds of sub-assemblies."""
        aims = dict(self.aims)
        order = [aims.pop(aim), *aims.values()]
        rough = [float(np.round(np.log(max(x, 1e-9)) / ALIKE)) for x in order]
        return self.blocked, self.held, rough[0], self.kinds, *rough[1:]

    def is_behind(self, best: LaidOut) -> bool:
        """Whether another is better even if this one's layout is perfect: fewer operations are
        blocked, or fewer sub-assemblies cannot be held. One whose screws share robots has another
        layout, in which they do not."""
        if self.lines:
            return False
        return (self.blocked, self.held) > (best.blocked, best.held)


class Layouts:
    """The layouts of a source's trees. The geometry is computed once per stance: meshes are
    decomposed into convex bodies, and `report` is called with how many are."""

    def __init__(
        self,
        source: InPlace,
        templates: Mapping[str, Template],
        settings: Settings,
        report: Callable[[int, int], None] = lambda *_: None,
    ) -> None:
        self.report = report
        self.source, self.templates, self.settings = source, templates, settings
        self.catalogue = load_catalogue()
        self._products: dict[Stance, Product] = {}
        self._units = [label for label, _ in source.units()]
        self._kinds = {part.label: part.kind for part in source.parts}

    def drafted(self, judged: Judged) -> LaidOut:
        """A judged tree as a project, without its geometry."""
        tree = self.labelled(judged.tree)
        made = planned_product(self.source, tree, judged.stance.rotation)
        text = next(iter(made.files.values())).decode()
        pag = read_pag(text, self.templates, folder=None)
        project = Project(pag, self.templates, self.catalogue, self.settings, Ground())
        return LaidOut(judged, tree, project, self.kinds(judged.tree))

    def of(self, judged: Judged) -> LaidOut:
        """A judged tree as a project, which is laid out on demand. Raises as `report` does."""
        laid = self.drafted(judged)
        tree, plain = laid.tree, laid.project
        if judged.stance not in self._products:
            entered = next((one.entered for one in self._products.values()), None)
            product = product_geometry(
                plain.pag, self.source.files, report=self.report, entered=entered
            )
            twin = self.source.product, judged.stance.rotation
            self._products[judged.stance] = replace(product, twin=twin)
        project = plain.with_product(self._products[judged.stance], as_drawn=True)
        lines = [one for line in screw_lines(tree, self._kinds) for one in _lines(project, line)]
        why = self._spread(screws_in(tree), lines)
        shared = with_lines(project, lines)
        return replace(laid, project=shared, lines=tuple(lines), apart=why)

    def _spread(self, screws: Sequence[str], lines: Sequence[Sequence[str]]) -> tuple[str, ...]:
        """Why equal screws are not on one line."""
        line = {screw: number for number, line in enumerate(lines) for screw in line}
        alike: dict[str, list[str]] = {}
        for screw in screws:
            alike.setdefault(self._kinds.get(screw, screw), []).append(screw)
        why = "they come to several sub-assemblies, or from several sides"
        return tuple(
            f"{listing(several, 12)} do not all share a driver: {why}"
            for several in alike.values()
            if len({line.get(screw, screw) for screw in several}) > 1
        )

    def or_alone(self, laid: LaidOut) -> LaidOut:
        """A layout whose screws share robots or, where there is none of them, or hands cannot hold
        what they could hold alone, the one in which they do not."""
        if not laid.lines or (isfinite(laid.seconds) and not laid.held):
            return laid
        project = laid.project.with_plan(Plan())
        alone = replace(laid, project=project, lines=())
        fits = isfinite(laid.seconds)
        if (fits and laid.held <= alone.held) or not isfinite(alone.seconds):
            return laid
        why = "no hand holds them all" if fits else "no layout is found"
        apart = [f"{listing(line, 12)} have a driver each: {why}" for line in laid.lines]
        return replace(alone, apart=(*laid.apart, *apart))

    def unheld(self, laid: LaidOut) -> frozenset[Unheld]:
        """What no hand can hold, by the numbers of units, and what it is joined to then."""
        pairs = [(g.parts, g.beside) for g in laid.project.no_grips if not g.line]
        of = {part.label: n for n, (_, u) in enumerate(self.source.units()) for part in u}
        sides = [[frozenset(map(of.__getitem__, side)) for side in pair] for pair in pairs]
        return frozenset((mine, theirs - mine) for mine, theirs in sides)

    def labelled(self, tree: Tree) -> LabelTree:
        """A tree with the labels of units in place of their numbers."""
        if isinstance(tree, int):
            return self._units[tree]
        if isinstance(tree, Screwed):
            return Screwed(self.labelled(tree.tree), tuple(self._units[n] for n in tree.screws))
        return tuple(self.labelled(below) for below in tree)

    def kinds(self, tree: Tree) -> int:
        """The number of different sub-assemblies of a tree, by the kinds of their units."""
        sets: set[tuple[str, ...]] = set()

        def below(tree: Tree) -> tuple[str, ...]:
            if isinstance(tree, int):
                return (self._kinds.get(self._units[tree], self._units[tree]),)
            parts = (tree.tree, *tree.screws) if isinstance(tree, Screwed) else tree
            kinds = tuple(sorted(kind for one in parts for kind in below(one)))
            sets.add(kinds)
            return kinds

        below(tree)
        return len(sets)

    def best(
        self,
        trees: Sequence[Judged],
        aim: Aim,
        budget: Allowance,
        report: Callable[[LaidOut], None] = lambda _: None,
        before: Sequence[LaidOut] = (),
    ) -> LaidOut:
        """The best of those from `before` and some trees, or of those about as good the one that
        makes most sense. As many are laid out as the budget permits, at least one: those of LAID
        robots together, or as many as time permits, where the next one is assumed to take as long
        as the longest did; what is known to be worse before it is laid out counts as well. A
        KeyboardInterrupt, or OutOfTime, ends the layout of any but the first."""
        every = [*before]
        longest, robots = 0.0, 0
        for judged in trees:
            robots += judged.robots
            enough = robots > LAID if budget.seconds == inf else budget.left < longest
            if every and (enough or budget.left == 0.0):
                break
            begin = perf_counter()
            try:
                laid = self.of(judged)
                if not (every and laid.is_behind(best_of(every, aim))):
                    laid = self.or_alone(laid)
                    laid.rank(aim)
                    every.append(laid)
            except (KeyboardInterrupt, OutOfTime):
                if not every:
                    raise
                break
            report(best_of(every, aim))
            longest = max(longest, perf_counter() - begin)
        return best_of(every, aim)


def best_of(every: Sequence[LaidOut], aim: Aim) -> LaidOut:
    """The best of some layouts by rank or, of those whose aim is equal for a person, the one of
    whose sub-assemblies the least falls."""
    best = min(every, key=lambda one: one.rank(aim))
    equal = [
        one
        for one in every
        if one.rank(aim)[:2] == best.rank(aim)[:2] and one.aims[aim] <= EQUAL * best.aims[aim]
    ]
    return min(equal or [best], key=lambda one: (one.judged.senseless, one.rank(aim)))


def _lines(project: Project, screws: Sequence[str]) -> list[tuple[str, ...]]:
    """The fewest lines found for some screws, those of one screw left out."""
    lines: list[list[str]] = []
    for screw in screws:
        for line in lines:
            try:
                with_lines(project, [[*line, screw]])
            except InputError:
                continue
            line.append(screw)
            break
        else:
            lines.append([screw])
    return [tuple(line) for line in lines if len(line) > 1]
