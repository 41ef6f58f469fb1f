"""The table of control laws: from a template and its guidepaths to a mode. Predicted times against
the field and the governor, integrated. The governor: exact landing under the limits, for any speed,
acceleration and tick."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.support.arrays import Array
from factory.support.errors import InputError
from factory.theory.control.governed import GovernedAxis, Trajectory, mode_ticks, trajectories
from factory.theory.control.governor import follow, govern
from factory.theory.control.laws import LAWS, Setting, law_of
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.control.profile import SpeedProfile
from factory.theory.problem.template import Law, Point, Template
from tests.navigation_functions import potential

MATE = Template(
    name="mate",
    robots=("dot",) * 3,
    carrier=3,
    identifications=((Point("A", 1), Point("A", 2), Point("B", 3)),),
    before=("LAB1", "LAB2", "nopart"),
    after=("nopart", "nopart", "LAB3"),
    law=Law("navigation", (Point("A", 1, 2.0), Point("A", 2, 2.0), Point("B", 3))),
)
SETTING = Setting(
    lower=np.zeros(3),
    upper=np.array([1.0, 1.2, 0.8]),
    r=np.array([0.05, 0.05, 0.1]),
    eps=1e-3,
    station=np.full(3, np.nan),
    width=np.array([0.05, 0.05, 0.1]),
    dwell=0.0,
    gate=np.full(3, -1),
    standoff=np.zeros(3),
)


def mode_of(template: Template, setting: Setting) -> Mode:
    """The mode that a template's F gives."""
    return law_of(template)(template, setting)


def test_stations_gates_width_and_dwell() -> None:
    insert = Template(
        name="insert",
        robots=("dot", "dot"),
        carrier=1,
        identifications=((Point("S", 1, -2.0), Point("A", 2)),),
        before=("LAB1", "LAB2"),
        after=("LAB3", "nopart"),
        law=Law("navigation", (Point("S", 1), Point("A", 2, 2.0))),
    )
    setting = Setting(
        lower=np.zeros(2),
        upper=np.ones(2),
        r=np.full(2, 0.05),
        eps=1e-3,
        station=np.array([0.5, np.nan]),
        width=np.full(2, 0.04),
        dwell=2.0,
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, 0.3]),
    )
    mode = mode_of(insert, setting)
    assert np.allclose(mode.goals, [0.5, 0.1]) and np.allclose(mode.meet, [[0.4, 0.0]])
    assert np.allclose(mode.touch, [0.04]) and mode.dwell == 2.0
    assert mode.gate.tolist() == [-1, 0] and mode.trapped == ()
    with pytest.raises(InputError, match="S1 - 2r names a station, but the guidepath of robot 1"):
        mode_of(insert, replace(setting, station=np.full(2, np.nan)))


def test_waiting_is_a_law_too() -> None:
    mode = mode_of(replace(MATE, law=replace(MATE.law, name="wait")), SETTING)
    assert mode.is_still and mode.size == 3


def test_goals_that_touch_are_not_prepared() -> None:
    law = replace(MATE.law, goals=(Point("A", 1), Point("A", 2), Point("B", 3)))
    with pytest.raises(InputError) as caught:
        mode_of(replace(MATE, law=law), SETTING)
    assert caught.value.diagnostics[0].code == "NotPrepared"
    assert "mate: robots 1 and 2 at their goals touch" in str(caught.value)


def test_an_unknown_law_is_named_with_the_nearest() -> None:
    law = replace(MATE.law, name="navigaton")
    with pytest.raises(InputError, match="unknown control law 'navigaton'") as caught:
        mode_of(replace(MATE, law=law), SETTING)
    assert caught.value.diagnostics[0].hint == "did you mean 'navigation'?"
    assert next(iter(LAWS)) == "navigation"


EPS = 2e-4
TICKS = st.floats(1e-3, 20e-3)


def couriers(distance: Array, speed: Array, acceleration: Array) -> Bundle:
    """Robots that each go its `distance`, every other one down its guidepath, the rest up."""
    goals = np.where(np.arange(distance.size) % 2, 0.0, distance)
    mode = Mode(goals, np.zeros(distance.size), distance, EPS)
    return Bundle.of([mode], [Limits(speed, acceleration)])


def run(bundle: Bundle, x: Array, dt: float, seconds: float) -> tuple[Array, Array, Array]:
    """The governed x, v and acceleration (ticks, n) from rest at x."""
    v, path = np.zeros_like(x), []
    for _ in range(int(seconds / dt) + 3):
        x, v, acceleration = follow(bundle, x, v, dt)
        path.append((x, v, acceleration))
    xs, vs, accelerations = (np.array(column) for column in zip(*path, strict=True))
    return xs, vs, accelerations


@settings(max_examples=20, deadline=None)
@given(TICKS, st.integers(0, 2**32 - 1))
def test_lands_at_rest_without_overshoot_in_the_trapezoid_time(dt: float, seed: int) -> None:
    """Forty robots, 1 mm to 5 m each, with limits of their own."""
    rng, noise, count = np.random.default_rng(seed), 1e-9, 40
    speed, acceleration = rng.uniform(0.05, 3.0, count), rng.uniform(0.2, 20.0, count)
    distance = np.minimum(10 ** rng.uniform(-3.0, np.log10(5.0), count), 15.0 * speed)
    bundle = couriers(distance, speed, acceleration)
    each = zip(distance.tolist(), speed.tolist(), acceleration.tolist(), strict=True)
    ideal = np.array([SpeedProfile(v, a).rest(way) for way, v, a in each])
    xs, vs, accelerations = run(bundle, distance - bundle.goal, dt, ideal.max())
    left = np.abs(bundle.goal - xs)
    assert (np.diff(left, axis=0) <= noise).all()
    assert ((xs >= -noise) & (xs <= distance + noise)).all()
    assert (np.abs(vs) <= speed + noise).all()
    assert (np.abs(accelerations) <= acceleration * (1 + noise)).all()
    rested = (left <= EPS / 10) & (np.abs(vs) <= noise)
    assert rested[-1].all()
    took = (np.argmax(rested, axis=0) + 1) * dt
    assert (took <= ideal + 2 * dt).all()
    assert (took >= ideal - dt).all()


R = 0.1


def two(**changes: Any) -> Mode:
    """Two robots; robot 1's guidepath ends at 0.5 of robot 0's."""
    values: dict[str, Any] = {
        "goals": [0.5 + 2 * R, 2 * R],
        "lower": [0.0, 0.0],
        "upper": [1.0, 1.0],
        "eps": 1e-3,
        "pairs": [[0, 1]],
        "meet": [[0.5, 0.0]],
        "touch": [R],
    }
    return Mode(**(values | changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"goals": []}, "shape"),
        ({"eps": 0.0}, "eps 0"),
        ({"gate": [-1, 0], "standoff": [0.0, 0.9]}, "robot 2: goal 0.2 with standoff 0.9"),
        ({"gate": [-1, 2], "standoff": [0.0, 0.1]}, "there are 2 robots"),
        ({"gate": [1, 0], "standoff": [0.1, 0.1]}, r"robots \[1, 2\] wait for each other"),
        ({"gate": [1, -1], "standoff": [0.1, 0.0]}, "robot 1 waits for a gate"),
        ({"touch": [R, R]}, "1 pairs, 1 meet, 2 touch"),
    ],
)
def test_refuses_what_is_no_mode(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        two(**changes)


@pytest.mark.parametrize("limits", [([np.inf], [1.0]), ([1.0, 1.0], [1.0])])
def test_limits_are_positive_and_complete(limits: tuple[list[float], list[float]]) -> None:
    with pytest.raises(ValueError, match=r"limits|speeds"):
        Limits(*map(np.array, limits))


def test_a_bundle_wants_limits_for_every_robot() -> None:
    with pytest.raises(ValueError, match="mode 1: 1 limits, 2 robots"):
        Bundle.of([two(), two()], [Limits(np.ones(2), np.ones(2)), Limits(np.ones(1), np.ones(1))])


def test_waiting_takes_a_tick_or_its_dwell() -> None:
    limits, drive = Limits(np.ones(2), np.ones(2)), GovernedAxis(1.0, 1.0, 0.01)
    ways = trajectories(Mode.still(2), np.zeros(2), limits, drive)
    assert mode_ticks(Mode.still(2), ways, 0.01) == 1
    assert mode_ticks(replace(Mode.still(2), dwell=0.25), ways, 0.01) == 25


def test_a_way_is_done_with_a_ramp_at_each_end() -> None:
    """0.25 s each, at half of 0.5 m/s; with a speed at the start the first one is shorter."""
    assert SpeedProfile().rest(1.0) == pytest.approx(2 * 0.25 + (1.0 - 2 * 0.0625) / 0.5)
    assert SpeedProfile().rest(1.0, 0.5) == pytest.approx(0.25 + (1.0 - 0.0625) / 0.5)


def test_an_axis_rests_once_it_is_both_near_and_slow() -> None:
    way = Trajectory((0.3, 0.1, 0.0, 0.0), (0.2, 0.1, 0.0, 0.0), (0.2, 0.2, 0.1, 0.0))
    assert (way.within(0.05), way.rests(0.05), way.rests(0.05, still=0.5)) == (2, 3, 2)


def test_limits_hold_along_governed_runs_of_many_modes() -> None:
    """Insertions with jittered limits: limits, domain, gate and goal, tick by tick."""
    rng, count, dt = np.random.default_rng(0), 100, 2e-3
    r = 0.06
    mode = Mode(
        goals=np.array([0.5, 2 * r]),
        lower=np.zeros(2),
        upper=np.array([1.5, 1.5]),
        eps=EPS,
        pairs=np.array([[0, 1]]),
        meet=np.array([[0.5 - 2 * r, 0.0]]),
        touch=np.array([r]),
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, 0.3]),
    )
    limits = [Limits(rng.uniform(0.3, 1.0, 2), rng.uniform(1, 5, 2)) for _ in range(count)]
    bundle = Bundle.of([mode] * count, limits)
    x = np.ravel([rng.uniform(0.3, 1.5, count), rng.uniform(2 * r + 0.3, 1.5, count)], order="F")
    xs, vs, accelerations = run(bundle, x, dt, 9.0)
    assert (np.abs(vs) <= bundle.speed + 1e-12).all()
    assert (np.abs(accelerations) <= bundle.acceleration * (1 + 1e-9)).all()
    assert all(bundle.in_domain(x).all() for x in xs)
    assert bundle.at_goal(xs[-1]).all() and np.abs(vs[-1]).max() < 1e-9
    steps = np.diff([potential(bundle, x) for x in xs], axis=0)
    assert (steps <= 1e-12).all()


def test_planted_field_that_brakes_too_late_is_caught() -> None:
    """The governor brakes half as hard as the field assumes: the reference passes its target."""
    one = np.ones(2)
    bundle, dt = couriers(one, one, 2 * one), 2e-3
    x, v = 1.0 - bundle.goal, np.zeros(2)
    passed = False
    for _ in range(1000):
        x, v, _ = govern(x, v, bundle.field(x + v * (dt / 2), dt), bundle.acceleration / 2, dt)
        passed |= bool(x[0] > 1.0 + EPS)
    assert passed
