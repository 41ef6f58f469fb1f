"""The tool of a fixed robot: what hangs from its beam, turns about the vertical and holds a part.

Its coordinate is an angle, which goes down from where the robot takes a part to where it delivers.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import sqrt
from xml.etree.ElementTree import Element

import numpy as np

from factory.floor.layout.hands.limbs import Limb
from factory.floor.layout.layout import Layout
from factory.support.errors import Diagnostic, InputError
from factory.support.xml_writer import number, numbers
from factory.theory.problem.robot_bodies import LIFT_JOINT, TURN_JOINT, RobotBody

GYRATION = 2e-4
"""Square of the radius of gyration of a tool about each axis [m²]."""

WRIST = 0.004
"""How far below the beam the middle of what shows a tool's turn is [m]."""

TOOL = ("stem", "pad")
"""The limbs of a hand that are the tool of a fixed robot."""


def mount_tool(
    body: Element, joint: Element, turn: float, limbs: Iterable[Limb], made: RobotBody
) -> None:
    """Put a fixed robot's tool, and the origin of its body, where the middle of its pad is. Its
    `joint` turns what it holds by an angle [rad] from the highest coordinate to the lowest. Head
    and tool get their masses; what moves of the robot may sleep, since the rest never does."""
    mass = made.axis(TURN_JOINT).mass
    tool = [limb for limb in limbs if limb.name in TOOL]
    pad = next(limb for limb in tool if limb.name == "pad")
    x, y = ((low + high) / 2 for low, high in zip(pad.low[:2], pad.high[:2], strict=True))
    joint.set("axis", numbers((0.0, 0.0, 1.0 if turn < 0 else -1.0)))
    for part in body.iter("body"):
        kind = (part.get("name") or "").rpartition("/")[2]
        if kind == "head":
            for inertial in part.findall("inertial"):
                inertial.set("mass", number(made.axis(LIFT_JOINT).mass - mass))
            part.set("sleep", body.attrib.pop("sleep", "allowed"))
        elif kind == "tool":
            part.set("pos", numbers((x, y, 0.0)))
            for child in (*part.findall("geom"), *part.findall("site")):
                u, v, z = (float(value) for value in (child.get("pos") or "0 0 0").split())
                if (child.get("name") or "").endswith("/wrist"):
                    u, v, z = x, y, max(limb.high[2] for limb in tool) - WRIST
                child.set("pos", numbers((round(u - x, 9), round(v - y, 9), z)))
            moments = numbers([round(GYRATION * mass, 12)] * 3)
            inertia = {"mass": number(mass), "diaginertia": moments}
            part.insert(1, Element("inertial", {"pos": "0 0 0.1", **inertia}))


def gyration(layout: Layout, robot: int) -> float:
    """Radius of gyration [m] of what a fixed robot holds, about the axis of its tool. Raises
    InputError (NoGrip) where it has no hand."""
    label, *_ = layout.factory.deliveries(robot)
    hand, parts = layout.hand(robot), layout.factory.contents[label]
    if hand is None or not hand.kind.holds:
        message = f"{layout.factory.robots[robot].name} has no hand to turn '{label}' with"
        position = layout.factory.by_label[label].position
        hint = "give the part a flat place above"
        raise InputError(Diagnostic("NoGrip", message, position, hint))
    solids = [layout.product.solids[part] for part in parts]
    axis = np.array(hand.places[0][:2])
    moments = (s.inertia[2, 2] + s.mass * ((s.centre[:2] - axis) ** 2).sum() for s in solids)
    return sqrt(float(sum(moments)) / sum(solid.mass for solid in solids))
