"""Blocks, of which drawn products are made: what is in an arm's way, and what it holds."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from factory.api import RunRequest, Simulation
from factory.apps.arms import planning
from factory.apps.arms.scene import StandingBox
from factory.apps.runs.watched import watched
from factory.engine.mjcf import names
from factory.support.arrays import Array
from factory.support.engine import mujoco
from tests.arm_cells import chains, project, refusal

TALL = """root = x;
x = mate ( a, b );
a = atomic ( box = (0.03, 0.04, 0.1), pos = (0, 0, 0.05) );
b = atomic ( box = (0.03, 0.03, 0.03), pos = (0, 0, 0.1152) )"""


def test_all_that_stands_is_in_an_arms_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """The uprights of the outfeed's shed, too, with its shutter up, which are twice as tall as a
    product."""
    boxes, obstacles = list[StandingBox](), planning.obstacles

    def seen(*of: Any) -> Iterator[StandingBox]:
        boxes[:] = obstacles(*of)
        return iter(boxes)

    monkeypatch.setattr(planning, "obstacles", seen)
    world = Simulation(project(TALL, "six").layout, RunRequest(units=1)).physical
    m, d, stands = world.m, world.d, 0
    mujoco.mj_forward(m, d)
    for geom in range(m.ngeom):
        body = m.body(int(m.geom_bodyid[geom])).name
        if body in ("outfeed", names.SHUTTER) or (body.startswith("feeder") and "/" not in body):
            stands += 1
            low, high = extent(m, d, geom)
            assert any(
                (low >= np.subtract(box.low, 1e-6)).all() and (high <= np.add(box.high, 1e-6)).all()
                for box in boxes
            ), f"{m.geom(geom).name} from {low.round(4)} to {high.round(4)}"
    assert stands > 8


def extent(m: mujoco.MjModel, d: mujoco.MjData, geom: int) -> tuple[Array, Array]:
    """The box of a geom in the world."""
    middle, half = m.geom_aabb[geom, :3], m.geom_aabb[geom, 3:]
    turn = d.geom_xmat[geom].reshape(3, 3)
    at, reach = d.geom_xpos[geom] + turn @ middle, np.abs(turn) @ half
    return at - reach, at + reach


ON_A_FACE = """root = s4;
s1 = mate ( p0, p1 );
s2 = mate ( p2, p3 );
s3 = mate ( s1, p4 );
s4 = mate ( s2, s3 );
p0 = atomic ( box = (0.02, 0.02, 0.1), pos = (0, 0, 0.05) );
p1 = atomic ( cylinder = (0.005, 0.02), pos = (-0.001, -0.016, 0.01) );
p2 = atomic ( box = (0.01, 0.02, 0.03), pos = (-0.003, 0.006, 0.1155) );
p3 = atomic ( box = (0.02, 0.04, 0.1), pos = (0.0205, 0.014, 0.05) );
p4 = atomic ( box = (0.02, 0.02, 0.01), pos = (0.003, -0.0145, 0.1055) )"""
"""s3 is held on its face towards -y, and comes from a side."""


UNDER_A_HAND = """root = s2;
s1 = mate ( p2, p1 );
s2 = mate ( s1, p0 );
p0 = atomic ( cylinder = (0.02, 0.02), pos = (0, 0, 0.01) );
p1 = atomic ( box = (0.06, 0.01, 0.1), pos = (0.0505, -0.005, 0.05) );
p2 = atomic ( cylinder = (0.02, 0.02), pos = (0.0585, 0.012, 0.111) );"""
"""The carrier holds p2 from behind, by a bar over where p0 belongs."""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (UNDER_A_HAND, "stem and the bar of the carrier"),
        (ON_A_FACE, "s3/taken and the pad of the carrier"),  # which is 0.2 mm from s3, too
    ],
)
def test_a_carriers_hand_is_in_an_arms_way(
    text: str, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And in that of what the arm brings."""
    monkeypatch.setattr(planning, "CERTAIN_AT_HAND", 3e-4)
    assert said in refusal(text).message


def test_what_is_held_on_a_face_hangs_on_that_face() -> None:
    """In a run, too, where its load was measured as if every face were towards -x: the arm was said
    to drop it."""
    layout = project(ON_A_FACE, "six").layout
    assert chains(layout).heading("s3") == (0.0, 1.0)
    done = watched(Simulation(layout, RunRequest(units=1, shown=False)))
    assert done.succeeded and done.physics is not None
    assert 0.0 < (done.physics.grip_strength_share_max or 0.0) < 1.0
