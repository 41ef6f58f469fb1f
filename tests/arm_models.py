"""Arms for tests: random chains as MJCF, the shipped ones, random poses, ways and obstacles."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import mujoco
import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.inverse import tool_line
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.apps.arms.legs import Clearance
from factory.apps.arms.model import ArmModel, arm_model
from factory.apps.arms.slowness import enforce_limits
from factory.support.arrays import Array, Index, Truth

PACE = WayLimits()

ANY_TOOL_SPEED = WayLimits(tool_speed=1e3, end_speed=1e3)
"""Limits of which only those of the joints count."""


@cache
def shipped(name: str) -> SerialChain:
    """An arm of the catalogue."""
    return ArmModel.of(name).chain


def chain_in(text: str, file: str = "arm.xml") -> SerialChain:
    """The arm of an MJCF."""
    return arm_model("own", Path(file), text, {}).chain


def down(yaw: float) -> Array:
    """The orientation of a tool that points down, turned about the vertical."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


def straight_line(
    chain: SerialChain, q: Array, way: Array, length: float, count: int = 25
) -> tuple[Array, Truth]:
    """Configurations (m, count, n) at equal distances along straight lines of the tool [m] in
    directions (3,) or (m, 3), and whether the arm follows each (m,)."""
    heights = np.linspace(0.0, length, count)
    return tool_line(chain, q, heights[:, None, None] * np.atleast_2d(way))


def retreat(chain: SerialChain, q: Array) -> Array:
    """The directions (..., 3) in which the tool leaves what it is at: against its z."""
    return -chain.tool(q)[1][..., :, 2]


def random_arm(seed: int) -> str:
    """The MJCF of a chain of 2 to 7 joints in degrees: hinges and slides with anchors off their
    bodies' origins and reference positions, two joints on some bodies, fixed bodies between and
    beside them, tilted inertias, motors with inertia, weights that are compensated in part."""
    rng = np.random.default_rng(seed)

    def numbers(size: int, scale: float = 1.0) -> str:
        return " ".join(map(str, (scale * rng.normal(size=size)).tolist()))

    def inertial() -> str:
        a, b = rng.uniform(0.01, 0.03, 2)
        mass, c = rng.uniform(0.3, 3.0), rng.uniform(abs(a - b) + 1e-3, a + b - 1e-3)
        place = f'pos="{numbers(3, 0.1)}" quat="{numbers(4)}"'
        return f'<inertial {place} mass="{mass}" diaginertia="{a} {b} {c}"/>'

    def joint(number: int) -> str:
        kind = "slide" if rng.random() < 0.25 else "hinge"
        extent = "-0.2 0.3" if kind == "slide" else "-170 170"
        reference = 0.05 if kind == "slide" else 20.0
        return (
            f'<joint name="j{number}" type="{kind}" pos="{numbers(3, 0.1)}" axis="{numbers(3)}" '
            f'range="{extent}" ref="{reference}" armature="{rng.uniform(0, 0.5)}"/>'
        )

    text, closing, number, count = "", "", 0, int(rng.integers(2, 8))
    while number < count:
        joints = min(count - number, int(rng.integers(0, 3)))
        here = "".join(joint(number + k) for k in range(joints))
        number += joints
        place = f'pos="{numbers(3, 0.2)}" quat="{numbers(4)}"'
        text += f'<body {place} gravcomp="{rng.choice([0, 0.4])}">{here}{inertial()}'
        text += f'<geom type="box" size="0.02 0.03 0.04" pos="{numbers(3, 0.1)}"/>'
        text += f'<body pos="{numbers(3, 0.1)}" quat="{numbers(4)}">{inertial()}</body>'
        closing += "</body>"
    site = f'<site name="tool" pos="{numbers(3, 0.1)}" quat="{numbers(4)}"/>'
    rows = "".join(
        f'<numeric name="{name}" data="{" ".join(["2"] * count)}"/>'
        for name in ("speed", "acceleration")
    )
    return (
        f'<mujoco><option><flag contact="disable" limit="disable"/></option>'
        f"<custom>{rows}</custom><worldbody>{text}{site}{closing}</worldbody></mujoco>"
    )


def both(seed: int) -> tuple[SerialChain, mujoco.MjModel, mujoco.MjData]:
    """A random arm, as it is read and as the engine has it."""
    text = random_arm(seed)
    m = mujoco.MjModel.from_xml_string(text)
    return chain_in(text), m, mujoco.MjData(m)


def configurations(chain: SerialChain, count: int, seed: int) -> Array:
    """Random configurations (count, n) within the limits, of hinges within half a turn."""
    rng = np.random.default_rng(seed)
    low, high = np.maximum(chain.limits.low, -np.pi), np.minimum(chain.limits.high, np.pi)
    return np.asarray(rng.uniform(low, high, (count, len(chain))))


def random_way(chain: SerialChain, seed: int, share: float = 1.0) -> JointWay:
    """A way through 8 random configurations in a share of the joints' ranges, as short as their
    limits let it be."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.3, 1.0, 7))])
    places = configurations(chain, 8, seed)
    way = JointWay(1e-3 * x, places[0] + share * (places - places[0]))
    return enforce_limits(way, chain, ANY_TOOL_SPEED)


def ball(chain: SerialChain, center: Array, radius: float) -> Clearance:
    """The clearance of an arm from a ball: of 20 points along each link."""

    def clearance(q: Array) -> tuple[Array, Index]:
        place, _ = chain.frames(q)
        joints = np.concatenate([place, chain.tool(q)[0][:, None]], axis=1)
        share = np.linspace(0.0, 1.0, 20)[:, None, None, None]
        points = joints[:, :-1] + share * np.diff(joints, axis=1)
        apart = np.linalg.norm(points - center, axis=-1).min(axis=0) - radius
        return apart.min(axis=1), apart.argmin(axis=1)

    return clearance


def nothing(q: Array) -> tuple[Array, Index]:
    """The clearance of an arm that stands alone."""
    return np.ones(len(q)), np.zeros(len(q), int)
