"""Robots that relay each other and have hands: giver and taker hold different places, each on its
own side of the line, and nothing meets anything on any way."""

from __future__ import annotations

import random
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from factory.apps.relay import relayed
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.hands.in_the_way import BESIDE
from factory.floor.layout.hands.limbs import cross_of
from factory.floor.layout.layout import Layout
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import read
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.expanding import Node
from factory.theory.lang.template_reader import load_templates
from factory.theory.plant.operation import Operation
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_bodies import ARM_WIDTH
from tests.layout_values import paper_layout, row_of_inserts

SETTINGS = Settings()

Room = tuple[tuple[float, float], ...]


def sawn(seed: int) -> str:
    """A PAG of a slab that is sawn at random: a tree of mates, whose parts are wide for their
    weight."""
    rng, lines = random.Random(seed), list[str]()

    def cut(name: str, room: Room, parts: int, mass: float) -> None:
        if parts == 1:
            box = ", ".join(f"{0.96 * (high - low):.6g}" for low, high in room)
            pos = ", ".join(f"{(low + high) / 2:.6g}" for low, high in room)
            lines.append(f"{name} = atomic ( box = ({box}), pos = ({pos}), mass = {mass:.6g} )")
            return
        lines.append(f"{name} = mate ( {name}a, {name}b )")
        sizes = [(high - low) * (0.5 if n == 2 else 1.0) for n, (low, high) in enumerate(room)]
        axis = max(range(3), key=lambda n: sizes[n] * rng.uniform(0.6, 1))
        share, (low, high) = rng.uniform(0.35, 0.65), room[axis]
        at = low + share * (high - low)
        first = max(1, min(parts - 1, round(parts * rng.uniform(0.3, 0.7))))
        halves = ("a", (low, at), first, share), ("b", (at, high), parts - first, 1 - share)
        for letter, half, count, part in halves:
            inside = tuple(half if n == axis else edges for n, edges in enumerate(room))
            cut(name + letter, inside, count, mass * part)

    sides = (
        (0.0, rng.uniform(0.3, 0.8)),
        (0.0, rng.uniform(0.3, 0.8)),
        (0.0, rng.uniform(0.05, 0.3)),
    )
    cut("n", sides, rng.randint(10, 28), rng.uniform(0.2, 1.5))
    return "root = n;\n" + ";\n".join(lines) + "\n"


@cache
def plain(text: str) -> Layout:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "product.pag"
        file.write_text(text)
        return read(file, (), SETTINGS).layout


@cache
def with_relays(seed: int) -> Layout:
    return relayed(plain(sawn(seed)), SETTINGS)


def hand_overs(layout: Layout) -> list[Operation]:
    return [o for o in layout.factory.operations if o.template.name == "relay"]


def test_giver_and_taker_hold_on_their_own_sides() -> None:
    """Their pads are apart across the line, and what goes across to these by a clearance."""
    layout = with_relays(4)
    for operation in hand_overs(layout):
        taker, giver = operation.robots
        lanes, pads, arms = zip(*(_across(layout, robot) for robot in (taker, giver)), strict=True)
        assert abs(lanes[0] - lanes[1]) == pytest.approx(2 * Clearance(layout.clearance).spread)
        for first, second, apart in ((*pads, 2 * BESIDE), (*arms, layout.clearance)):
            low, high = (first, second) if lanes[0] < lanes[1] else (second, first)
            assert high[0] - low[1] >= apart - 1e-6


def _across(layout: Layout, robot: int) -> tuple[float, tuple[float, float], tuple[float, float]]:
    """Where a robot's lane is across its line, and from where to where its pads and its arm with
    what goes across from it are."""
    path, hand, (x, y, _) = layout.guidepaths[robot], layout.hands[robot], layout.product.middle
    assert hand is not None and hand.kind == "below" and hand.share <= 1
    (s, t), r = path.side, hand.radius
    at = [(px - x) * s + (py - y) * t for px, py, _ in hand.places]
    reach = sorted(path.offset + side * path.left for side in cross_of(layout, robot))
    arm = min(reach[0], path.offset - ARM_WIDTH / 2), max(reach[1], path.offset + ARM_WIDTH / 2)
    return path.offset, (min(at) - r, max(at) + r), arm


def test_piles_and_the_product_are_handed_over() -> None:
    pag, templates = row_of_inserts(5).factory.pag, load_templates([templates_folder()])
    plan = Plan(relays={"x/3": 1, "x": 2})
    nodes = Node.expand(pag, templates, plan)
    assert {x: (node.template.name, node.inputs) for x, node in nodes.items() if node.inputs} == {
        "x/2": ("mate", ("p0", "p1")),
        "x/3": ("insert", ("x/2", "p2")),
        "x/3/relay1": ("relay", ("x/3",)),
        "x/4": ("insert", ("x/3/relay1", "p3")),
        "x": ("insert", ("x/4", "p4")),
        "x/relay1": ("relay", ("x",)),
        "x/relay2": ("relay", ("x/relay1",)),
    }
    made = compile_pag(pag, templates, load_catalogue(), plan=plan)
    assert made.products == ("x/relay2",)
    assert Node.of_factory(made) == nodes


def test_where_nothing_is_gained_nothing_is_changed() -> None:
    layout = paper_layout()
    assert relayed(layout, SETTINGS) is layout
