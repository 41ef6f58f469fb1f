"""Worlds: both satisfy one interface, and others take part in both by the same hooks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from factory.apps.live.interventions import Interventions
from factory.apps.monitor.anatomy import check_holders
from factory.engine.mjcf.masks import NOBODY
from factory.engine.mjcf.weld_frames import gaps
from factory.engine.simulation.mujoco.courses import Course
from factory.engine.simulation.mujoco.fast import neighbours, strides
from factory.engine.simulation.mujoco.fast.strides import Strides
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.clearance import certify
from factory.floor.mating.mating import matings
from factory.support.engine import mujoco
from factory.support.errors import InputError
from factory.theory.compiler.expanding import Node
from factory.theory.lang.pag_reader import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.plant.approaches import MARGIN
from tests.examples import without_hands
from tests.good_runs import random_marking
from tests.layout_values import with_visits
from tests.simulation_values import FENCE, FINE, laid_out_with_lifts, layout_of, ready

Name = Literal["mujoco", "ideal"]
WORLDS: tuple[Name, ...] = ("ideal",)


def run_in(world: Name, units: int = 2, **given: Any) -> Simulation:
    """A run of the paper's example in a world, ready to go."""
    return Simulation(layout_of("paper"), RunRequest(world, units, settings=FINE, **given))


@pytest.mark.parametrize("name", WORLDS)
def test_a_hook_may_remove_itself(name: Name) -> None:
    """And the others act all the same, in that step too."""
    simulation = run_in(name)
    acts, calls = simulation.world.hooks.before_step, list[str]()

    def once() -> None:
        calls.append("once")
        acts.remove(once)

    acts += [once, lambda: calls.append("other")]
    for _ in range(3):
        simulation.supervisor.step()
    assert calls[:2] == ["once", "other"] and calls.count("once") == 1
    assert calls.count("other") == (15 if name == "mujoco" else 3)


def test_interventions_are_into_bodies() -> None:
    with pytest.raises(InputError, match="the ideal world has none"):
        Interventions(run_in("ideal")).slow(0, 0.5)


def test_pushes_end_when_their_time_is_over() -> None:
    """Two robots, each as long as was asked for; each with a share of its own drive's force."""
    simulation = ready("paper")
    world, hands = simulation.physical, Interventions(simulation)
    bodies = [world.m.body(f"r{n}/carriage").id for n in (1, 2)]
    hands.push(0, 0.5, 0.02)
    hands.push(1, -0.25, 0.05)
    forces = [np.linalg.norm(world.d.xfrc_applied[b, :3]) for b in bodies]
    limits = world.m.actuator_forcerange[world.motion.axes.actuator[:2], 1]
    assert forces == pytest.approx([0.5 * limits[0], 0.25 * limits[1]])
    lasted = np.zeros(2)
    for _ in range(60):
        world.advance(1)
        lasted += world.d.xfrc_applied[bodies, :3].any(axis=1)
    assert lasted.tolist() == [10, 25]
    assert world.hooks.before_step == []


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


def test_a_catalogue_without_lifts_is_told() -> None:
    from factory.theory.compiler.compiler import compile_pag
    from tests.pag_values import catalogue

    templates = all_templates()
    pag = read_pag(FENCE, templates)
    found = matings(Node.expand(pag, templates), product_geometry(pag)).approaches
    with pytest.raises(InputError, match="must be lowered, and a 'dot' has no lift"):
        compile_pag(pag, templates, catalogue(), found)


def solid_bodies(m: mujoco.MjModel) -> np.ndarray:
    """The bodies that can collide, by the masks of their geoms, which nothing is left out of."""
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    return np.unique(m.geom_bodyid[solid])


def boxes(m: mujoco.MjModel, d: mujoco.MjData, bodies: np.ndarray) -> np.ndarray:
    """The boxes (n, 2, 3) that the engine's broad phase has for bodies, in the world's axes."""
    solid = (m.geom_contype | m.geom_conaffinity) != 0
    turn = d.geom_xmat.reshape(-1, 3, 3)
    middle = d.geom_xpos + (turn @ m.geom_aabb[:, :3, None])[:, :, 0]
    half = (np.abs(turn) @ m.geom_aabb[:, 3:, None])[:, :, 0]
    found = np.empty((m.nbody, 2, 3))
    found[:, 0], found[:, 1] = np.inf, -np.inf
    np.minimum.at(found[:, 0], m.geom_bodyid[solid], (middle - half)[solid])
    np.maximum.at(found[:, 1], m.geom_bodyid[solid], (middle + half)[solid])
    return np.asarray(found[bodies])


def within_boxes(simulation: Simulation) -> bool:
    """Whether all that holders have is within the boxes that they are to sweep."""
    world = simulation.physical
    m, d, stepping_ = world.m, world.d, world.motion.stepping
    assert isinstance(stepping_, Strides)
    mujoco.mj_kinematics(m, d)
    code, bodies = world.parts.masks.code, solid_bodies(m)
    bodies = bodies[code[bodies] != NOBODY]
    low, high = boxes(m, d, bodies).transpose(1, 0, 2)
    least, most = (corners.T[code[bodies]] for corners in stepping_._neighbours.boxes())
    return bool((least <= low[:, :2]).all() and (high[:, :2] <= most).all())


@pytest.mark.parametrize(("name", "given"), [("tee", {}), ("bar", {})])
def test_what_a_holder_has_is_within_its_box(
    name: str, given: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)  # in small factories, too
    simulation = ready(name, **given)
    while simulation.physical.time < 8.0:
        for _ in range(10):
            simulation.supervisor.step()
        assert within_boxes(simulation)


def test_there_is_room_for_so_many_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strides, "ROOM", 42)
    cache = ready("paper").physical.motion.stepping
    assert isinstance(cache, Strides)
    still = np.zeros((2, 1))
    for number in range(100):
        course = cache.course(number % 7, lambda: Course(still, still, np.zeros((1, 4, 3)), False))
        again = cache.course(number % 7, lambda: pytest.fail("it was forgotten"))
        assert again is course
        assert 1 <= len(cache._courses) <= 42 // 16


@pytest.fixture(scope="module", params=["paper", "gearbox"])
def model(request: pytest.FixtureRequest) -> mujoco.MjModel:
    return Simulation(without_hands(request.param)).world.m


def anywhere(m: mujoco.MjModel, seed: int) -> mujoco.MjData:
    """The engine in a configuration in which all slides are somewhere."""
    d, draw = mujoco.MjData(m), np.random.default_rng(seed)
    slides = m.jnt_qposadr[m.jnt_type == int(mujoco.mjtJoint.mjJNT_SLIDE)]
    d.qpos[slides] = draw.uniform(-1, 1, len(slides))
    mujoco.mj_kinematics(m, d)
    return d


def test_gaps_are_what_the_engine_has_to_close(model: mujoco.MjModel) -> None:
    d = anywhere(model, 4)
    welds = np.arange(model.neq)
    d.eq_active[:] = 1
    mujoco.mj_forward(model, d)
    position = d.efc_pos[: d.ne].reshape(-1, 6)[:, :3]
    assert len(position) == model.neq
    found = gaps(model, welds, d.xpos, d.xmat)
    assert found == pytest.approx(np.linalg.norm(position, axis=1), abs=1e-12)


def test_a_holder_with_a_joint_of_another_kind_is_refused() -> None:
    xml = """<mujoco><worldbody>
      <body name="slider"><joint type="slide"/><geom size="0.1"/>
        <body name="arm"><joint type="{}" axis="1 0 0"/><geom size="0.1"/></body></body>
      <body name="part"><freejoint/><geom size="0.1"/></body>
    </worldbody><equality><weld body1="arm" body2="part"/></equality></mujoco>"""
    for kind in ("slide", "hinge"):
        check_holders(mujoco.MjModel.from_xml_string(xml.format(kind)), np.array([0]))
    rolls = mujoco.MjModel.from_xml_string(xml.format("ball"))
    check_holders(rolls, np.array([], int))
    with pytest.raises(ValueError, match="arm holds parts and does more than slide"):
        check_holders(rolls, np.array([0]))


def test_a_run_from_a_marking_begins_with_what_robots_hold() -> None:
    """Where the welds hold it: nothing jumps."""
    start = random_marking(layout_of("paper"), 1)
    world = ready("paper", start=start).physical
    places = world.d.xpos.copy()
    for _ in range(20):
        world.advance(1)
    held = [body for held in world.parts.holdings.in_hands().values() for body in held.values()]
    assert np.abs(world.d.xpos[held] - places[held]).max(initial=0.0) < 1e-4
    assert not world.inspection.unintended
