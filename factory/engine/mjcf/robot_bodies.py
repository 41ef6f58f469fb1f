"""All robots of a layout: a body each, of its type's file, with its hand and its actuators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.elements import add_shown
from factory.engine.mjcf.hands import Styles, load_hand
from factory.engine.mjcf.names import carriage
from factory.engine.mjcf.robots import (
    Drive,
    Fitted,
    Held,
    RobotModel,
    instantiate,
    load_robot_model,
)
from factory.engine.mjcf.scene import add_follower
from factory.engine.mjcf.stops import stops_of
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.limbs import limbs
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array
from factory.support.xml_writer import add, numbers
from factory.theory.plant.factory import Factory
from factory.theory.plant.robot import Robot
from factory.theory.problem.robot_types import Catalogue

STROKES = {
    "a": (0.0, 0.6, 0.84, 1.0),
    "b": (0.44, 0.6, 0.42, 1.0),
    "c": (0.44, 0.6, 0.0, 0.58),
    "d": (0.0, 0.6, 0.0, 0.16),
    "e": (0.0, 0.16, 0.0, 0.58),
    "f": (0.0, 0.16, 0.42, 1.0),
    "g": (0.0, 0.6, 0.42, 0.58),
    "i": (0.22, 0.38, 0.0, 1.0),
    "j": (0.06, 0.38, 0.84, 1.0),
}
"""The strokes of digits that are one unit high: from where to where to the right and up."""

DIGITS = "abcdef", "ij", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "abcdfg"
"""The strokes of each digit."""

WIDE, STEP = 0.6, 0.8
"""How wide a digit is, and how far the next is from it, as shares of its height."""

RAISED = 3e-4
"""How far the strokes stand out [m]."""

MARGIN = 0.002
"""How far they stay from the edges on top at least [m]."""

MAST = 0.0125
"""How far from the middle of the top the mast and its cap reach [m]."""

LIGHT, DARK = "0.97 0.97 0.97 1", "0.09 0.10 0.12 1"
INKS = {"output": LIGHT, "carrier": LIGHT, "fed": DARK, "tool": DARK}
"""What can be read on the paint of each role."""


def add_number(body: Element, asset: Element, robot: str, path: Guidepath, role: str) -> None:
    """The number of a robot `r3` on the box of its carriage; none on one of another shape."""
    box = next((g for g in body.findall("geom") if g.get("name") == carriage(robot)), None)
    digits = robot.lstrip("r")
    if box is None or not digits.isdecimal():
        return
    half = np.array([float(v) for v in (box.get("size") or "").split()])
    middle = np.array([float(v) for v in (box.get("pos") or "0 0 0").split()])
    if half.shape != (3,):
        return
    corners = np.concatenate([*_texts(digits, half, path)]) + middle
    faces = (4 * np.arange(len(corners) // 4)[:, None] + [0, 1, 2, 0, 2, 3]).ravel()
    name = f"number/{robot}"
    places = np.round(corners, 5).ravel().tolist()
    vertices = " ".join(["%.5g"] * len(places)) % tuple(places)
    add(asset, "mesh", name=name, inertia="shell", vertex=vertices, face=numbers(faces))
    shell = next((b for b in body.findall("body") if b.get("name") == f"{robot}/shell"), body)
    add_shown(shell, f"{robot}/number", "mesh", mesh=name, rgba=INKS.get(role, LIGHT))


def _texts(digits: str, half: Array, path: Guidepath) -> Iterator[Array]:
    """The corners of the strokes (4 n, 3) on each face of a box about its middle [m]."""
    up = np.array([0.0, 0.0, 1.0])
    for axis in (0, 1):
        for side in (-1.0, 1.0):
            out = np.zeros(3)
            out[axis] = side
            room = np.array([1.6 * half[1 - axis], 1.4 * half[2]])
            at = out * (half[axis] + RAISED) + up * 0.1 * half[2]
            yield _text(digits, at, np.cross(up, out), up, room)
    north = np.array([path.heading[1], path.heading[0], 0.0])
    rear, beside = half[0] - MAST - 2 * MARGIN, 2 * (half[1] - MARGIN)
    at = np.array([-MAST - MARGIN - rear / 2, 0.0, half[2] + RAISED])
    room = np.array([beside, rear] if abs(north[0]) > 0.5 else [rear, beside])
    yield _text(digits, at, np.cross(north, up), north, room)


def _text(digits: str, at: Array, right: Array, up: Array, room: Array) -> Array:
    """The corners (4 n, 3) of strokes that are centred at a place, no wider and higher than there
    is room [m]."""
    wide = WIDE + STEP * (len(digits) - 1)
    size = min(room[1], room[0] / wide)
    strokes = [(n, STROKES[s]) for n, digit in enumerate(digits) for s in DIGITS[int(digit)]]
    first = STEP * np.array([n for n, _ in strokes])[:, None]
    left, end, low, high = np.array([stroke for _, stroke in strokes]).T
    across = (np.stack([left, end, end, left], axis=1) + first - wide / 2).reshape(-1, 1)
    over = (np.stack([low, low, high, high], axis=1) - 0.5).reshape(-1, 1)
    return np.asarray(at + size * (across * right + over * up))


def add_robots(
    layout: Layout,
    catalogue: Catalogue,
    drives: Sequence[Drive],
    section: Mapping[str, Element],
) -> None:
    """The robots' bodies, actuators, and what their types' files share, into the sections of a
    model, with the drive of each axis."""
    factory = layout.factory
    models: dict[str, RobotModel] = {}
    styles: dict[str, Styles] = {}
    fitted = [
        Fitted(axis, drive, stops_of(*span, layout.clearance))
        for axis, drive, span in zip(factory.axes, drives, layout.spans, strict=True)
    ]
    for robot, path in zip(factory.robots, layout.guidepaths, strict=True):
        if robot.body.first.moves:
            _add_chain(layout, robot, drives[robot.index], section)
            continue
        if robot.type not in models:
            model = models[robot.type] = load_robot_model(catalogue[robot.type])
            section["default"].append(model.defaults)
            section["asset"].extend(model.assets)
        role = role_of(factory, robot.index)
        held = Held(_style(layout.hand(robot.index), styles), limbs(layout, robot.index))
        axes = [fitted[axis] for axis in factory.axes_of(robot.index)]
        body, actuators = instantiate(models[robot.type], path, axes, held, role)
        add_number(body, section["asset"], robot.name, path, role)
        if robot.index == 0:
            add_follower(body, layout)
        section["worldbody"].append(body)
        section["actuator"].extend(actuators)


def _add_chain(layout: Layout, robot: Robot, drive: Drive, section: Mapping[str, Element]) -> None:
    """The body of a robot whose first axis moves several joints, and their actuators."""
    assert layout.chains is not None
    layout.chains.add(robot.index, section)
    gains = layout.chains.drives(robot.index)
    for (joint, actuator), (kp, kv, force) in zip(names.moved_along(robot), gains, strict=True):
        named = {"name": actuator, "joint": joint}
        each = Drive(kp, kv, force, drive.samples)
        section["actuator"].append(Element("pid", {**named, **each.attributes()}))


def _style(hand: Hand | None, loaded: dict[str, Styles]) -> Styles:
    """What the limbs of a hand and its tip look like, each file read once; nothing for none."""
    if hand is None or not hand.kind.holds:
        return {}
    for name in (hand.kind, hand.tip):
        if name not in loaded:
            loaded[name] = load_hand(name)
    return {**loaded[hand.kind], **loaded[hand.tip]}


def role_of(factory: Factory, robot: int) -> str:
    """What a robot does, for its paint."""
    if robot == 0:
        return "output"
    if not (factory.robots[robot].travels and factory.deliveries(robot)):
        return "tool"
    first = factory.first(robot)
    return "carrier" if first.inputs else "fed"
