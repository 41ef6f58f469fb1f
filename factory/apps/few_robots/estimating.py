"""Estimates of robots and cycle times for forms and lines, without a layout."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

from factory.api import Factory, LayoutSearch, Node, NoGrip, Operation, Pace, Plan, Product, Project
from factory.apps.few_robots.aim import STEP
from factory.apps.few_robots.bundles import Filling
from factory.apps.few_robots.candidate import Candidate
from factory.apps.few_robots.folding import Line
from factory.apps.few_robots.forms import FormsTask, Order, best_forms, written_forms
from factory.apps.few_robots.lines import SLACKS, Shift, admitted
from factory.apps.few_robots.parallel import Branches
from factory.support.allowance import Allowance
from factory.support.boxes import Box

WIDE = 1.3
"""Ratio of successive bounds on cycles for LARGE products (else `aim.STEP`)."""

ROUNDS = 8
"""Number of times that forms are chosen again because no hand fits."""

LARGE = 400
"""Number of labels from which a product is large."""

FILLED = 1.12
"""Ratio of successive limits of the lines' loads."""

FEWER = 0.7
"""Least number of robots that is estimated, over the number asked for."""

SHARED = 8.0
"""Greatest duration of a tour over its share of the work, where a number of robots is asked for."""

ORDERS: tuple[Order, ...] = ("lines", "fewest", "robots")
"""The orders in which forms are compared."""

NEAR = 1.3
"""Ratio of cycle times from which one estimate is clearly faster; layouts hide smaller ones."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate for forms and lines: the number of `robots`, tools included, and the cycle time [s];
    the `forms`, and the `filling` of the lines, None for one robot for each label; the number of
    labels without a hand beyond those of the product as written, `bare`."""

    robots: int
    seconds: float
    forms: Mapping[str, int]
    filling: Filling | None = None
    bare: int = 0

    def beats(self, other: Estimate) -> bool:
        """Whether it has no more robots than another and is clearly faster, or equals it."""
        if self.bare > other.bare:
            return False
        faster = self.seconds * NEAR <= other.seconds
        same = self.robots == other.robots and abs(self.seconds - other.seconds) < 1e-9
        return same or (self.robots <= other.robots and faster)


@dataclass(frozen=True)
class Estimator:
    """Estimates for the product of a `project` with one robot for each label and no relays;
    `branches` that its factories have several times. `refused`: forms (a join and its pile) that
    leave a label without a hand, as has been seen so far. `bare`: forms are those of the fewest
    lines, whatever these leave without a hand."""

    project: Project
    branches: Branches = ()
    refused: set[tuple[str, int]] = field(default_factory=set, compare=False)
    bare: bool = False
    _alone: dict[tuple[int, ...], Project] = field(default_factory=dict, compare=False)
    _known: dict[object, tuple[dict[str, int], float]] = field(default_factory=dict, compare=False)

    @cached_property
    def tasks(self) -> tuple[FormsTask, ...]:
        """The tasks by which forms are estimated, one for each product."""
        return tuple(_task(one) for one in self.project.each)

    @cached_property
    def is_free(self) -> bool:
        """Whether some join may have another form."""
        return any(task.free for task in self.tasks)

    @cached_property
    def written(self) -> Candidate:
        """The product as written."""
        return self.candidate(self._written)

    @cached_property
    def _written(self) -> dict[str, int]:
        return {x: pile for task in self.tasks for x, pile in written_forms(task).items()}

    def candidate(self, forms: Mapping[str, int], filling: Filling | None = None) -> Candidate:
        """The product with these forms, and with lines if a filling is given."""
        alone = self.alone(forms)
        one = Candidate(alone, forms, None, self.branches, alone)
        if filling is None or not one.is_possible:
            return one
        project = alone.with_plan(self._shift(alone).plan(filling))
        return Candidate(project, forms, filling, self.branches, alone)

    def front(self, budget: Allowance, robots: float = inf) -> list[Estimate]:
        """The estimates with lines of which no other is clearly better (see `estimates`)."""
        front: list[Estimate] = []
        for one in self.estimates(budget, robots):
            if one.filling is not None and not any(other.beats(one) for other in front):
                front = [other for other in front if not one.beats(other)] + [one]
        return front

    def estimates(self, budget: Allowance, robots: float = inf) -> Iterator[Estimate]:
        """All estimates with at most `robots` robots and no more blocked operations than the
        product as written, for as many forms as the budget allows, those as written first: for
        each, the one with one robot for each label, then those with lines."""
        tried = {tuple(self.written.forms.values())}
        yield from self.of(self.written, robots)
        orders = ORDERS[1:2] if self.bare else ORDERS
        for order in orders if self.is_free else ():
            for one in self.held(order, budget, robots=robots):
                key = tuple(one.forms.values())
                if key not in tried:
                    tried.add(key)
                    yield from self.of(one, robots)

    def held(
        self, order: Order, budget: Allowance, share: float = 1.0, robots: float = inf
    ) -> Iterator[Candidate]:
        """Those with the best forms under each bound, as long as no more than a `share` of the
        budget is used. Forms that leave more labels without a hand than those of the product as
        written are refused from then on, and chosen again."""
        before: Mapping[str, int] = {}
        for bound in self.bounds(order, robots):
            for _ in range(ROUNDS):
                if budget.over(share):
                    return
                forms, _ = self._best(order, bound, frozenset(self.refused))
                if forms == before:
                    break
                budget.spend()
                one, before = self.candidate(forms), forms
                if not one.is_possible:
                    break
                worse = not self.bare and one.bare > self.written.bare
                blame = {*blamed(one.single, forms)} if worse else set()
                if blame <= self.refused:
                    yield one
                    break
                self.refused.update(blame)

    def of(self, one: Candidate, robots: float = inf) -> Iterator[Estimate]:
        """The estimates of a candidate with a robot for each label, also with lines; none where
        more operations are blocked than in the product as written."""
        if one.is_possible and one.blocked <= self.written.blocked:
            bare = max(0, one.bare - self.written.bare)
            yield from (replace(e, bare=bare) for e in self._filled(one, robots))

    def bounds(self, order: Order, robots: float = inf) -> Iterator[float]:
        """Bounds on estimated cycles: none, then those that can be kept, the longest first. Where a
        number of `robots` is asked for, they begin at SHARED times the work of each."""
        yield inf
        pace, pairs = self.tasks[0].pace, [(task, x) for task in self.tasks for x in task.nodes]
        bound = sum(pace.rest(task.size(label)) + pace.lost for task, label in pairs)
        bound = min(bound, SHARED * 2 * bound / robots) if robots < inf else bound
        step = STEP if len(pairs) < LARGE else WIDE
        while self._best(order, bound)[1] == 0.0:
            yield bound
            bound /= step

    @cached_property
    def _alike(self) -> frozenset[tuple[str, int]]:
        """Forms that no mix has: with them products that begin alike would not any more."""
        forest = self.project.approached
        outputs = (forest.robots[o.carrier].operations for o in forest.dropoffs)
        begins = (forest.operations[numbers[0]].written for numbers in outputs)
        is_mix = self.project.pag.mix is not None
        return frozenset((x, pile) for x in begins for pile in (0, 1) if is_mix)

    def _best(
        self, order: Order, bound: float, refused: frozenset[tuple[str, int]] = frozenset()
    ) -> tuple[dict[str, int], float]:
        """The best forms of the joins of all products, those of what is common as the first product
        has them; and the sum of estimated cycles above a bound [s]."""
        key = order, bound, refused
        if key not in self._known:
            tasks = (replace(t, order=order, refused=refused | self._alike) for t in self.tasks)
            best = [best_forms(task, bound) for task in tasks]
            chosen = {x: pile for piles, _ in reversed(best) for x, pile in piles.items()}
            self._known[key] = chosen, sum(over for _, over in best)
        return self._known[key]

    def _filled(self, one: Candidate, robots: float) -> Iterator[Estimate]:
        """The estimates of a candidate with one robot for each label, and with lines for each
        filling."""
        forms = one.forms
        shift, tried = self._shift(one.single), set[tuple[Line, ...]]()
        large = len(shift.timing.factory.making) >= LARGE
        if shift.count(()) <= robots:
            yield Estimate(shift.count(()), shift.seconds(()), forms)
        for filling, lines in shift.filled(FILLED, SLACKS[:1] if large else SLACKS, large):
            if not lines or lines in tried:
                continue
            tried.add(lines)
            count = shift.count(lines)
            if robots == inf or FEWER * robots <= count <= robots:
                yield Estimate(count, shift.seconds(lines), forms, filling)

    def _shift(self, project: Project) -> Shift:
        shared = project.catalogue, self.tasks[0].pace

        def of(factory: Factory, forest: Shift | None = None) -> Shift:
            boxes = _boxes(factory, project.product)
            return Shift.of(factory, shared[0], boxes, shared[1], forest)

        alone = of(project.approached)
        return of(project.planned, alone) if project.pag.mix else alone

    def alone(self, forms: Mapping[str, int]) -> Project:
        """The product with these forms, and one robot for each label."""
        key = tuple(forms.values())
        if key not in self._alone:
            other = {x: pile for x, pile in forms.items() if pile != self._written[x]}
            self._alone[key] = self.project.with_plan(Plan(other))
        return self._alone[key]


def _task(project: Project) -> FormsTask:
    pag, templates, product = project.pag, project.templates, project.product
    admits = admitted(Node.expand(pag, templates), product) if pag.is_shaped else {}
    boxes = LayoutSearch(project.compiled, product).payloads
    return FormsTask(pag, templates, admits, boxes, Pace.of(project.settings))


def _boxes(factory: Factory, product: Product) -> Mapping[str, Box]:
    return LayoutSearch(factory, product.repeated(factory)).payloads


def blamed(project: Project, forms: Mapping[str, int]) -> Iterator[tuple[str, int]]:
    """For each robot that no hand fits, the form (a join and its pile) that is the likely cause: of
    the joins on this robot the one whose incoming parts are most in the way, else the one at which
    it delivers; none where these have no such form."""
    factory = project.plain
    robots = {robot.name: robot for robot in factory.robots}
    for no_grip in project.no_grips:
        robot = robots[no_grip.robot]
        operations = [factory.operations[number] for number in robot.operations]
        piles = [o for o in operations if forms.get(o.label, Plan.THIRD) != Plan.THIRD]
        carried = [o for o in piles if o.carrier == robot.index] or piles
        if carried:
            label = max(carried, key=lambda o: _in_the_way(no_grip, o, factory)).label
            yield label, forms[label]


def _in_the_way(no_grip: NoGrip, operation: Operation, factory: Factory) -> tuple[int, int]:
    """Number of parts that come in an operation and are in the way of hands; then how early it
    is."""
    carrier = operation.template.carrier - 1
    incoming = {
        part
        for slot, label in enumerate(operation.before)
        if slot != carrier and label in factory.contents
        for part in factory.contents[label]
    }
    return sum(part in incoming for miss in no_grip.misses for part in miss.parts), -operation.index
