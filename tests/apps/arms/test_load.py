"""What an arm can bring: its drives have the torque, and its pad the pull, for all speeds and
accelerations of its pace."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from factory.api import RunError
from factory.apps.arms.cell import ToolGrip
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.load import PLACES, STEP, Load
from factory.floor.geometry.solids import Solid
from factory.floor.layout.hands.tips import tip
from factory.pipeline import Project, all_templates
from factory.theory.lang import read_pag
from tests.arm_models import PACE, random_way, shipped

RADIUS = 0.015


def solid(mass: float = 1.0) -> Solid:
    text = "root = x; x = mate ( a, b ); a = atomic ( box = (0.1, 0.1, 0.01), pos = (0, 0, 0) );"
    text += f"b = atomic ( box = (0.08, 0.04, 0.02), pos = (0.01, 0, 0.0152), mass = {mass} )"
    templates = all_templates()
    return Project(read_pag(text, templates), templates).product.solids["b"]


def load(seed: int, mass: float = 1.0, radius: float = RADIUS) -> Load:
    part = solid(mass)
    grip = ToolGrip(np.array([0.02, 0.005, part.high[2]]), 0.7, radius)
    chain = shipped("six")
    return Load("r2", "b", part, grip, chain, random_way(chain, seed))


@pytest.mark.parametrize("seed", range(2))
def test_the_pull_is_that_of_a_part_that_is_moved(seed: int) -> None:
    """By the change of its momenta in time, of motions through places of the way."""
    one, dt, worst = load(seed), 1e-4, 0.0

    def at(x: float) -> tuple[np.ndarray, np.ndarray]:
        place, turn = one.chain.tool(one.way.at(np.array([x]))[0])
        return place[0] + turn[0] @ one.center, turn[0]

    def turned(before: np.ndarray, after: np.ndarray, over: float) -> np.ndarray:
        """Angular velocity from one orientation to another."""
        spin = (after - before) @ ((before + after) / 2).T / over
        return (
            np.array([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]])
            / 2
        )

    for x in np.linspace(STEP, one.way.length - STEP, PLACES):
        gone = min(x, one.way.length - x)
        for fast in (0.0, min(PACE.speed, (2 * PACE.acceleration * gone) ** 0.5)):
            for push in (-PACE.acceleration, PACE.acceleration):
                moments = x + fast * np.arange(-2, 3) * dt + push * (np.arange(-2, 3) * dt) ** 2 / 2
                places, turns = zip(*(at(float(s)) for s in moments), strict=True)
                moved = (places[3] - 2 * places[2] + places[1]) / dt**2
                momenta = [
                    t @ one.moment @ t.T @ turned(b, a, 2 * dt)
                    for b, t, a in zip(turns, turns[1:], turns[2:], strict=False)
                ]
                force = turns[2].T @ (one.burden.mass * ([0.0, 0.0, -9.81] - moved))
                twist = -turns[2].T @ (momenta[2] - momenta[0]) / (2 * dt)
                moment = twist + np.cross(one.center, force)
                used = tip("suction").used(
                    np.array([0.0, 0.0, 1.0]), np.array(RADIUS), np.zeros(3), force, moment
                )
                worst = max(worst, float(used))
    assert one.pull(PACE) == pytest.approx(worst, rel=0.02)


def test_at_rest_a_pad_bears_the_weight_below_it() -> None:
    chain = shipped("six")
    q = np.tile([0.3, -1.2, 1.4, -pi / 2 - 0.2, pi / 2, 0.0], (4, 1))
    down = chain.tool(q[:1])[1][0]
    assert abs(down[2, 2]) == pytest.approx(1.0, abs=1e-9)
    q[:, 0] += np.linspace(0.0, 0.5, 4)
    one = load(0)
    one = replace(one, chain=chain, way=JointWay(np.linspace(0.0, 1.0, 4), q))
    centred = replace(one, grip=replace(one.grip, tip=one.burden.centre))
    share = centred.pull(WayLimits(1e-6, 1e-6))
    assert share == pytest.approx(9.81 / (5e4 * pi * RADIUS**2), rel=1e-3)


def test_the_mass_that_is_named_is_the_greatest() -> None:
    """For the pad, and for the drives."""
    damping = np.zeros(6)
    for mass, radius in ((8.0, RADIUS), (60.0, 0.5)):
        with pytest.raises(RunError) as error:
            load(1, mass, radius).check(PACE, damping)
        (why,) = error.value.diagnostics
        assert why.code == "ArmLoad" and f"'b' of {mass:g} kg" in why.message
        assert ("its pad" in why.message) == (radius == RADIUS)
        most = float(why.hint.split("at most ")[1].split()[0])
        load(1, 0.98 * most, radius).check(PACE, damping)
        with pytest.raises(RunError):
            load(1, 1.02 * most, radius).check(PACE, damping)


def test_a_slower_pace_is_named_where_it_helps() -> None:
    heavy = load(2, 1.0)
    used = heavy.pull(PACE)
    slow = WayLimits(PACE.speed / 2, PACE.acceleration / 4)
    calm = heavy.pull(slow)
    assert calm < used
    for mass, helps in ((1.0 / (used * 0.9), True), (1.0 / (calm * 0.9), False)):
        with pytest.raises(RunError) as error:
            load(2, mass).check(PACE, np.zeros(6))
        assert ("--acceleration" in error.value.diagnostics[0].hint) == helps


def test_a_pin_bears_more_than_a_pad() -> None:
    """As much more as it is pressed on, where nothing slips."""
    one = load(1, 2.0)
    pinned = replace(one, grip=replace(one.grip, kind="pin"))
    assert not one.is_borne(PACE, np.zeros(6)) and pinned.is_borne(PACE, np.zeros(6))
    assert pinned.pull(PACE) < one.pull(PACE) / 50
    with pytest.raises(RunError) as error:
        replace(pinned, grip=replace(pinned.grip, radius=1e-4)).check(PACE, np.zeros(6))
    assert "its pin, 0.1 mm in radius" in error.value.diagnostics[0].message
