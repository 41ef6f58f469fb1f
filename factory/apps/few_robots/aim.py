"""The aim of an allocation, a number of robots or a cycle time; and the least number of robots that
can make a product, tools apart: a lower bound, with its proof.

A part needs one robot. A sub-assembly of two inputs needs max(S1, S2 + 1) robots, where S1 >= S2
are the numbers of the inputs: the input that is made first is held while the other is made. If a
third robot takes both, at least three are needed. This is the Sethi-Ullman number of the tree. No
program needs fewer, folded or not: a robot holds each part and sub-assembly until it is joined.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import Literal

from factory.api import NOPART, PAG, Factory, Node, Settings, Template
from factory.apps.few_robots.parallel import Branches

SHOWN = 6
"""Number of labels of a proof that are shown."""


@dataclass(frozen=True, slots=True)
class Least:
    """The least `robots` that can hold a product while it is made, the kinds of `tools` that it
    takes besides, and the labels on the way from the product down to where so many are needed, with
    what each needs (`path`)."""

    robots: int
    tools: int
    path: tuple[tuple[str, int], ...]

    @property
    def total(self) -> int:
        """Robots and tools."""
        return self.robots + self.tools

    def __str__(self) -> str:
        """The bound and its proof, in words."""
        words = f"'{self.path[0][0]}' needs at least {self.total} robots"
        if self.tools:
            tools = "1 tool" if self.tools == 1 else f"{self.tools} tools"
            words += f": {self.robots} carriers and {tools}"
        return words + self._proof()

    def _proof(self) -> str:
        """The labels on the path at which one carrier fewer is needed."""
        steps = [b for a, b in pairwise(self.path) if a[1] > b[1] > 1]
        words = ", ".join(f"'{label}' needs {needs}" for label, needs in steps[:SHOWN])
        more = ", ..." if len(steps) > SHOWN else ""
        return f" ({words}{more})" if steps else ""


Joins = Mapping[str, tuple[Template, Sequence[str]]]
"""For each label the template that makes it, of which inputs: each after its inputs."""


def least_robots(pag: PAG, templates: Mapping[str, Template]) -> Least:
    """The bound for a product; for a mix, of the product that needs most, with the tools of all.
    Linear."""
    nodes = Node.expand(pag, templates).values()
    return _least({n.label: (n.template, n.inputs) for n in nodes}, pag.products)


def least_of(factory: Factory, templates: Mapping[str, Template]) -> Least:
    """The bound for the product of a factory with a robot for each tour: the same, from its
    operations where they are in the forms that are written."""
    if factory.plan.forms:
        return least_robots(factory.pag, templates)
    made = reversed(factory.making)
    return _least({o.label: (o.template, o.taken) for o in made}, factory.products)


def _least(joins: Joins, products: Sequence[str]) -> Least:
    """The bound for products."""
    needs: dict[str, int] = {}
    for label, (template, inputs) in joins.items():
        needs[label] = _needed(template, sorted([needs[x] for x in inputs]))
    used = {template.name: template for template, _ in joins.values()}
    root = label = max(products, key=needs.__getitem__)
    path = [(root, needs[root])]
    while (inputs := joins[label][1]) and needs[label] > 1:
        label = max(inputs, key=lambda x: needs[x])
        path.append((label, needs[label]))
    return Least(needs[root], sum(len(template.tools()) for template in used.values()), tuple(path))


def _needed(template: Template, inputs: list[int]) -> int:
    """How many robots it takes to hold what a template makes of inputs that need so many each, in
    ascending order, while it is made."""
    if not inputs:
        return 1
    needed = max(count + n for n, count in enumerate(reversed(inputs)))
    takes_over = template.held == NOPART and not template.instead
    return max(needed, len(inputs) + 1) if takes_over else needed


STEP = 1.15
"""Ratio of successive bounds on estimated cycles."""

LABELS, EFFORTS = 3000, (8, 100)
"""Number of labels that a search lays out, over all its factories; least and greatest number of
these: the layout of a large product takes as long as many of a small one."""


def usual_effort(labels: int) -> int:
    """Default of the greatest number of factories that a search lays out, for a product with so
    many labels."""
    return min(max(LABELS // labels, EFFORTS[0]), EFFORTS[1])


@dataclass(frozen=True, slots=True)
class Aim:
    """Number of `robots`, "least" for as few as found, None for any number; the `cycle` time to be
    reached [s], None for the shortest. `effort`: greatest number of factories that are laid out,
    None for the default; the search ends after `seconds`. `branches`: labels, with the number of
    copies of the branch that brings each. Raises InputError (Usage) for a wrong value."""

    robots: int | Literal["least"] | None = None
    cycle: float | None = None
    effort: int | None = None
    seconds: float = inf
    branches: Branches = ()

    def __post_init__(self) -> None:
        robots = None if self.robots == "least" else self.robots
        seconds = None if self.seconds == inf else self.seconds
        Settings.check_values(
            {"robots": robots, "cycle": self.cycle, "effort": self.effort, "seconds": seconds}
        )

    @property
    def asks(self) -> bool:
        """Whether it limits the robots or the cycle time."""
        return self.robots is not None or self.cycle is not None

    def rank(self, robots: int, seconds: float, bare: int = 0) -> tuple[float, ...]:
        """Rank of a factory, the less the better: its robots beyond those allowed, the labels
        without a hand beyond those of the product as written (`bare`), its cycle time [s]; with
        "least", the number of robots before the cycle time."""
        seconds = round(seconds, 3)
        if self.robots == "least":
            return bare, robots, seconds
        more = max(0, robots - self.robots) if self.robots else 0
        if self.cycle is None:
            return more, bare, seconds, robots
        return more, bare, max(0.0, seconds - self.cycle), robots, seconds

    def wants(self, robots: int, seconds: float) -> bool:
        """Whether a factory with these estimates may reach the aim."""
        if isinstance(self.robots, int) and robots > self.robots:
            return False
        return self.cycle is None or seconds < self.cycle * STEP
