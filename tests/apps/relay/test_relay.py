"""Relays: where a guidepath is shared by several robots the net is proved and the layout certified
as before, everything goes where it went, and the pace no longer depends on the factory's size."""

from __future__ import annotations

import random
from dataclasses import replace
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benches.speed.factories import cube
from factory.apps.monitor import beside
from factory.apps.relay import relayed
from factory.apps.relay.splitting import split
from factory.apps.relay.ways import Way, ways
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.engine.timing.pool import part_pool
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.clearance import certify
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.durations import Pace, gear_times
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import optimised
from factory.pipeline import read
from factory.support.resources import templates_folder
from factory.support.settings import Settings
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.expanding import expand, nodes_of
from factory.theory.lang import read_pag, write_pag
from factory.theory.lang.template_reader import load_templates
from factory.theory.nets.verify import verify
from factory.theory.plant.factory import Factory
from factory.theory.problem.plan import Plan
from factory.theory.problem.robot_types import load_catalogue
from factory.theory.problem.template import Template
from tests.layout_values import (
    Drawn,
    drawn_layouts,
    paper_layout,
    random_layout,
    row_of_inserts,
)
from tests.pag_values import SHAPES
from tests.paths import EXAMPLES

SETTINGS = Settings()

PACE = Pace.of(SETTINGS)

seeds = st.integers(0, 10_000)


@cache
def bare(parts: int) -> Layout:
    """A draft for a cube of so many parts, in which hands are not chosen yet: they cannot relay
    cubes, which are heavy and narrow. Relays with hands are tested in `test_relay_hands`."""
    shipped = load_templates([templates_folder()])
    pag = read_pag(cube(parts), shipped, "cube.pag")
    factory = compile_pag(pag, shipped, load_catalogue())
    return lay_out(factory, product_geometry(factory.pag), pace=PACE)


@cache
def cut_short(parts: int) -> Layout:
    """The same with all relays that shorten its cycle."""
    return relayed(bare(parts), SETTINGS)


def cycle(layout: Layout) -> float:
    return max(gear_times(layout, PACE))


def templates_of(layout: Layout) -> dict[str, Template]:
    used = {o.template.name: o.template for o in layout.factory.operations}
    return {**load_templates([templates_folder()]), **used}


def cuttable(plain: Layout) -> tuple[Layout, dict[str, Way]]:
    """A layout with room for relays on every way that can be cut, and these ways."""
    wide = {way.robot for way in ways(plain).values()}
    c = Clearance(plain.clearance)
    layout = optimised(plain.factory, plain.product, c, PACE, wide=wide)
    return layout, {k: way for k, way in ways(layout).items() if way.robot in wide}


def cut(layout: Layout, found: dict[str, Way], numbers: dict[str, int]) -> Layout:
    return split(layout, found, numbers, templates_of(layout), load_catalogue())


def cut_at_random(plain: Layout, seed: int, most: bool = False) -> tuple[Layout, Layout, int]:
    """A layout with room for relays, the same with some, and how many they are."""
    rng = random.Random(seed)
    layout, found = cuttable(plain)
    numbers = {k: way.most if most else rng.randint(0, way.most) for k, way in found.items()}
    return layout, cut(layout, found, numbers), sum(numbers.values())


def middles(layout: Layout) -> dict[str, tuple[float, float]]:
    """Where the product's middle is at the end of every operation."""
    found = {}
    for o in layout.factory.operations:
        path = layout.guidepaths[o.carrier]
        x, y = path.middle(layout.visits[o.index, o.carrier].at)
        found[o.label] = round(x, 6), round(y, 6)
    return found


@settings(max_examples=6)
@given(drawn_layouts, seeds, st.booleans())
def test_relays_anywhere_are_proved_and_certified(drawn: Drawn, seed: int, most: bool) -> None:
    """Also that they are gear nets as the language writes them."""
    before, after, added = cut_at_random(random_layout(*drawn), seed, most)
    assert len(after.factory.robots) == len(before.factory.robots) + added
    assert verify(after.factory.net).holds
    assert [str(fault.message) for fault in certify(after).faults] == []
    pag = after.factory.pag
    shipped = load_templates([templates_folder()])
    assert read_pag(write_pag(pag), {**templates_of(after), **shipped}, pag.file) == pag
    pool, was = part_pool(after.factory), part_pool(before.factory)
    assert all(pool[part] >= was[part] for part in was)


@settings(max_examples=5)
@given(drawn_layouts, seeds)
def test_everything_goes_where_it_went(drawn: Drawn, seed: int) -> None:
    """All is made at the same places, and the robots of a way run it all between them."""
    before, after, added = cut_at_random(random_layout(*drawn), seed)
    here, there = middles(before), middles(after)
    same = [label for label in here if label in there]
    assert all(here[label] == there[label] for label in same)
    assert after.outfeed == before.outfeed
    travels = [sum(g.travel for g in layout.guidepaths) for layout in (before, after)]
    assert travels[0] == pytest.approx(travels[1])
    assert len(after.factory.operations) == len(before.factory.operations) + added


def test_a_source_line_is_kept() -> None:
    after = cut_short(32)
    relays = [o for o in after.factory.operations if o.template.name == "relay"]
    assert relays
    for relay in relays:
        assert relay.position == after.factory.by_label[relay.label.partition("/")[0]].position


def test_piles_and_the_product_are_handed_over() -> None:
    pag, templates = row_of_inserts(5).factory.pag, load_templates([templates_folder()])
    plan = Plan(relays={"x/3": 1, "x": 2})
    nodes = expand(pag, templates, plan)
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
    assert nodes_of(made) == nodes


def test_a_cut_in_the_wrong_place_is_caught() -> None:
    """In one lane with the robot that takes over; or too near for what stands there, which then
    has to wait."""
    layout, found = cuttable(bare(32))
    label = max(found, key=lambda x: found[x].end - found[x].start)
    good = cut(layout, found, {label: 1})
    assert certify(good).holds and not certify(good).apart.orders
    found[label] = replace(found[label], end=found[label].start + 0.1, step=0.05, last=0.0)
    near = certify(cut(layout, found, {label: 1}))
    assert near.holds and [order.before for order in near.apart.orders] == ["n_e"]
    paths = [replace(path, offset=path.offset + path.aside) for path in good.guidepaths]
    assert not certify(replace(good, guidepaths=tuple(paths))).holds


def test_the_pace_does_not_depend_on_the_size() -> None:
    """Balanced trees of parts that fill one cube."""
    sizes = (16, 128)
    plain, found = [bare(parts) for parts in sizes], [cut_short(parts) for parts in sizes]
    before, after = [cycle(layout) for layout in plain], [cycle(layout) for layout in found]
    assert max(before) > 2 * min(before)
    assert max(after) < 1.25 * min(after)
    assert all(
        len(f.factory.robots) < 1.2 * len(p.factory.robots)
        for f, p in zip(found, plain, strict=True)
    )
    assert all(layout.certificate and layout.certificate.holds for layout in found)


def test_where_nothing_is_gained_nothing_is_changed() -> None:
    layout = paper_layout()
    assert relayed(layout, SETTINGS) is layout


@pytest.mark.parametrize(("fuse", "distributed"), [(False, True), (True, False)])
def test_relays_run(fuse: bool, distributed: bool) -> None:
    """In MuJoCo, at jitter, with the monitor beside."""
    layout = cut_short(32)
    assert layout.plain
    simulation = Simulation(
        layout,
        RunRequest(
            units=2, seed=4, jitter=0.3, settings=SETTINGS, fuse=fuse, distributed=distributed
        ),
    )
    monitor = beside(simulation)
    run = simulation.run([monitor.observe])
    assert (run.products, run.refines_net, run.trouble) == (2, True, None)
    assert monitor.report().violations == ()
    physics = run.physics
    assert physics
    assert physics.unintended_contacts == physics.engine_warnings == 0
    assert physics.handoff_gap_max_mm < 0.2
    assert physics.product_error_max_mm is not None
    assert physics.product_error_max_mm < 0.1


def test_two_bodies_may_be_made_in_one_tick_of_what_is_alike() -> None:
    """One copy of a relayed sub-assembly goes into a larger one as the next copy is made."""
    layout = relayed(random_layout(9, 156, SHAPES[156 % len(SHAPES)]), SETTINGS, 0.5)
    simulation = Simulation(
        layout,
        RunRequest(units=3, seed=156, jitter=0.3, settings=SETTINGS, fuse=True, distributed=True),
    )
    monitor = beside(simulation)
    run = simulation.run([monitor.observe])
    assert (run.products, run.trouble, monitor.report().violations) == (3, None, ())


def lowered(factory: Factory) -> list[float]:
    """How far each robot that goes up and down lowers what it delivers [m]."""
    more = factory.axes[len(factory.robots) :]
    return [factory.lowering(axis.robot.index) for axis in more]


def test_what_is_lowered_can_be_relayed() -> None:
    """The robots of a lifted way carry it at its height; the last one has the lift."""
    project = read(EXAMPLES / "gearbox.pag")
    plain = lay_out(project.plain, project.product)
    assert lowered(plain.factory)
    layout, found = cuttable(plain)
    lifted = {o.approach.lowered for o in plain.factory.operations if o.approach}
    chosen = {k: way for k, way in found.items() if k in lifted}
    after = cut(layout, chosen or found, {k: way.most for k, way in (chosen or found).items()})
    assert certify(after).holds
    assert lowered(after.factory) == lowered(plain.factory)
