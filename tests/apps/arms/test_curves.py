"""The engine's curves of legs: derivatives, forces, where they are sought; what two arms share; the
clearance of an arm; the wells of parts that rise."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from factory.apps.arms.body import PAD_RADIUS, STEM, Stand, standing
from factory.apps.arms.chain import ConvexBody, SerialChain
from factory.apps.arms.joint_way import JointWay
from factory.apps.arms.model import ArmModel
from factory.apps.arms.scene import FAR, OWN, Scene, StandingBox
from factory.apps.arms.sharing import STEPS, SweptArm
from tests.arm_models import configurations, random_way, shipped


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
