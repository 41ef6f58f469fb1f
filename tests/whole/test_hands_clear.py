"""Hands that once met something: each product here is the smallest found of its kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout import clearance
from factory.floor.layout.certificate import Exclusions
from factory.floor.layout.dimensions import BEAM, FINGER_TOP, PAYLOAD
from factory.floor.layout.feeding import feeder_of
from factory.floor.layout.hands.apart import LEVEL, HandsApart
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.holding import Holding
from factory.floor.layout.hands.kinds import ABOVE, BELOW
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.hands.outermost import outermost
from factory.floor.layout.hands.places import Places
from factory.floor.layout.hands.surfaces import Body
from factory.floor.layout.homeward import Homeward
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.support.errors import RunError

AT_MOST_MM = 0.1

PARTS = {
    "a bar behind what is brought": """root = s1; s1 = mate ( p3, p2, p1, p0 );
p0 = atomic ( cylinder = ( 0.02, 0.04 ), pos = ( 0, 0, 0.02 ) );
p1 = atomic ( box = ( 0.02, 0.1, 0.03 ), pos = ( -0.004, 0.033, 0.0555 ) );
p2 = atomic ( box = ( 0.02, 0.03, 0.06 ), pos = ( 0.031, -0.003, 0.03 ) );
p3 = atomic ( box = ( 0.06, 0.03, 0.06 ), pos = ( 0.052, -0.003, 0.091 ) );
""",
    "a column behind which the product ends": """root = s1; s1 = mate ( p5, p4, p3, p2, p1, p0 );
p0 = atomic ( sphere = 0.01, pos = ( 0, 0, 0.01 ) );
p1 = atomic ( cylinder = ( 0.01, 0.06 ), pos = ( 0.004, 0.004, 0.0505 ) );
p2 = atomic ( box = ( 0.01, 0.06, 0.01 ), pos = ( 0, -0.0405, 0.005 ) );
p3 = atomic ( sphere = 0.01, pos = ( 0.005, 0.025, 0.0305 ) );
p4 = atomic ( cylinder = ( 0.02, 0.04 ), pos = ( 0.015, -0.0435, 0.0305 ) );
p5 = atomic ( cylinder = ( 0.005, 0.02 ), pos = ( 0.001, 0.029, 0.0515 ) );
""",
    "a beam under what is lowered": """root = s6; s1 = mate ( p2, p3 ); s2 = mate ( p1, s1 );
s3 = mate ( p0, s2 ); s4 = mate ( s3, p4 ); s5 = mate ( p5, p6 ); s6 = mate ( s4, s5 );
p0 = atomic ( box = ( 0.03, 0.06, 0.06 ), pos = ( 0, 0, 0.03 ) );
p1 = atomic ( box = ( 0.01, 0.06, 0.03 ), pos = ( 0.011, -0.0605, 0.015 ) );
p2 = atomic ( cylinder = ( 0.02, 0.02 ), pos = ( 0.037, -0.0525, 0.01 ) );
p3 = atomic ( cylinder = ( 0.02, 0.02 ), pos = ( -0.0145, -0.0635, 0.01 ) );
p4 = atomic ( cylinder = ( 0.01, 0.06 ), pos = ( 0.019, -0.0615, 0.061 ) );
p5 = atomic ( cylinder = ( 0.01, 0.06 ), pos = ( 0.01, -0.021, 0.091 ) );
p6 = atomic ( box = ( 0.01, 0.06, 0.04 ), pos = ( 0.012, -0.1215, 0.02 ) );
""",
    "a pad along a face": """root = s2; s1 = mate ( p0, p1 ); s2 = mate ( s1, p2 );
p0 = atomic ( box = ( 0.04, 0.01, 0.03 ), pos = ( 0, 0, 0.015 ) );
p1 = atomic ( sphere = 0.01, pos = ( -0.014, 0.008, 0.041 ) );
p2 = atomic ( sphere = 0.01, pos = ( -0.012, 0.008, 0.062 ) );
""",
    "a flat part beside fingers": """root = s1; s1 = mate ( p0, p1, p2, p3, p4, p5, p6, p7 );
p0 = atomic ( box = ( 0.01, 0.02, 0.01 ), pos = ( 0, 0, 0.005 ) );
p1 = atomic ( sphere = 0.015, pos = ( 0.011, 0.007, 0.026 ) );
p2 = atomic ( cylinder = ( 0.02, 0.04 ), pos = ( -0.025, 0.008, 0.031 ) );
p3 = atomic ( sphere = 0.01, pos = ( 0.022, -0.004, 0.052 ) );
p4 = atomic ( box = ( 0.01, 0.02, 0.02 ), pos = ( 0.02, 0.0325, 0.021 ) );
p5 = atomic ( box = ( 0.03, 0.04, 0.1 ), pos = ( -0.061, 0.019, 0.061 ) );
p6 = atomic ( cylinder = ( 0.01, 0.06 ), pos = ( 0.036, 0.0365, 0.041 ) );
p7 = atomic ( cylinder = ( 0.005, 0.02 ), pos = ( 0.033, 0.0435, 0.082 ) );
""",
    "a heavy part on its way down": """root = s6; s1 = mate ( p3, p2 ); s2 = mate ( p6, p5 );
s3 = mate ( s1, p4 ); s4 = mate ( p0, p1 ); s5 = mate ( s3, s2 ); s6 = mate ( s4, s5 );
p0 = atomic ( box = ( 0.1, 0.03, 0.1 ), pos = ( 0, 0, 0.05 ) );
p1 = atomic ( sphere = 0.01, pos = ( -0.001, 0.012, 0.1105 ) );
p2 = atomic ( box = ( 0.03, 0.04, 0.02 ), pos = ( 0.008, 0.02, 0.131 ) );
p3 = atomic ( box = ( 0.04, 0.03, 0.02 ), pos = ( -0.0315, 0.021, 0.1105 ) );
p4 = atomic ( sphere = 0.01, pos = ( 0.034, 0.011, 0.131 ) );
p5 = atomic ( box = ( 0.06, 0.03, 0.06 ), pos = ( 0.021, 0.031, 0.172 ) );
p6 = atomic ( box = ( 0.03, 0.01, 0.04 ), pos = ( -0.066, -0.007, 0.02 ) );
""",
}

ASKEW = """root = s2; s1 = mate ( p0, p1 ); s2 = mate ( p2, s1 );
p0 = atomic ( sphere = 0.01, pos = ( 0, 0, 0.01 ) );
p1 = atomic ( box = ( 0.1, 0.03, 0.03 ), pos = ( 0.04, 0.01, 0.036 ) );
p2 = atomic ( cylinder = ( 0.01, 0.02 ), pos = ( -0.021, 0.005, 0.031 ) );
"""
"""The pad of the output robot is wider than its finger, and is at the product's edge."""

CROSSED = """root = s8; s1 = mate ( p7, p8 ); s2 = mate ( p1, p2 ); s3 = mate ( s2, p0 );
s4 = mate ( p5, p6 ); s5 = mate ( s4, s1 ); s6 = mate ( s3, p3 ); s7 = mate ( p4, s5 );
s8 = mate ( s6, s7 );
p0 = atomic ( box = ( 0.04, 0.02, 0.02 ), pos = ( 0, 0, 0.01 ) );
p1 = atomic ( box = ( 0.04, 0.02, 0.02 ), pos = ( 0.041, 0.007, 0.01 ) );
p2 = atomic ( cylinder = ( 0.01, 0.02 ), pos = ( -0.002, 0.01, 0.0305 ) );
p3 = atomic ( box = ( 0.03, 0.1, 0.06 ), pos = ( 0.006, -0.051, 0.0505 ) );
p4 = atomic ( sphere = 0.01, pos = ( -0.0195, -0.088, 0.0305 ) );
p5 = atomic ( sphere = 0.015, pos = ( 0.0765, 0.02, 0.015 ) );
p6 = atomic ( box = ( 0.03, 0.01, 0.01 ), pos = ( 0.037, -0.094, 0.0255 ) );
p7 = atomic ( cylinder = ( 0.005, 0.04 ), pos = ( -0.0145, -0.019, 0.0405 ) );
p8 = atomic ( cylinder = ( 0.005, 0.06 ), pos = ( -0.009, 0.014, 0.0715 ) );
"""
"""What is brought beside a hand has 3 mm less way than it would have to wait behind a mast."""


BOX = """root = r; r = mate ( a, b ); a = mate ( low, left, right, front, rear, lid );
low = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.005) );
left = atomic ( box = (0.01, 0.06, 0.03), pos = (-0.025, 0, 0.025) );
right = atomic ( box = (0.01, 0.06, 0.03), pos = (0.025, 0, 0.025) );
front = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, -0.025, 0.025) );
rear = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, 0.025, 0.025) );
lid = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.045) );
b = atomic ( box = (0.03, 0.03, 0.02), pos = (0.06, 0, 0.01) )"""
"""Walls that are lowered one after the other, by robots from either side."""


def laid_out(text: str, folder: Path) -> Layout:
    """A product laid out with hands."""
    file = folder / "product.pag"
    file.write_text(text)
    return read(file).layout


@pytest.mark.parametrize("what", sorted(PARTS))
def test_hands_meet_nothing(what: str, tmp_path: Path) -> None:
    simulation = Simulation(laid_out(PARTS[what], tmp_path), RunRequest(units=3, jitter=0.3))
    hidden = HiddenPenetrations.of(simulation)
    simulation.run([lambda state: hidden.look(state.observation.qpos, state.time)], max_time=60.0)
    assert simulation.world.delivered() == 3
    assert simulation.physical.figures().unintended_contacts == 0
    deep = [p.depth_mm for p in hidden.found()]
    assert max(deep, default=0.0) < AT_MOST_MM


@pytest.mark.parametrize("distributed", [False, True])
def test_hands_from_either_side_wait_for_each_other(distributed: bool, tmp_path: Path) -> None:
    asked = RunRequest(units=2, jitter=0.3, seed=1, distributed=distributed)
    run = watched(Simulation(laid_out(BOX, tmp_path), asked), (), 60.0)
    assert run.succeeded, run.verdict.failures
    assert run.products == 2


def test_if_they_did_not_they_would_meet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The certificate says so; a layout that is not asked for one shows it."""
    monkeypatch.setattr(Homeward, "cuts", lambda *_: [])
    with pytest.raises(RunError, match=r"beam of r6, .* and cross of r7, .* both at once"):
        laid_out(BOX, tmp_path)
    monkeypatch.setattr(clearance, "exclusions", lambda *_: Exclusions())
    run = watched(Simulation(laid_out(BOX, tmp_path), RunRequest(units=1)), (), 60.0)
    codes = {failure.code for failure in run.verdict.failures}
    assert "Contact" in codes and codes & {"Dropped", "Stalled"}


@pytest.mark.parametrize("text", [ASKEW, CROSSED, PARTS["a beam under what is lowered"]])
def test_layout_and_certificate_see_the_same_limbs(text: str, tmp_path: Path) -> None:
    layout = laid_out(text, tmp_path)
    assert layout.certificate is not None
    assert layout.certificate.holds
    for robot, hand in enumerate(layout.hands):
        grip = layout.grip(robot)
        found = limbs(layout, robot)
        assert (grip is None) == (hand is None or hand.kind == "none") == (not found)
        for operation in layout.factory.operations[:-1]:
            if robot in operation.robots and robot != operation.carrier:
                waits = layout.standoff(operation, operation.robots.index(robot))
                assert waits <= layout.guidepaths[robot].travel


def test_the_post_of_a_feeder_stands_behind_its_hand(tmp_path: Path) -> None:
    layout = laid_out(PARTS["a heavy part on its way down"], tmp_path)
    leaf = layout.factory.by_label["p0"]
    hand, path = layout.hand(leaf.carrier), layout.guidepaths[leaf.carrier]
    assert hand is not None
    rear = min(path.frame(layout.payloads["p0"])[0], -path.reach - 0.03) - 0.01
    x, y = layout.product.middle[:2] + rear * np.array(path.heading)
    moved = replace(hand, kind=BELOW, places=((float(x), float(y), hand.places[0][2]),))
    hands = tuple(moved if r == leaf.carrier else h for r, h in enumerate(layout.hands))
    there = replace(layout, hands=hands)
    grip, feeder = there.grip(leaf.carrier), feeder_of(there, "p0")
    assert grip is not None
    assert grip[0] <= rear
    assert grip[0] - (feeder.back + 0.015) >= layout.clearance - 1e-9


def test_pads_are_off_all_that_is_under_them() -> None:
    rng = np.random.default_rng(3)
    turns = np.linspace(0, 2 * np.pi, 721)[:-1]
    for _ in range(8):
        cloud = rng.normal(size=(14, 3)) * (0.02, 0.015, 0.01)
        body = Body(cloud.min(axis=0), cloud.max(axis=0), cloud[ConvexHull(cloud).vertices])
        points = np.append(rng.uniform(-0.015, 0.015, size=(8, 2)), np.zeros((8, 1)), axis=1)
        for axis, way in ((2, 1), (2, -1), (0, 1)):
            at = np.roll(points, axis + 1, axis=1)
            found = outermost([body], at, 0.007, (axis, way), np.full(8, -np.inf))
            across = [a for a in range(3) if a != axis]
            for point, most in zip(at, found, strict=True):
                rings = np.linspace(0, 0.007, 60)[:, None, None]
                disc = np.tile(point, (60, len(turns), 1))
                disc[:, :, across] += rings * np.stack([np.cos(turns), np.sin(turns)], axis=1)
                first, last = body.crossed(disc.reshape(-1, 3), axis)
                inside = first <= last
                if not inside.any():
                    continue
                seen = float((last if way > 0 else -first)[inside].max())
                assert seen <= most + 1e-9
                assert most <= seen + 4e-4


def test_a_beam_is_over_that_of_the_carrier_that_it_crosses(tmp_path: Path) -> None:
    layout = laid_out(PARTS["a bar behind what is brought"], tmp_path)
    holding = Holding(layout.factory, layout.product)
    guest = next(r for r, on in enumerate(holding.on) if on == 0)
    above = Hand(ABOVE, ((0.0, 0.0, 0.1),), beam=0.3)
    apart = HandsApart(holding, lambda robot, heading: above)
    frames = [((0.0, 1.0), (1.0, 0.0))]
    beside, across = (
        Places(np.array([[0.0, y, 0.1]]), np.array([0.003]), *[np.array([0.5])] * 3)
        for y in (-0.05, 0.02)
    )
    assert apart.beam(guest, beside, frames) < above.beam
    assert apart.beam(guest, across, frames) == pytest.approx(above.beam + BEAM + LEVEL)


def test_hands_behind_stay_over_the_fingers_of_others(tmp_path: Path) -> None:
    layout = laid_out(PARTS["a flat part beside fingers"], tmp_path)
    tall = [r for r, hand in enumerate(layout.hands) if hand is not None and hand.kind == "behind"]
    assert tall
    for robot in tall:
        low = min(limb.low[2] for limb in limbs(layout, robot) if not limb.name.endswith("tower"))
        assert low > (FINGER_TOP + PAYLOAD) / 2 - 1e-3
