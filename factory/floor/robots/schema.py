"""What is read of the MJCF of a robot type: elements, attributes, joints, numbers, and names with a
meaning."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping

from factory.support.xml_tree import Element, XmlDocument
from factory.theory.problem.robot_bodies import LIFT_JOINT, MOTIONS, SLIDE, TURN_JOINT

JOINTS = {
    joint: (motion.body, "hinge" if motion.rotary else "slide", motion.direction)
    for joint, motion in MOTIONS.items()
    if motion.direction
}
"""Each joint that a robot may have: its body, type and axis."""

KINDS = (SLIDE,), (SLIDE, LIFT_JOINT), (LIFT_JOINT, TURN_JOINT)
"""The joints that a robot has, from the carriage up."""

MOVING = tuple(body for body, *_ in JOINTS.values())
"""The bodies with joints, each inside the one before; that of a robot that stands has none."""

SIZES = {"box": 3, "sphere": 1, "cylinder": 2, "capsule": 2, "ellipsoid": 3}
"""How many sizes each type of geom has."""

BOXES, RODS = ("arm", "finger"), ("pin", "column", "pad")
"""Geoms that are stretched, or replaced by those of a hand: boxes and cylinders."""

FITTED = dict.fromkeys(BOXES, "box") | dict.fromkeys(RODS, "cylinder")
"""The type that each of these has."""

HAND = ("finger", "pin", "column", "pad")
"""Geoms that stand for a hand, where none is chosen."""

LIMBS = ("tower", "beam", "bar", "cross", "riser", "stem", "number")
"""Names of geoms that are added."""

MATERIALS = ("steel", "rubber")
"""Materials that hands are made of."""

MAY_HAVE: Mapping[str, tuple[str, ...]] = {
    "mujoco": ("model",),
    "default": ("class",),
    "asset": (),
    "material": ("name", "rgba", "specular", "shininess", "emission", "reflectance"),
    "worldbody": (),
    "actuator": (),
    "body": ("name", "childclass"),
    "geom": (
        *("name", "class", "type", "size", "pos", "mass", "material", "rgba"),
        *("contype", "conaffinity", "condim", "friction", "group"),
    ),
    "joint": ("name", "type", "axis", "range", "armature", "frictionloss"),
    "site": ("name", "pos", "size", "group", "rgba"),
    "position": ("name", "joint", "kp", "kv", "forcerange"),
}
"""The attributes that are read, of each element that is."""

INSIDE: Mapping[str, tuple[str, ...]] = {
    "mujoco": ("default", "asset", "worldbody", "actuator"),
    "default": ("default", "geom"),
    "asset": ("material",),
    "worldbody": ("body",),
    "actuator": ("position",),
    "body": ("joint", "geom", "site", "body"),
}
"""The elements that are read inside others."""

COUNTS: Mapping[str, tuple[int, int]] = {
    **dict.fromkeys(("size", "friction"), (1, 3)),
    **dict.fromkeys(("pos", "axis"), (3, 3)),
    "rgba": (4, 4),
    **dict.fromkeys(("forcerange", "range"), (2, 2)),
    **dict.fromkeys(("mass", "armature", "frictionloss", "kp", "kv", "condim", "group"), (1, 1)),
    **dict.fromkeys(("contype", "conaffinity"), (1, 1)),
    **dict.fromkeys(("specular", "shininess", "emission", "reflectance"), (1, 1)),
}
"""How many numbers an attribute has, at least and at most."""

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)

GREATEST = 1e6
"""No number is greater."""

DEEPEST = 20
"""So deep are elements inside each other at most."""


class RobotDocument(XmlDocument):
    """The MJCF of a robot type, and the faults found in it (BadRobot)."""

    def __init__(self, robot: str, file: str, text: str) -> None:
        super().__init__(file, text.split("\n"), "BadRobot")
        self.robot = robot

    def wrong(self, element: Element, what: str, valid: str) -> None:
        """Note what was found at an element, and what would have been valid."""
        self.fault(element, f"robot type '{self.robot}': {what}", f"valid: {valid}")

    def schema(self, root: Element) -> None:
        """Raises InputError where there is what is not read, or numbers that are none."""
        if root.name != "mujoco":
            self.wrong(root, f"the root is <{root.name}>", "<mujoco>")
            self.stop()
        for element, what, valid in _unread(root):
            self.wrong(element, what, valid)
        self.stop()

    def name(self, element: Element, taken: Container[str]) -> str:
        """The name of an element, which no other of its kind has."""
        name = element.attributes.get("name", "")
        if not re.fullmatch(r"[A-Za-z_][\w-]*", name, re.ASCII):
            self.wrong(element, f"<{element.name}> is called '{name}'", "letters, digits, - and _")
        elif name in taken:
            self.wrong(element, f"two <{element.name}> are called '{name}'", "different names")
        return name

    def least(self, element: Element, key: str, above: bool) -> float:
        """A number of an element, `above` 0 or at least 0; 0 where it is not given."""
        value = numbers(element.attributes.get(key, "0"))[0]
        if value < 0 or (above and value == 0 and key in element.attributes):
            valid = "above 0" if above else "0 or more"
            self.wrong(element, f"{key} is {element.attributes[key]}", valid)
        return value


def numbers(text: str) -> list[float]:
    """The numbers in an attribute."""
    return [float(word) for word in text.split()]


def _unread(element: Element, deep: int = 0) -> Iterator[tuple[Element, str, str]]:
    """What is not read of an element: where, what was found, what would have been valid."""
    if deep > DEEPEST:
        yield element, f"<{element.name}> is {deep} elements deep", f"at most {DEEPEST}"
        return
    have = MAY_HAVE[element.name]
    for key, text in element.attributes.items():
        if key not in have:
            names = ", ".join(have) or "no attribute"
            yield element, f"<{element.name}> has '{key}', which is not read", names
        elif key in COUNTS:
            least, most = COUNTS[key]
            words = text.split()
            parsed = [float(word) for word in words if NUMBER.fullmatch(word)]
            good = least <= len(words) <= most and len(parsed) == len(words)
            if not good or any(abs(number) > GREATEST for number in parsed):
                count = f"{least}" if least == most else f"{least} to {most}"
                valid = f"{count} number{'s'[: most > 1]} up to {GREATEST:g}"
                yield element, f"{key} of <{element.name}> is '{text}'", valid
    inside = INSIDE.get(element.name, ())
    for child in element.children:
        if child.name in inside:
            yield from _unread(child, deep + 1)
        else:
            names = ", ".join(f"<{name}>" for name in inside) or "nothing"
            yield child, f"<{child.name}> inside <{element.name}> is not read", names
