"""The engine's curves of legs: derivatives, forces, where they are sought; what two arms share; the
clearance of an arm; the wells of parts that rise."""

from __future__ import annotations

from functools import cache
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

import mujoco
import numpy as np
import pytest

from factory.api import Array
from factory.apps.arms.body import PAD_RADIUS, STEM, Stand, standing, with_tool
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.curves import Leg, LegTable, SoughtLegs
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.model import ArmModel
from factory.apps.arms.scene import FAR, OWN, Scene, StandingBox
from factory.apps.arms.sharing import BETWEEN, STEPS, SweptArm, clear_share
from factory.apps.monitor.anatomy import BentWays
from factory.floor.layout.dimensions import PAYLOAD
from tests.arm_cells import cell, chains
from tests.arm_models import configurations, random_way, shipped

REACH = 0.2


@cache
def legs(count: int = 4, name: str = "six") -> tuple[Leg, ...]:
    """Legs on random ways of one length, brought and gone on by turns."""
    chain = shipped(name)
    ways = [random_way(chain, seed, 0.4) for seed in range(count)]
    length = max(way.length for way in ways)
    return tuple(
        Leg(
            chain,
            way.stretch(length / way.length),
            REACH,
            number % 2 == 0,
            np.array([0.01, -0.02, 0.03]),
            np.full(len(chain), 0.3),
        )
        for number, way in enumerate(ways)
    )


def test_the_derivatives_of_a_leg_are_those_by_the_axis() -> None:
    table, rng = LegTable(legs()), np.random.default_rng(1)
    rows, step = np.arange(4), 1e-6
    length = legs()[0].way.length
    x = REACH + rng.uniform(0.05, 0.95, (20, 4)) * length
    (_, first, second), low, high = (table.at(rows, x + off) for off in (0.0, -step, step))
    assert np.abs((high[0] - low[0]) / (2 * step) - first).max() < 1e-5 * np.abs(first).max()
    slack = 1e-3 * np.abs(second).max()
    assert np.abs((high[1] - low[1]) / (2 * step) - second).max() < slack
    ends = table.at(rows, np.full((1, 4), REACH))[0][0]
    for leg, place in zip(legs(), ends, strict=True):
        assert np.abs(place - leg.way.places[-1 if leg.brings else 0]).max() < 1e-12


def test_a_leg_is_followed_from_close_by() -> None:
    table, rng = LegTable(legs()), np.random.default_rng(2)
    rows, length = np.arange(4), legs()[0].way.length
    for _ in range(20):
        x, v = REACH + rng.uniform(0.1, 0.9, 4) * length, rng.normal(size=4)
        place, first, _ = table.at(rows, x)
        at, speed = table.along(rows, place, first * v[:, None], x + rng.uniform(-2e-3, 2e-3, 4))
        assert np.abs(at - x).max() < 1e-9 and np.abs(speed - v).max() < 1e-6


@pytest.mark.parametrize("load", [0.0, 0.7])
def test_the_force_of_a_leg_is_that_of_the_engine(load: float) -> None:
    """By inverse dynamics of the model of the arm on its stand, with its tool, damping and a
    payload."""
    model = ArmModel.of("six")
    root = standing(model, Stand((0.3, 0.1, 0.1), 0.9, PAD_RADIUS))
    center = np.array([0.01, -0.02, 0.03])
    if load:
        tool = next(body for body in root.iter("body") if body.get("name") == "tool")
        place = center + np.array([0.0, 0.0, STEM])
        part = SubElement(tool, "body", pos=" ".join(map(str, place.tolist())))
        SubElement(part, "inertial", pos="0 0 0", mass=str(load), diaginertia="1e-9 1e-9 1e-9")
    m = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    m.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    d, rng = mujoco.MjData(m), np.random.default_rng(3)
    chain = with_tool(model.chain)
    for number, one in enumerate(legs()):
        leg = Leg(chain, one.way, REACH, one.brings, center, np.array(m.dof_damping))
        x = REACH + rng.uniform(0.05, 0.95, 12) * one.way.length
        v, a = rng.uniform(-0.5, 0.5, 12), rng.uniform(-2.0, 2.0, 12)
        found, (g, first, second) = leg.force(x, v, a, load), leg.at(x)
        assert np.array(m.dof_damping).max() > 0.0
        for k in range(12):
            d.qpos[:], d.qvel[:] = g[k], first[k] * v[k]
            d.qacc[:] = first[k] * a[k] + second[k] * v[k] ** 2
            mujoco.mj_inverse(m, d)
            assert (
                np.abs(found[k] - d.qfrc_inverse).max() < 0.02 + 2e-3 * np.abs(d.qfrc_inverse).max()
            ), (number, k, found[k], d.qfrc_inverse)


def test_where_an_arm_is_on_its_legs_is_found_from_its_joints() -> None:
    sought, rng = SoughtLegs([legs()[:2], legs()[2:]]), np.random.default_rng(4)
    length, every = legs()[0].way.length, np.arange(2 * sought.dimension).reshape(2, -1)
    for _ in range(30):
        rows = rng.integers(0, 2, 2)
        x = REACH + rng.uniform(0.02, 0.98, 2) * length
        chosen = [sought.legs[arm][row] for arm, row in enumerate(rows.tolist())]
        there = [leg.at(x[k : k + 1]) for k, leg in enumerate(chosen)]
        places = np.array([point[0][0] for point in there])
        at, first = sought.nearest(places)
        assert np.abs(at - x).max() < 1e-7
        v = rng.normal(size=2)
        moving = np.array([point[1][0] for point in there]) * v[:, None]
        seen = BentWays(np.arange(2), sought, every, every, every)
        assert np.abs(seen.along(places.ravel(), moving.ravel())[1] - v).max() < 1e-5
        assert sought.apart(places).max() < 1e-7
        aside = rng.normal(size=first.shape)
        aside -= (
            (aside * first).sum(axis=1, keepdims=True)
            / (first**2).sum(axis=1, keepdims=True)
            * first
        )
        aside *= 0.003 / np.linalg.norm(aside, axis=1, keepdims=True)
        assert sought.apart(places + aside) == pytest.approx(0.003, rel=0.2)


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


def bodies(scene: Scene, q: Array, label: str) -> list[tuple[mujoco.MjModel, mujoco.MjData, int]]:
    scene.d.qpos[:] = q
    mujoco.mj_kinematics(scene.m, scene.d)
    return [(scene.m, scene.d, g) for g in (*scene.links, *scene.loads.get(label, ()))]


def distance(one: Scene, other: Scene, p: Array, q: Array, labels: tuple[str, str]) -> float:
    """Between two arms, measured by the engine in a model of both."""
    spec = mujoco.MjSpec()
    for m, d, g in (*bodies(one, p, labels[0]), *bodies(other, q, labels[1])):
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom(int(m.geom_type[g])),
            size=m.geom_size[g],
            pos=d.geom_xpos[g],
            quat=quaternion(d.geom_xmat[g]),
        )
    both = spec.compile()
    data = mujoco.MjData(both)
    mujoco.mj_kinematics(both, data)
    cut = len(bodies(one, p, labels[0]))
    return min(
        mujoco.mj_geomDistance(both, data, a, b, 1.0, None)
        for a in range(cut)
        for b in range(cut, both.ngeom)
    )


def quaternion(turn: Array) -> Array:
    made = np.empty(4)
    mujoco.mju_mat2Quat(made, turn)
    return made


@pytest.mark.parametrize("name", ["six", "scara"])
def test_an_arm_is_not_said_to_be_clear_of_another_that_it_is_near(name: str) -> None:
    """On random pairs of ways: up to the share from either end, the engine finds them apart."""
    one, other = both_scenes(name)
    chain, shares = shipped(name), list[float]()
    for seed in range(6):
        ways = random_way(chain, 2 * seed, 0.5), random_way(chain, 2 * seed + 1, 0.5)
        label = "part" * (seed % 2)
        others = [swept_by(other, chain, ways[1], label)]
        swept = swept_by(one, chain, ways[0])
        first, last = clear_share(swept, others), 1.0 - clear_share(swept.backwards, others)
        shares += [first, 1.0 - last]
        rng = np.random.default_rng(seed)
        parts = (0.0, first), (last, 1.0)
        for begin, end in (part for part in parts if part[0] < part[1]):
            for s, t in rng.uniform([begin, 0.0], [end, 1.0], (30, 2)).tolist():
                p, q = (
                    way.at(np.array([at * way.length]))[0][0]
                    for way, at in zip(ways, (s, t), strict=True)
                )
                assert distance(one, other, p, q, ("", label)) > BETWEEN - 1e-6, (seed, s, t)
    assert any(0.0 < share < 1.0 for share in shares)


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


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_part_that_is_held_turned_is_turned(angle: float) -> None:
    """The engine looks at the frame that a geom has got after it was compiled."""
    scene = scene_of(Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS))
    m, d, (load,) = scene.m, scene.d, scene.loads["part"]
    m.geom_quat[load] = [0.0, np.cos(angle / 2), np.sin(angle / 2), 0.0]
    mujoco.mj_kinematics(m, d)
    tool = d.xmat[m.geom_bodyid[load]].reshape(3, 3)
    held, turn = tool.T @ d.geom_xmat[load].reshape(3, 3), np.empty(9)
    mujoco.mju_quat2Mat(turn, m.geom_quat[load])
    assert np.abs(held - turn.reshape(3, 3)).max() < 1e-9


def test_what_is_moved_is_in_the_way_where_it_is_then() -> None:
    """And what is not, where it was; moves are from where all stood first."""
    stand, low, by = Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS), (0.3, -0.1, 0.0), (0.05, 0.02, 0.0)
    boxes = [
        StandingBox(name, (x, y, z), (x + 0.1, y + 0.1, z + 0.3))
        for name, (x, y, z) in (("pile", low), ("post", (-0.3, 0.3, 0.0)))
    ]
    there = StandingBox("pile", (0.35, -0.08, 0.0), (0.45, 0.02, 0.3))
    q = configurations(shipped("six"), 40, 3)
    scene, other = scene_of(stand, tuple(boxes)), scene_of(stand, (there, boxes[1]))
    first = scene.margins(q, "", 0.0, ())[0]
    for _ in range(2):
        scene.move({"pile"}, by)
    margin = scene.margins(q, "", 0.0, ())[0]
    assert np.abs(margin - other.margins(q, "", 0.0, ())[0]).max() < 1e-12
    assert np.abs(margin - first).max() > 1e-3
    scene.move({"pile"}, (0.0, 0.0, 0.0))
    assert (scene.margins(q, "", 0.0, ())[0] == first).all()


def test_margins_are_those_of_all_pairs() -> None:
    """Against the engine's distances of every pair, none left out."""
    rng = np.random.default_rng(7)
    boxes = tuple(
        StandingBox(
            f"box {k}",
            tuple((low := rng.uniform(-0.8, 0.6, 3)).tolist()),
            tuple((low + size).tolist()),
        )
        for k, size in enumerate(rng.uniform(0.05, 0.2, (8, 3)))
    )
    scene, need = scene_of(Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS), boxes), 0.01
    chain: SerialChain = shipped("six")
    q, spared = configurations(chain, 60, 8), {"box 3"}
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


def test_parts_rise_in_their_wells() -> None:
    """From inside the housing to above its rim, clear of its walls."""
    layout = cell()
    product = layout.product
    for label, well in chains(layout).wells.items():
        solid, feeder = product.solids[label], well.feeder
        low, high = solid.low.copy(), solid.high.copy()
        for corner in (low, high):
            corner[:2] += well.place - product.middle[:2]
            corner[2] += PAYLOAD - product.low[2] + well.elevation
        assert feeder.rises and feeder.way == -feeder.stroke
        assert 0.0 < feeder.low < low[2] + feeder.stroke
        assert high[2] + feeder.stroke < feeder.high < low[2]
        xlo, xhi, ylo, yhi = feeder.housing
        assert xlo < low[0] and high[0] < xhi and ylo < low[1] and high[1] < yhi
