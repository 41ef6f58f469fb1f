"""Laid-out factories for tests: random trees with random geometry, and layouts changed on
purpose."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType

from factory.floor.geometry.product import product_geometry
from factory.floor.layout.branches import carriers
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.layout import Layout
from factory.floor.layout.visits import visits_of
from factory.support.boxes import moved as displaced
from factory.theory.problem.pag import PAG, Assembly, Parameter, Value
from tests.pag_values import SHAPES, factory_of, paper, random_pag

STYLES = ("plain", "small", "medium", "large", "far", "mixed")
"""How large parts are, and how far from the middle of the product."""

SPREAD = {"small": 0.03, "medium": 0.15, "large": 0.4, "far": 0.6}


def shaped(pag: PAG, seed: int, style: str, base: bool = False) -> PAG:
    """The PAG with a random shape for every part; some mates of two become insertions.

    `base`: the first part is a heavy plate under all others, so that the product stands by itself.
    """
    rng = random.Random(f"{seed} {style}")
    nodes = []
    for node in pag.nodes:
        changed = node
        if not node.inputs:
            changed = replace(node, parameters=tuple(_geometry(rng, style)))
            if base and style != "plain":
                wide, base = 2 * SPREAD.get(style, 0.6) + 0.05, False
                plate = (("box", (wide, wide, 0.01)), ("pos", (0.0, 0.0, -0.25)), ("mass", 3.0))
                changed = replace(node, parameters=tuple(Parameter(k, v) for k, v in plate))
        elif node.operation == "mate" and len(node.inputs) == 2 and rng.random() < 0.15:
            changed = replace(node, operation="insert")
        nodes.append(changed)
    return replace(pag, nodes=tuple(nodes))


def _geometry(rng: random.Random, style: str) -> list[Parameter]:
    """Boxes, plates, rods, balls and cylinders, turned or not, off the product's middle."""
    chosen = rng.choice(tuple(SPREAD)) if style == "mixed" else style
    if chosen == "plain":
        return []
    wide = SPREAD[chosen]
    given: dict[str, Value] = dict([_shape(rng, min(wide, 0.25))])
    given["pos"] = (rng.uniform(-wide, wide), rng.uniform(-wide, wide), rng.uniform(0.0, 0.15))
    given["mass"] = rng.uniform(0.05, 0.5)
    if rng.random() < 0.4:
        given["quat"] = tuple(rng.uniform(-1, 1) for _ in range(4))
    return [Parameter(name, value) for name, value in given.items()]


def _shape(rng: random.Random, longest: float) -> tuple[str, Value]:
    def length(most: float = longest) -> float:
        return 0.005 * float((most / 0.005) ** rng.random())

    kind = rng.choice(("box", "plate", "rod", "cylinder", "sphere"))
    if kind == "plate":
        return "box", (length(), length(), 0.005)
    if kind == "rod":
        sides = [0.008, 0.008, 0.008]
        sides[rng.randrange(3)] = 2 * length()
        return "box", tuple(sides)
    if kind == "cylinder":
        return kind, (length() / 2, length())
    return (kind, length() / 2) if kind == "sphere" else (kind, (length(), length(), length(0.1)))


@cache
def random_layout(
    size: int, seed: int, shape: str = "any", style: str = "medium", base: bool = False
) -> Layout:
    """A layout of a random factory, always the same for the same arguments, made once for them."""
    factory = factory_of(shaped(random_pag(size, seed, shape), seed, style, base))
    return lay_out(factory, product_geometry(factory.pag))


Drawn = tuple[int, int, str, str]
"""What `random_layout` takes: the number of parts, a seed, the shape of the tree, the style."""


def _drawn() -> tuple[Drawn, ...]:
    rng = random.Random(40)
    every = [(shape, style) for shape in SHAPES for style in STYLES]
    sizes = [1, 2, 3, 40, *(rng.randint(2, 24) for _ in every[4:])]
    return tuple(
        (size, rng.randint(0, 10_000), *one) for size, one in zip(sizes, every, strict=True)
    )


DRAWN = _drawn()
"""Layouts of every shape of tree with parts of every style, which properties of layouts share."""


def many_layouts(size: int, seeds: range) -> list[Layout]:
    """Layouts of all shapes of trees and styles of parts in turn."""
    return [
        random_layout(size, seed, SHAPES[seed % len(SHAPES)], STYLES[seed // 2 % len(STYLES)])
        for seed in seeds
    ]


@cache
def paper_layout() -> Layout:
    """The layout of the paper's example."""
    factory = factory_of(paper())
    return lay_out(factory, product_geometry(factory.pag))


def table_pag(root: str, *rows: tuple[str, str, str, dict[str, Value]]) -> PAG:
    """A PAG from rows (label, operation, inputs apart by spaces, parameters)."""
    return PAG(
        root,
        tuple(
            Assembly(
                label, op, tuple(inputs.split()), tuple(Parameter(k, v) for k, v in given.items())
            )
            for label, op, inputs, given in rows
        ),
    )


@cache
def row_of_inserts(parts: int = 5) -> Layout:
    """A carrier that takes its parts one after the other: stations in a row."""
    boxes: list[tuple[str, str, str, dict[str, Value]]] = [
        (f"p{n}", "atomic", "", {"box": (0.04, 0.04, 0.04), "pos": (0.0, 0.0, 0.05 * n)})
        for n in range(parts)
    ]
    whole = ("x", "mate", " ".join(f"p{n}" for n in range(parts)), {})
    factory = factory_of(table_pag("x", whole, *boxes))
    return lay_out(factory, product_geometry(factory.pag))


def shortened(layout: Layout, robot: int, length: float) -> Layout:
    """A guidepath shortened at its B end, with everything that delivers to it moved along."""
    below = defaultdict(list)
    for guest, carrier in enumerate(carriers(layout.factory)):
        below[carrier].append(guest)
    paths = list(layout.guidepaths)
    u = paths[robot].heading
    paths[robot] = replace(paths[robot], travel=round(paths[robot].travel - length, 3))
    moved = list(below[robot])
    while moved:
        guest = moved.pop()
        x, y = paths[guest].a
        a = (round(x + u[0] * length, 3), round(y + u[1] * length, 3))
        paths[guest] = replace(paths[guest], a=a)
        moved += below[guest]
    return with_visits(replace(layout, guidepaths=tuple(paths)), stations_of(layout))


def with_path(layout: Layout, robot: int, **changes: object) -> Layout:
    """A layout with one guidepath changed and nothing else."""
    paths = list(layout.guidepaths)
    paths[robot] = replace(paths[robot], **changes)  # type: ignore[arg-type]
    return replace(layout, guidepaths=tuple(paths), certificate=None)


def with_visits(
    layout: Layout,
    stations: Mapping[int, float] = MappingProxyType({}),
    shifts: Mapping[tuple[int, int], Point3] = MappingProxyType({}),
) -> Layout:
    """A layout with some operations at other stations, distances from the B ends of their carriers,
    and some robots that hold the payload of a tour, by (robot, tour), so much elsewhere than they
    did [m]."""
    factory, paths = layout.factory, layout.guidepaths
    held = [
        tuple(
            _shift(layout, robot, tour[-1], shifts.get((robot, n), (0.0, 0.0, 0.0)))
            for n, tour in enumerate(tours)
        )
        for robot, tours in enumerate(factory.tours)
    ]
    plain = not any(any(shift) for tours in held for shift in tours)
    there = {**stations_of(layout), **stations}
    at = [there[o.index] for o in factory.operations]
    return replace(
        layout, visits=visits_of(factory, paths, at, () if plain else held), certificate=None
    )


def stations_of(layout: Layout) -> dict[int, float]:
    """Where operations take place, distances from the B ends of their carriers [m]."""
    paths, factory = layout.guidepaths, layout.factory
    at = {o.index: paths[o.carrier].length - layout.station(o.index) for o in factory.operations}
    return {number: round(station, 9) + 0.0 for number, station in at.items()}


def _shift(layout: Layout, robot: int, last: int, by: Point3) -> Point3:
    """How a robot holds what it delivers in an operation, and so much elsewhere."""
    visit, carrier = layout.visits[last, robot], layout.factory.operations[last].carrier
    below = layout.visits[last, carrier].elevation if robot else 0.0
    ahead, _, aside, _ = layout.guidepaths[robot].frame(
        displaced((0.0, 0.0, 0.0, 0.0), visit.shift)
    )
    return ahead + by[0], aside + by[1], below - visit.lift + by[2]
