"""Cells with tools and with sub-assemblies: what arms take, in which order, and when carriers
leave."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from unittest.mock import patch

import mujoco
import numpy as np
import pytest

from factory.api import Project
from factory.apps.arms import arrangement
from factory.apps.arms.arming import armed, on_rails
from factory.apps.arms.body import PAD_RADIUS, STEM, Stand, standing
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.circuit import EVERY_JOINT, candidates, circuit, free_candidates
from factory.apps.arms.inverse import solutions
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.legs import NoWay, transfer
from factory.apps.arms.model import ArmModel
from factory.apps.arms.scene import FAR, OWN, Scene, StandingBox
from factory.apps.arms.sharing import STEPS, SweptArm
from factory.support.arrays import Array, Index
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates
from tests.arm_cells import chains, project, refusal
from tests.arm_models import (
    ball,
    configurations,
    down,
    nothing,
    random_way,
    retreat,
    shipped,
    straight_line,
)

POST = """root = p;
p = inspect ( q, dwell = 0.2 ); q = mate ( a, s );
s = press ( t, dwell = 0.2 ); t = mate ( b, c );
a = atomic ( box = (0.28, 0.06, 0.02), pos = (0, 0, 0.01), density = 500 );
b = atomic ( box = (0.04, 0.04, 0.02), pos = (0.115, 0, 0.0301), density = 1200 );
c = atomic ( box = (0.03, 0.03, 0.02), pos = (0.115, 0, 0.0502), density = 1200 )"""
"""A base, and at its front end a block with a knob, which is pressed on before: the carrier that
brings the block has it ahead of the product's middle."""

ROOF = """root = p;
p = mate ( a, s, d ); s = mate ( b, c );
a = atomic ( box = (0.12, 0.06, 0.02), pos = (0, 0, 0.01), density = 1200 );
b = atomic ( box = (0.04, 0.04, 0.02), pos = (-0.02, 0, 0.0301), density = 1200 );
c = atomic ( box = (0.08, 0.05, 0.01), pos = (0, 0, 0.0452), density = 1200 );
d = atomic ( box = (0.03, 0.03, 0.016), pos = (0.02, 0, 0.0281), density = 1200 )"""
"""A block under a roof that stands on another."""


@cache
def plain(text: str) -> Project:
    templates = all_templates()
    return Project(read_pag(text, templates), templates)


@cache
def six() -> ArmModel:
    """The shipped arm of six axes."""
    return ArmModel.of("six")


def test_what_can_only_be_lowered_before_comes_before() -> None:
    """The block goes under the roof before that is on."""
    made = armed(plain(ROOF), six())
    order = [n.inputs[-1] for n in made.pag.nodes if n.operation == "place"]
    assert order == ["d", "s/taken", "c"]
    lowered = {label: a.lowered for label, a in made.approaches.items() if len(label) > 1}
    assert all(lowered.values())


def test_a_pile_on_rails_is_what_the_cell_makes_of_it() -> None:
    """Without what moves it only, and each place an insert."""
    made = armed(plain(POST), six())
    rails = on_rails(plain(POST), made.pag, "s/shown").pag
    assert rails.root == "s" and {n.label: n.operation for n in rails.nodes} == {
        "s": "press",
        "t": "insert",
        "b": "atomic",
        "c": "atomic",
    }
    whole = on_rails(plain(POST), made.pag, "p").pag
    assert {n.label for n in whole.nodes} == {"p", "q", "s", "t", "a", "b", "c"}


def test_a_heavy_part_is_held_by_a_pin() -> None:
    heavy = POST.replace("0.0502), density = 1200", "0.0502), mass = 3")
    layout = project(heavy, "six").layout
    assert {label: grip.kind for label, grip in chains(layout).grips.items()}["c"] == "pin"
    from factory.floor.layout.hands.bores import bores

    (bore,) = [bore for bore in bores(layout) if bore.label == "c"]
    assert bore.robot == "r5" and bore.diameter == chains(layout).grips["c"].radius


@pytest.mark.slow
def test_eight_sub_assemblies_have_no_room() -> None:
    parts, joins = [], []
    for n in range(8):
        x = 0.06 * n
        parts.append(f"b{n} = atomic ( box = (0.05, 0.05, 0.02), pos = ({x}, 0, 0.0301) )")
        parts.append(f"c{n} = atomic ( box = (0.03, 0.03, 0.02), pos = ({x}, 0, 0.0502) )")
        joins.append(f"s{n} = mate ( b{n}, c{n} )")
    base = "a = atomic ( box = (0.5, 0.06, 0.02), pos = (0.21, 0, 0.01) )"
    whole = f"p = mate ( a, {', '.join(f's{n}' for n in range(8))} )"
    why = refusal(";\n".join(["root = p", whole, *joins, base, *parts]))
    assert why.code in ("Layout", "Unreachable") and "rails" in why.hint


def test_a_line_without_room_says_how_much_is_missing() -> None:
    """Where a block with a drawer is built, beside a pedestal as wide as the cell."""
    text = """root = p;
p = mate ( a, s ); s = mate ( t, d ); t = mate ( b, c );
a = atomic ( box = (0.12, 0.1, 0.02), pos = (0, 0, 0.01) );
b = atomic ( box = (0.05, 0.06, 0.05), pos = (-0.025, 0, 0.0451) );
c = atomic ( box = (0.1, 0.06, 0.008), pos = (0, 0, 0.0743) );
d = atomic ( box = (0.045, 0.05, 0.03), pos = (0.0227, 0, 0.0501) )"""
    with patch.object(arrangement, "pedestal", lambda stand: (-9.0, 9.0, -9.0, 9.0)):
        why = refusal(text)
    assert why.code == "Layout" and why.position is not None and why.position.line == 2
    told = (
        r"the line of r2, on which 's' is built, has no room at its arm: it is (\d+) mm wide and"
        r" at best \d+ mm too near to the base of r3; the arm has its wrist beside it for 'd'"
    )
    wide = re.fullmatch(told, why.message)
    assert wide is not None and int(wide[1]) > 300, why.message
    assert why.hint.startswith("parts that are lowered")


LEFT, RIGHT = np.array([0.2, 0.38, 0.15]), np.array([0.2, -0.38, 0.15])
UP = ([np.linspace(0.0, 0.085, 25)[:, None] * [0.0, 0.0, 1.0]],) * 2


def visit(chain: SerialChain, place: Array) -> Array:
    """A straight line (25, n) of configurations up from a place, elbow up."""
    (q,) = solutions(chain, place[None], down(0.0)[None])
    high = chain.frames(q)[0][:, 3, 2]
    start = q[[int(high.argmax())]]
    return np.asarray(straight_line(chain, start, retreat(chain, start), 0.085)[0][0])


def limits(chain: SerialChain) -> tuple[Array, Array]:
    return chain.limits.low, chain.limits.high


def test_where_there_is_no_way_the_pair_that_blocked_is_named() -> None:
    """A wall of a joint's positions, whatever the others are; pair 3 is nearest in it."""
    chain = shipped("six")
    a, b = visit(chain, LEFT)[-1], visit(chain, RIGHT)[-1]
    wall = (a[0] + b[0]) / 2

    def clearance(q: Array) -> tuple[Array, Index]:
        margin = np.abs(q[:, 0] - wall) - 0.05
        return margin, np.where(np.abs(q[:, 0] - wall) < 0.04, 3, 1)

    blocked = transfer(a, b, clearance, limits(chain), rounds=60)
    assert isinstance(blocked, NoWay)
    assert blocked.pair == 3 and 0.02 < blocked.depth <= 0.056 + 1e-9 and blocked.count > 5
    narrow = replace(chain, limits=replace(chain.limits, low=np.minimum(a, b)))
    assert isinstance(transfer(a, b, clearance, limits(narrow), rounds=20), NoWay)


def poses(place: Array, count: int) -> tuple[Array, Array]:
    """One place in several turns about the vertical."""
    turns = np.stack([down(yaw) for yaw in 2 * np.pi * np.arange(count) / count])
    return np.tile(place, (count, 1)), turns


def test_free_candidates_pair_any_branches() -> None:
    """They have those on one branch, and others; each is at both poses, and clear."""
    chain = shipped("six")
    near = np.array([0.0, 0.3, 1.9, -0.6, -1.57, 0.0])
    takes, puts = poses(LEFT, 2), poses(RIGHT, 2)
    same = candidates(chain, takes, puts, nothing, near, UP)
    free = free_candidates(chain, takes, puts, nothing, near, UP)
    assert free.blocked is None and len(free.pairs) > len(same.pairs)
    for k, (place, turn) in enumerate((takes, puts)):
        at, now = chain.tool(free.pairs[:, k])
        assert np.abs(at - place[free.grips]).max() < 1e-8
        assert np.abs(now - turn[free.grips]).max() < 1e-8
    none = free_candidates(chain, takes, puts, ball(chain, RIGHT, 0.3), near, UP)
    assert len(none.pairs) == 0 and none.blocked is not None


def test_the_circuit_is_the_best_of_all() -> None:
    rng = np.random.default_rng(3)
    options = [
        rng.normal(size=(int(rng.integers(1, 5)), 2, 3)) for _ in range(int(rng.integers(1, 5)))
    ]
    speed = rng.uniform(0.5, 2.0, 3)

    def cost(choice: tuple[int, ...]) -> float:
        rows = [options[k][j] for k, j in enumerate(choice)]
        stops = [q for pair in rows for q in pair]
        times = [np.abs(b - a) / speed for a, b in pairwise([*stops, stops[0]])]
        return float(sum(t.max() + EVERY_JOINT * t.sum() for t in times))

    best = min(product(*(range(len(pairs)) for pairs in options)), key=cost)
    assert cost(tuple(circuit(options, speed))) == pytest.approx(cost(best), rel=1e-12)


def scene_of(stand: Stand, boxes: tuple[StandingBox, ...] = (), name: str = "six") -> Scene:
    half, still = np.array([0.02, 0.03, 0.015]), np.array([0.0, 1.0, 0.0, 0.0])
    loads = {"part": [(np.array([0.0, 0.0, STEM + 0.016]), half, still)]}
    model = ArmModel.of(name)
    return Scene(model, standing(model, stand), loads, boxes)


def swept_by(scene: Scene, chain: SerialChain, way: JointWay, label: str = "") -> SweptArm:
    """What an arm sweeps with its tool, and with a part that fills a ball round it."""
    carried = [ConvexBody("part", len(chain), chain.tool_place[None], 0.05)]
    return SweptArm.of(scene, chain, way, carried, label)


def both_scenes(name: str) -> tuple[Scene, Scene]:
    """Two arms that face each other."""
    off = {"six": 0.7, "scara": 0.5}[name]
    return (
        scene_of(Stand((0.0, -off, 0.1), 1.57, PAD_RADIUS), name=name),
        scene_of(Stand((0.0, off, 0.1), -1.57, PAD_RADIUS), name=name),
    )


def test_the_capsules_of_an_arm_are_no_farther_apart_than_its_bodies() -> None:
    """Spheres within the shapes of a part and links, against the capsules."""
    scene, _ = both_scenes("six")
    way = random_way(shipped("six"), 5)
    swept = swept_by(scene, shipped("six"), way, "part")
    geoms = [*scene.links, *scene.loads["part"]]
    q = way.at(np.linspace(0.0, way.length, STEPS + 1))[0]
    rng = np.random.default_rng(6)
    for row in range(0, STEPS + 1, 93):
        scene.d.qpos[:] = q[row]
        mujoco.mj_kinematics(scene.m, scene.d)
        for ends, radius, g in zip(swept.ends[row], swept.radius, geoms, strict=True):
            half = scene.m.geom_aabb[g, 3:]
            inner = rng.choice([-1.0, 1.0], (8, 3)) * half
            if scene.m.geom_type[g] != mujoco.mjtGeom.mjGEOM_BOX:
                inner[:, :2] /= np.sqrt(2)
            if scene.m.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE:
                inner *= np.sqrt(2 / 3)
            elif scene.m.geom_type[g] == mujoco.mjtGeom.mjGEOM_CAPSULE:
                inner[:, 2] = np.sign(inner[:, 2]) * scene.m.geom_size[g, 1]
            turn = scene.d.geom_xmat[g].reshape(3, 3)
            points = scene.d.geom_xpos[g] + scene.m.geom_aabb[g, :3] @ turn.T + inner @ turn.T
            u = ends[1] - ends[0]
            share = np.clip((points - ends[0]) @ u / max(float(u @ u), 1e-12), 0.0, 1.0)
            off = np.linalg.norm(points - ends[0] - share[:, None] * u, axis=1)
            assert off.max() <= radius + 1e-9, scene.names[g]


def test_a_part_that_is_held_turned_is_turned() -> None:
    """The engine looks at the frame that a geom has got after it was compiled."""
    angle = 0.0
    scene = scene_of(Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS))
    m, d, (load,) = scene.m, scene.d, scene.loads["part"]
    m.geom_quat[load] = [0.0, np.cos(angle / 2), np.sin(angle / 2), 0.0]
    mujoco.mj_kinematics(m, d)
    tool = d.xmat[m.geom_bodyid[load]].reshape(3, 3)
    held, turn = tool.T @ d.geom_xmat[load].reshape(3, 3), np.empty(9)
    mujoco.mju_quat2Mat(turn, m.geom_quat[load])
    assert np.abs(held - turn.reshape(3, 3)).max() < 1e-9


def test_margins_are_those_of_all_pairs() -> None:
    """Against the engine's distances of every pair, of which several boxes have one name."""
    rng = np.random.default_rng(7)
    boxes = tuple(
        StandingBox(
            f"box {k % 5}",
            tuple((low := rng.uniform(-0.8, 0.6, 3)).tolist()),
            tuple((low + size).tolist()),
        )
        for k, size in enumerate(rng.uniform(0.05, 0.2, (8, 3)))
    )
    scene, need = scene_of(Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS), boxes), 0.01
    chain: SerialChain = shipped("six")
    q, spared = configurations(chain, 70, 8), {"box 3"}
    seen = 0
    for label in ("", "part"):
        margin, pair = scene.margins(q, label, need, spared)
        m, d = scene.m, scene.d
        moving = [*scene.links, *scene.loads.get(label, ())]
        still = [g for g in scene.still if scene.say(g * m.ngeom).split(" and ")[0] not in spared]
        for row in range(len(q)):
            d.qpos[:] = q[row]
            mujoco.mj_kinematics(m, d)
            away = [
                mujoco.mj_geomDistance(m, d, a, b, FAR, None) - need for a in moving for b in still
            ]
            own = [mujoco.mj_geomDistance(m, d, a, b, FAR, None) - OWN for a, b in scene._own]
            if label:
                own += [
                    mujoco.mj_geomDistance(m, d, a, b, FAR, None) - OWN
                    for a in scene.loads[label]
                    for b in scene._far_links
                ]
            least = min(FAR - need, *away, *own)
            assert margin[row] == pytest.approx(least, abs=1e-6), (row, scene.say(int(pair[row])))
            seen += least < 0.0
    assert 10 < seen < 110
