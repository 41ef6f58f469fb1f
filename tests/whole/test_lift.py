"""Robots with a lift: what must be lowered is lowered, in either world, from any marking."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.clearance import certify
from factory.floor.layout.feeding import feeder_of
from factory.floor.mating.mating import matings
from factory.floor.modes.modes import operation_modes, operation_starts
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.compiler.expanding import expand
from factory.theory.lang.pag_reader import read_pag
from factory.theory.nets.verify import verify
from factory.theory.plant.approaches import MARGIN
from factory.theory.plant.factory import Factory
from tests.layout_values import with_visits
from tests.pag_texts import laid_out
from tests.simulation_values import FENCE, laid_out_with_lifts

CASTLE = """root = castle; castle = mate(lower, roof, flag); lower = weld(walls, dwell = 0.2);
walls = mate(tub, keep); roof = mate(tiles, ridge);
tub = atomic(box = (0.12, 0.12, 0.02), pos = (0, 0, 0.01));
keep = atomic(box = (0.05, 0.05, 0.06), pos = (0, 0, 0.0502));
tiles = atomic(box = (0.08, 0.08, 0.01), pos = (0, 0, 0.0854));
ridge = atomic(box = (0.02, 0.02, 0.02), pos = (0, 0, 0.1006));
flag = atomic(box = (0.01, 0.03, 0.03), pos = (0.02, 0, 0.1056))"""
"""Blocks that all slide over each other."""

NESTED = """root = n; n = mate(outer, inside); outer = mate(f1, w1, w2, w3, w4);
f1 = atomic(box = (0.14, 0.14, 0.01), pos = (0, 0, 0.005));
w1 = atomic(box = (0.01, 0.14, 0.06), pos = (0.065, 0, 0.0402));
w2 = atomic(box = (0.01, 0.14, 0.06), pos = (-0.065, 0, 0.0402));
w3 = atomic(box = (0.1196, 0.01, 0.06), pos = (0, 0.065, 0.0402));
w4 = atomic(box = (0.1196, 0.01, 0.06), pos = (0, -0.065, 0.0402));
inside = mate(bowl, ball); bowl = mate(f2, v1, v2, v3, v4);
f2 = atomic(box = (0.1, 0.1, 0.01), pos = (0, 0, 0.0155));
v1 = atomic(box = (0.01, 0.1, 0.03), pos = (0.045, 0, 0.0357));
v2 = atomic(box = (0.01, 0.1, 0.03), pos = (-0.045, 0, 0.0357));
v3 = atomic(box = (0.0796, 0.01, 0.03), pos = (0, 0.045, 0.0357));
v4 = atomic(box = (0.0796, 0.01, 0.03), pos = (0, -0.045, 0.0357));
ball = atomic(sphere = 0.012, pos = (0, 0, 0.0329))"""
"""A ball in a box in a box: a lift that serves a lift."""


def lifted(factory: Factory) -> list[int]:
    """The robots (index) that go up and down."""
    return [axis.robot.index for axis in factory.axes[len(factory.robots) :]]


def lifts(factory: Factory) -> dict[str, str]:
    """What each robot with a lift lowers."""
    return {factory.robots[r].name: factory.deliveries(r)[0] for r in lifted(factory)}


@pytest.mark.parametrize(
    ("text", "lowered"),
    [
        (FENCE, {"ball", "wall3", "wall4"}),
        (NESTED, {"inside", "ball", "w3", "w4"}),
        (CASTLE, set()),
    ],
    ids=["fence", "nested", "castle"],
)
def test_what_cannot_slide_is_brought_by_a_lift(text: str, lowered: set[str]) -> None:
    factory = laid_out_with_lifts(text).factory
    assert set(lifts(factory).values()) == lowered
    for robot in factory.robots:
        assert (robot.type == "lift") == (robot.name in lifts(factory))
    assert verify(factory.net).holds


@pytest.mark.parametrize("strokes", [(0.2, 0.1), (0.1, 0.2)])
def test_a_lift_goes_as_far_as_the_farthest_of_its_tours_asks_for(
    strokes: tuple[float, ...],
) -> None:
    made = laid_out_with_lifts(FENCE).factory
    lowered = next(o for o in made.operations if o.approach is not None and o.lowered >= 0)
    assert lowered.approach is not None
    tours = tuple(
        replace(lowered, approach=replace(lowered.approach, stroke=stroke)) for stroke in strokes
    )
    robot = lowered.robots[lowered.lowered]
    assert replace(made, operations=tours).lowering(robot) == 0.2


@pytest.mark.parametrize("text", [FENCE, NESTED], ids=["fence", "nested"])
@pytest.mark.parametrize(
    ("world", "distributed"), [("ideal", True), ("mujoco", False), ("mujoco", True)]
)
def test_lifts_lower_in_either_world(text: str, distributed: bool, world: str) -> None:
    """With every robot at a speed of its own; contact is on for all parts."""
    layout = laid_out_with_lifts(text)
    simulation = Simulation(
        layout, RunRequest(world, units=4, seed=5, jitter=0.3, distributed=distributed)
    )
    run = simulation.run()
    assert run.trouble is None, str(run.trouble)
    assert run.products == 4 and run.refines_net
    if world == "mujoco":
        assert layout.overlaps == ()
        assert run.physics is not None
        assert run.physics.unintended_contacts == 0, run.physics.contacts
        assert run.physics.mating_force_max_n == 0.0
        assert run.physics.product_error_max_mm < 0.01
        assert run.physics.handoff_gap_max_mm < 0.2
    if not distributed:
        assert run.cycle_time_s == pytest.approx(run.predicted_cycle_time_s, rel=0.02)


def test_what_a_lift_serves_is_made_at_its_height() -> None:
    layout = laid_out_with_lifts(NESTED)
    factory = layout.factory
    robot = {label: factory.by_label[label].carrier for label in ("n", "inside", "bowl", "f2")}
    up = [layout.visits[robot.operations[0], robot.index].elevation for robot in factory.robots]
    inside, ball = robot["inside"], factory.by_label["ball"].carrier
    assert up[robot["n"]] == 0.0
    assert up[inside] == factory.lowering(inside) > 0
    assert up[robot["f2"]] == up[inside]
    assert up[ball] == up[inside] + factory.lowering(ball)
    assert feeder_of(layout, "f2").low == pytest.approx(
        feeder_of(layout, "f1").low + up[inside] + 0.0105, abs=1e-9
    )


def test_a_lift_is_up_but_for_what_it_delivers_to() -> None:
    layout = laid_out_with_lifts(FENCE)
    factory = layout.factory
    robot, *_ = lifted(factory)
    stroke = factory.lowering(robot)
    axis = len(factory.robots)
    modes, starts = operation_modes(layout, 2e-4), operation_starts(layout)
    first, last = (factory.robots[robot].operations[i] for i in (0, -1))
    for number, start, goal in ((first, 0.0, stroke), (last, stroke, 0.0)):
        slot = factory.moves[number].index(axis)
        assert (starts[number][slot], modes[number].goals[slot]) == (start, goal)
    lowering = modes[last]
    slot = factory.moves[last].index(axis)
    own = factory.operations[last].robots.index(robot)
    assert lowering.gate[slot] == own, "it is lowered when its own robot stands"
    assert lowering.gate[own] >= 0, "which stands after the others"


def test_it_is_lowered_only_when_all_others_stand() -> None:
    """In physics: while the head is not up, every robot of the operation is within eps of its goal;
    while any other moves, the parts keep the margin."""
    layout = laid_out_with_lifts(FENCE)
    factory = layout.factory
    robot, *_ = lifted(factory)
    last = factory.last(robot)
    simulation = Simulation(layout, RunRequest(units=1))
    goals = np.array(layout.goals(last.index)[: len(last.robots)])
    seen = []

    def observe(_: State) -> None:
        if last.index in simulation.supervisor.active.operations:
            x = simulation.world.sense()[0]
            away = np.abs(x[list(last.robots)] - goals).max()
            if x[len(factory.robots)] < factory.lowering(robot) - 1e-3:
                seen.append(away)

    simulation.run([observe])
    assert len(seen) > 5 and max(seen) < 3e-4


def test_runs_start_from_any_marking_of_a_factory_with_lifts() -> None:
    layout = laid_out_with_lifts(FENCE)
    ideal = Simulation(layout, RunRequest("ideal", units=2))
    places = set()
    while ideal.world.delivered() < 2:
        ideal.supervisor.step()
        places.add(frozenset(p for p, m in enumerate(ideal.supervisor.marked) if m))
    chosen = sorted(places, key=sorted)[:: max(1, len(places) // 6)]
    assert len(chosen) >= 6
    for marking in chosen:
        run = Simulation(layout, RunRequest(units=1, start=marking)).run()
        assert run.trouble is None and run.refines_net, str(run.trouble)
        assert run.physics.unintended_contacts == 0, run.physics.contacts
        assert run.physics.handoff_gap_max_mm < 0.2


def test_a_stroke_too_short_fails_the_certificate() -> None:
    """Planted fault: what is lowered comes only 5 mm above the others."""
    layout = laid_out_with_lifts(FENCE)
    factory = layout.factory
    operations = tuple(
        o
        if o.lowered < 0
        else replace(o, approach=replace(o.approach, stroke=o.approach.stroke - MARGIN + 0.005))
        for o in factory.operations
    )
    lower = with_visits(replace(layout, factory=replace(factory, operations=operations)))
    assert certify(layout).holds
    faults = certify(lower).faults
    assert any("comes 5.0 mm over" in fault.message for fault in faults)


def test_without_a_lift_the_ball_is_blocked_and_its_pairs_left_out() -> None:
    layout = laid_out(FENCE)
    kinds = {o.label: o.approach.kind for o in layout.factory.operations if o.approach}
    assert "blocked" in kinds.values()
    assert any("ball" in overlap.parts for overlap in layout.overlaps)
    run = Simulation(layout, RunRequest(units=2)).run()
    assert run.trouble is None and run.physics.unintended_contacts == 0


def test_a_catalogue_without_lifts_is_told() -> None:
    from factory.theory.compiler.compiler import compile_pag
    from tests.pag_values import catalogue

    templates = all_templates()
    pag = read_pag(FENCE, templates)
    found = matings(expand(pag, templates), product_geometry(pag)).approaches
    with pytest.raises(InputError, match="must be lowered, and a 'dot' has no lift"):
        compile_pag(pag, templates, catalogue(), found)
