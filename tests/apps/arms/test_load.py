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
from factory.apps.arms.load import Load
from factory.floor.geometry.solids import Solid
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


def test_a_pin_bears_more_than_a_pad() -> None:
    """As much more as it is pressed on, where nothing slips."""
    one = load(1, 2.0)
    pinned = replace(one, grip=replace(one.grip, kind="pin"))
    assert not one.is_borne(PACE, np.zeros(6)) and pinned.is_borne(PACE, np.zeros(6))
    assert pinned.pull(PACE) < one.pull(PACE) / 50
    with pytest.raises(RunError) as error:
        replace(pinned, grip=replace(pinned.grip, radius=1e-4)).check(PACE, np.zeros(6))
    assert "its pin, 0.1 mm in radius" in error.value.diagnostics[0].message
