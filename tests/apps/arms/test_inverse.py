"""Solutions of the inverse kinematics, and what is said of poses out of reach. Legs are clear or
say what blocked them; the configurations of a circuit are the best."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from factory.apps.arms import planning
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.inverse import SINGULAR, solutions
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.planning import ArmPlanner
from factory.apps.arms.reach import Unreachable, diagnose_reach
from factory.apps.arms.slowness import enforce_limits, tool_shares
from factory.apps.arms.travel import travels
from tests.arm_models import ANY_TOOL_SPEED, PACE, both, configurations, down, random_way, shipped


def test_what_is_too_far_is_so_many_millimetres_short() -> None:
    """The edge is reached, and 1 mm beyond it is not."""
    distance = 0.95
    chain = shipped("six")
    place = np.array([0.6, 0.8, 0.0]) * distance + [0.0, 0.0, 0.15]
    why = diagnose_reach(chain, place, down(0.4))
    assert why is not None and why.reach is not None
    assert why.distance == pytest.approx(distance) and 0.5 < why.reach < distance
    for reach, there in ((why.reach - 5e-4, True), (why.reach + 5e-4, False)):
        at = np.array([0.6, 0.8, 0.0]) * reach + [0.0, 0.0, 0.15]
        (q,) = solutions(chain, at[None], down(0.4)[None], 256)
        assert bool(len(q)) is there
    short = (distance - why.reach) * 1e3
    assert why.message("lid", "left") == (
        f"'lid' is {distance:.3f} m from the axis of left, at 0.15 m above its base; "
        f"it comes to {why.reach:.3f} m there, {short:.0f} mm short"
    )


def test_what_is_too_near_too_high_or_nearly_singular_is_told_apart() -> None:
    chain = shipped("six")
    near = diagnose_reach(chain, np.array([0.0, 0.1, 0.15]), down(0.0))
    assert near is not None and near.reach is not None and near.reach > 0.13
    assert near.message("lid", "left").endswith(f"it comes no nearer than {near.reach:.3f} m there")
    high = diagnose_reach(chain, np.array([0.2, 0.1, 2.0]), down(0.0))
    assert high == Unreachable(pytest.approx(np.hypot(0.2, 0.1)), 2.0, None)
    assert high.message("a", "b").endswith("no place at that height so turned")
    edge = diagnose_reach(chain, np.array([1.0, 0.0, 0.15]), down(0.0))
    assert edge is not None and edge.reach is not None
    bent = diagnose_reach(chain, np.array([edge.reach - 1e-3, 0.0, 0.15]), down(0.0))
    assert bent is not None and bent.singular is not None and bent.singular < SINGULAR
    words = "'lid' is reached by left only within 0.08 of a singular configuration"
    assert bent.message("lid", "left") == words
    assert diagnose_reach(chain, np.array([0.3, 0.35, 0.15]), down(0.0)) is None


def test_limits_stretch_no_more_than_they_must() -> None:
    for seed in range(6):
        chain = shipped("six")
        way = random_way(chain, seed, (1.0, 0.03)[seed % 2])
        speed, push = way.shares(chain.limits, PACE)
        _, first, second = way.at(np.linspace(0.0, way.length, 3000))
        fast = np.abs(first) * PACE.speed / chain.limits.speed
        gain = np.abs(first) * PACE.acceleration + np.abs(second) * PACE.speed**2
        assert (fast.max(axis=0) <= speed + 1e-9).all()
        need = (gain / chain.limits.acceleration).max(axis=0)
        assert (need <= push + 1e-9).all() and (push <= 1.6 * need).all()
        assert max(speed.max(), push.max()) <= 1.0
        assert max(speed.max(), push.max()) > 1.0 - 1e-9
        shorter = way.stretch(0.98)
        assert shorter.length == pytest.approx(0.98 * way.length)
        again = enforce_limits(shorter, chain, ANY_TOOL_SPEED)
        assert again.length == pytest.approx(way.length, rel=1e-9)
        slower = enforce_limits(way, chain, PACE)
        assert tool_shares(chain, slower, PACE).max() <= 1.0
        assert slower.length > way.length or seed % 2


def test_knots_that_make_no_way_are_refused() -> None:
    for knots in ([0.0, 1.0, 2.0], [0.0, 1.0, 1.0, 2.0], [0.5, 1.0, 2.0, 3.0]):
        with pytest.raises(ValueError, match="knots for"):
            JointWay(np.array(knots), np.zeros((len(knots), 2)))


SEEDS = range(30)


def test_no_point_is_faster_than_its_levers() -> None:
    """Levers bound the Jacobian of every point of a body, and are no idle bound."""
    used = 0.0
    for seed in SEEDS:
        chain, _, _ = both(seed)
        q, frame = configurations(chain, 100, seed), len(chain)
        points = np.random.default_rng(seed).normal(size=(3, 3)) * 0.1
        lever = chain.lever(frame, points)
        columns = np.array(
            [replace(chain, tool_place=point).jacobian(q)[:, :3] for point in points]
        )
        speed = np.linalg.norm(columns, axis=2).max(axis=(0, 1))
        assert (speed <= lever + 1e-12).all()
        used = max(used, float((speed / lever)[~chain.slides].max(initial=0.0)))
    assert used > 0.95


STEPS = 20


def points_at(chain: SerialChain, body: ConvexBody, q: np.ndarray) -> np.ndarray:
    """Points of a body (..., k, 3) in the base frame."""
    place, turn = chain.frames(q)
    there = turn[..., body.frame, :, :] @ body.points.T
    return np.asarray(np.swapaxes(there, -1, -2) + place[..., None, body.frame, :])


def tip(chain: SerialChain) -> ConvexBody:
    """What is at the tool: a point."""
    return ConvexBody("tip", len(chain), chain.tool_place[None] * 1.5)


def test_nothing_is_nearer_than_the_lemma_says() -> None:
    """The distance of a tool from a point near its way, between samples of random chains with
    hinges and slides."""
    for seed in range(8):
        chain, _, _ = both(seed)
        rng = np.random.default_rng(seed)
        knots = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 1.0, 9))])
        way = JointWay(knots, configurations(chain, 10, seed) * rng.uniform(0.05, 1.0))
        x = np.linspace(0.0, way.length, 251)
        tool = tip(chain)
        fine = np.linspace(0.0, way.length, 250 * STEPS + 1)
        path = points_at(chain, tool, way.at(fine)[0])[:, 0]
        near = path[rng.integers(len(path))] + rng.normal(0.0, 1e-3, 3)
        distance = np.linalg.norm(path - near, axis=-1)
        least = np.lib.stride_tricks.sliding_window_view(distance, STEPS + 1)[::STEPS].min(axis=1)
        at = distance[::STEPS]
        bound = (at[:-1] + at[1:] - travels(chain, way, x, [tool])[:, 0]) / 2
        assert (least >= bound - 1e-12).all()
        assert (least < at[:-1]).any()


@pytest.mark.parametrize(
    ("label", "held"), [("lid", [True, True, False, True]), ("", [False, True, False])]
)
def test_a_part_counts_until_it_is_over_its_place(
    label: str, held: list[bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is judged with the arm while the arm takes it up and on the way; at its place no more, but
    for the hand of the carrier there."""
    asked = list[Any]()
    way = JointWay(np.linspace(0.0, 1.0, 5), np.zeros((5, 2)), 0.1, 0.8)
    planner: Any = ArmPlanner.__new__(ArmPlanner)
    planner.chain = SimpleNamespace(bodies=[])
    stands = {"the floor", "the bar of the carrier"}
    planner.scene = SimpleNamespace(
        margins=lambda q, label, need, spared, held: (held, spared), obstacles=stands
    )
    burden = SimpleNamespace(onto=0, source=1, join=None, takes=None, comes=(0, 0, 1))
    planner.cell = SimpleNamespace(burdens=dict.fromkeys(("lid", "tub"), burden), lines=[None])
    planner.pace, empty = None, lambda *_: set()
    planner.spared = SimpleNamespace(
        moving=frozenset(), at=empty, under=empty, hand=lambda _: {"the bar of the carrier"}
    )
    for name in ("_have", "_carried"):
        monkeypatch.setattr(ArmPlanner, name, lambda *_: set())
    monkeypatch.setattr(planning, "leg", lambda *_, **__: way)

    def certify(
        chain: object, way: JointWay, stretch: object, bodies: object, margins: Any
    ) -> None:
        asked.append((stretch, margins(q=way.places)))

    monkeypatch.setattr(planning, "uncertified", certify)
    end = SimpleNamespace(rows=np.zeros((2, 2)), share=0.1)
    assert planner._leg(end, end, label, "tub", "lid") is way
    stretches = [(0.0, 0.1), (0.1, 0.8), (0.8, 1.0), (0.8, 1.0)]
    assert [stretch for stretch, _ in asked] == stretches[: len(held)]
    assert [counts for _, (counts, _) in asked] == held
    assert not label or asked[-1][1][1] == {"the floor"}
