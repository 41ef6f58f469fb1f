"""What is left out of the broad phase: nothing that moves, and nothing that can be met."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from factory.apps.deviations import Deviation, deviate
from factory.apps.live.interventions import Interventions
from factory.engine.mjcf.masks import NOBODY
from factory.engine.simulation.mujoco.contacts import ContactMasks
from factory.engine.simulation.mujoco.fast import neighbours
from factory.engine.simulation.mujoco.fast.neighbours import CALM, Neighbours
from factory.engine.simulation.mujoco.fast.strides import Strides
from factory.engine.simulation.mujoco.holdings import Holdings
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.settings import MOST, Settings
from tests.good_runs import random_marking
from tests.layout_values import random_layout
from tests.simulation_values import gone_wild, layout_of, ready, stepping

IS_AWAKE = int(mujoco.mjtSleepState.mjS_AWAKE)


@pytest.fixture(autouse=True)
def _in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


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


def looked_at(simulation: Simulation) -> float:
    """The share of the bodies that can collide which the broad phase looks at."""
    m = simulation.physical.m
    bodies = solid_bodies(m)
    return float(((m.body_contype | m.body_conaffinity)[bodies] != 0).mean())


def overlooked(m: mujoco.MjModel, d: mujoco.MjData) -> set[str]:
    """What is awake, and what meets the box of something awake, and was left out of the last
    step."""
    bodies = solid_bodies(m)
    seen = (m.body_contype[bodies] | m.body_conaffinity[bodies]) != 0
    awake = d.body_awake[bodies] == IS_AWAKE
    low, high = boxes(m, d, bodies).transpose(1, 0, 2)
    meets = (low[awake, None] <= high) & (low <= high[awake, None])
    near = meets.all(axis=2).any(axis=0)
    return {m.body(body).name for body in bodies[(near | awake) & ~seen]}


def overlooked_in(simulation: Simulation, tick: Callable[[], object], until: float) -> set[str]:
    """What is overlooked in any step, of those that are not gone back from."""
    found = set[str]()

    def step(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
        since, most = set[str](), 0
        for _ in range(steps):
            d.maxuse_con = 0
            mujoco.mj_step(m, d)
            since |= overlooked(m, d)
            most = max(most, d.maxuse_con)
        d.maxuse_con = most
        if steps == 1 or not most:
            found.update(since)

    with stepping(step):
        while simulation.physical.time < until and not simulation.physical.delivered():
            tick()
    return found


def overlooked_in_run(made: str | Layout, until: float = 4.0, **given: Any) -> set[str]:
    """What is overlooked in any step of a run."""
    simulation = ready(made, **given)
    return overlooked_in(simulation, lambda: simulation.supervisor.step(MOST), until)


RUNS: list[tuple[str, dict[str, Any]]] = [
    ("paper", {}),
    ("fence", {"distributed": True}),
    ("fence", {}),
    ("chest", {"settings": Settings(timestep=0.004, substeps=3, stage=1)}),
    ("20", {"fuse": True, "wip": 1}),
    ("tee", {"units": 3}),
    ("bar", {}),
]
COARSE = "20", {"settings": Settings(timestep=0.01, substeps=1)}


@pytest.mark.parametrize(("name", "given"), [*RUNS, pytest.param(*COARSE, marks=pytest.mark.slow)])
def test_nothing_that_moves_or_is_met_is_left_out(name: str, given: dict[str, Any]) -> None:
    """In every step, by the engine's own poses and boxes."""
    assert overlooked_in_run(name, **given) == set()


@pytest.mark.parametrize("number", range(3))
def test_nothing_is_left_out_of_random_products(number: int) -> None:
    style = ("small", "large", "mixed")[number]
    layout = random_layout(8, number, "any", style)
    assert overlooked_in_run(layout, 3.0, fuse=number == 1) == set()


def test_nothing_is_left_out_from_a_marking() -> None:
    start = random_marking(layout_of("chest"), 1)
    assert overlooked_in_run("chest", 2.0, start=start) == set()


def test_nothing_is_left_out_where_robots_collide() -> None:
    simulation = ready("20", distributed=True)
    tick = gone_wild(simulation, 1)
    assert overlooked_in(simulation, tick, 1.6) == set()
    assert simulation.physical.inspection.unintended


def test_much_of_a_factory_is_left_out() -> None:
    """Where so many robots are that any is left out without being told to."""
    simulation = ready("40", units=9)
    shares = []
    for _ in range(1100):
        simulation.supervisor.step()
        shares.append(looked_at(simulation))
    assert np.mean(shares[400:]) < 0.65 and min(shares) < 0.4


def test_a_small_factory_is_looked_at_as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 250)
    simulation = ready("paper")
    for _ in range(100):
        simulation.supervisor.step()
        assert looked_at(simulation) == 1.0


# --- what is pushed, touched or off its way -------------------------------------------------------


PUSH = Deviation("push", body="r1/carriage", force=(0.0, 1.0, 0.0), at=0.1, seconds=0.1)


def test_everything_is_looked_at_while_something_is_pushed() -> None:
    pushed = deviate(ready("paper"), PUSH)
    handled = ready("paper")
    Interventions(handled).push(0, 0.5, 0.1)
    for simulation in (pushed, handled):
        for _ in range(10):
            simulation.supervisor.step()
            assert looked_at(simulation) == 1.0


@pytest.mark.parametrize("calm", [CALM, 0.0])
def test_everything_is_looked_at_for_a_while_after_a_push(
    calm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted fault: with no time for it, other modes begin and leave something out."""
    monkeypatch.setattr(neighbours, "CALM", calm)
    simulation, shares, later = ready("20"), list[float](), list[float]()
    world = simulation.physical
    while world.time < 2.9:
        if world.time == pytest.approx(1.8):
            Interventions(simulation).push(0, 0.1, 0.05)
        simulation.supervisor.step()
        if 1.81 < world.time < 1.85 + 0.9 * CALM:
            shares.append(looked_at(simulation))
        elif world.time > 2.4:
            later.append(looked_at(simulation))
    assert not world.inspection.unintended
    assert (min(shares) == 1.0) == (calm > 0.0)
    assert min(later) < 1.0


@pytest.mark.parametrize("steps", [1, 2, 10])
def test_what_leaves_its_way_is_noticed(steps: int) -> None:
    """Nothing is left out that a robot may meet where it was not to be."""
    simulation = ready("20")
    for _ in range(60):
        simulation.supervisor.step()
    world = simulation.physical
    assert looked_at(simulation) < 1.0
    axis = next(a for a in range(world.motion.axes.tray) if a not in world.motion.active)
    world.m.jnt_limited[:] = False
    world.d.qpos[world.motion.axes.qpos[axis]] = -0.01
    world.advance(steps)
    assert looked_at(simulation) == 1.0


# --- boxes ----------------------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    ("name", "given"),
    [("fence", {}), ("chest", {"fuse": True}), ("20", {}), ("tee", {}), ("bar", {})],
)
def test_what_a_holder_has_is_within_its_box(name: str, given: dict[str, Any]) -> None:
    simulation = ready(name, **given)
    while simulation.physical.time < 8.0:
        for _ in range(10):
            simulation.supervisor.step()
        assert within_boxes(simulation)


def test_what_a_run_starts_with_is_within_boxes() -> None:
    for seed in range(4):
        start = random_marking(layout_of("chest"), seed)
        simulation = ready("chest", start=start)
        assert within_boxes(simulation)
        simulation.supervisor.step()
        assert within_boxes(simulation)


# --- planted faults -------------------------------------------------------------------------------


def test_a_forgotten_grip_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes of robots without what they carry."""
    welds = Holdings.welds
    monkeypatch.setattr(
        Holdings, "welds", lambda self: ((weld, code) for weld, code in welds(self) if code > 12)
    )
    simulation = ready("chest")
    found = overlooked_in(simulation, lambda: simulation.supervisor.step(MOST), 4.0)
    assert found or not within_boxes(simulation)


def test_a_forgotten_holder_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neighbours of every other holder only."""
    met = neighbours._met

    def forgetful(holders: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
        found = met(holders[::2], low, high)
        found[holders] = True
        return found

    monkeypatch.setattr(neighbours, "_met", forgetful)
    assert overlooked_in_run("20")


def test_boxes_that_are_too_small_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Boxes of where holders were when the run began, not of where they go."""
    simulation = ready("20")
    monkeypatch.setattr(neighbours.Extents, "go", lambda self, axes, x: None)
    monkeypatch.setattr(neighbours.Extents, "stand", lambda self, d: None)
    monkeypatch.setattr(Neighbours, "astray", lambda _: False)
    assert overlooked_in(simulation, lambda: simulation.supervisor.step(MOST), 4.0)


def test_what_is_awake_and_in_no_mode_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only what the active modes move is taken for what moves."""
    of_trees = neighbours._of_trees
    monkeypatch.setattr(neighbours, "_of_trees", lambda m, code: 0 * of_trees(m, code))
    assert overlooked_in_run("20")


@pytest.mark.parametrize("kind", ["robot", "feeder"])
@pytest.mark.parametrize("noticed", [True, False])
def test_what_is_given_something_is_looked_at(
    kind: str, noticed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From the next step on; planted fault: it is not noticed."""
    if not noticed:
        look = Neighbours.look
        monkeypatch.setattr(
            Neighbours, "look", lambda self: (self._masks.fresh.clear(), look(self))
        )
    simulation = ready("20", units=9)
    world = simulation.physical
    m, d, parts = world.m, world.d, world.parts
    code, tray = parts.masks.code, parts.tray
    own = [b for b in solid_bodies(m) if b not in parts.masks.solid]
    own = [b for b in own if (0 < code[b] < tray if kind == "robot" else code[b] > tray)]
    while m.body_contype[own].all():
        simulation.supervisor.step()
        assert world.time < 10.0
    holder = next(b for b in own if not m.body_contype[b])
    body = int(next(iter(parts.holdings.body.values()))[-1])
    x, y, z = d.xpos[holder].tolist()
    parts.welds.place(body, (x, y, z + 1.0))
    parts.welds.set_holder([body], int(code[holder]))
    parts.welds.write()
    world.advance(2)
    assert bool(m.body_contype[holder]) == noticed


def test_masks_are_those_of_holders() -> None:
    """A body that is left out has the mask that it had when it is looked at again."""
    simulation = ready("20", units=9)
    masks: ContactMasks = simulation.physical.parts.masks
    m = simulation.physical.m
    everything = np.ones(int(masks.code.max()) + 1, bool)
    for _ in range(50):
        for _ in range(10):
            simulation.supervisor.step()
        now = m.body_contype.copy(), m.body_conaffinity.copy()
        masks.look(everything)
        for body, geoms in masks.solid.items():
            assert (m.geom_contype[geoms] == m.body_contype[body]).all()
            assert (m.geom_conaffinity[geoms] == m.body_conaffinity[body]).all()
        m.body_contype[:], m.body_conaffinity[:] = now
