"""Robots as MJCF: the file of a type, instantiated for each robot and stretched to its payload."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.hands import Styles, add_hand
from factory.engine.mjcf.names import carriage, drive_across, head, slide_across, tool
from factory.engine.mjcf.stops import Stops
from factory.engine.mjcf.tools import TOOL, mount_tool
from factory.floor.layout.dimensions import PAYLOAD
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.hands.limbs import Limb
from factory.support.xml_writer import add, number, numbers, prefixed
from factory.theory.plant.axes import Axis
from factory.theory.problem.robot_bodies import LIFT_JOINT, MAST, RobotBody
from factory.theory.problem.robot_types import RobotType

OWN_HAND = {"finger", "pin", "column", "pad"}
"""Geoms of a type's own file that stand for a hand, where none is chosen."""

CAP = "cap"
"""The geom on top of the mast, which is none where a tower is."""


@dataclass(frozen=True, slots=True)
class Held:
    """The hand of a robot: its `limbs`, and what they look like, `styles`."""

    styles: Styles
    limbs: tuple[Limb, ...] = ()


@dataclass(frozen=True, slots=True)
class RobotModel:
    """The MJCF file of a robot type, taken apart: body, actuators, and the shared defaults and
    assets, whose names are prefixed by the type's; `made`: what was read of it."""

    name: str
    made: RobotBody = field(repr=False)
    body: Element = field(repr=False)
    actuators: tuple[Element, ...] = field(repr=False)
    defaults: Element = field(repr=False)
    assets: tuple[Element, ...] = field(repr=False)


@dataclass(frozen=True, slots=True)
class Drive:
    """Gains and limit of an actuator: kp [N/m], kv [N s/m], force [N]; its buffer, of `samples`
    setpoints; and the `inertia` that its motor has besides what its robot type says [kg]."""

    kp: float
    kv: float
    force: float
    samples: int
    inertia: float = 0.0

    def attributes(self) -> dict[str, str]:
        """As attributes of a `pid` actuator, which has three setpoints."""
        return {
            "input": "pos vel ff",
            "kp": number(self.kp),
            "kv": number(self.kv),
            "forcerange": numbers((-self.force, self.force)),
            "nsample": str(self.samples),
        }


MOTOR = 1.6
"""Inertia that the motors of the feeders' sliders and of the shutter add, like a lift's [kg]."""


def add_inertia(joint: Element, drive: Drive) -> None:
    """What the motor of a joint's drive has besides."""
    if drive.inertia:
        joint.set("armature", number(float(joint.get("armature", 0.0)) + drive.inertia))


def add_drive(
    actuator: Element, joint: Element, drive: Drive, stops: Stops, name: str = ""
) -> None:
    """The actuator of a joint, called as that unless it has a `name`, and the joint's stops."""
    add_inertia(joint, drive)
    stops.limit(joint)
    moved = joint.get("name") or ""
    add(actuator, "pid", name=name or moved, joint=moved, **drive.attributes())


def load_robot_model(robot: RobotType) -> RobotModel:
    """The file of a type, whose body has been read."""
    root = ElementTree.parse(robot.mjcf).getroot()
    body = root.findall("worldbody/body")[0]
    actuators = tuple(root.findall("actuator/*"))
    defaults = Element("default", {"class": robot.name})
    for child in root.findall("default/*"):
        defaults.append(prefixed(child, robot.name))
    assets = tuple(prefixed(a, robot.name, names=True) for a in root.findall("asset/*"))
    return RobotModel(robot.name, robot.body, body, actuators, defaults, assets)


ROLES = {
    "output": "0.07 0.45 0.40 1",
    "carrier": "0.13 0.31 0.58 1",
    "fed": "0.52 0.65 0.80 1",
    "tool": "0.90 0.45 0.09 1",
}
"""The paint of robots by what they do: bring the product out, carry sub-assemblies, fetch parts,
work."""


def add_paints(asset: Element) -> None:
    """A material for each role."""
    for role, rgba in ROLES.items():
        add(asset, "material", name=f"role/{role}", rgba=rgba, specular=0.35, shininess=0.45)


@dataclass(frozen=True, slots=True)
class Fitted:
    """An axis of a robot in a model.

    Attributes:
        axis: the axis.
        drive: its drive.
        stops: its end stops.
    """

    axis: Axis
    drive: Drive
    stops: Stops


def instantiate(
    model: RobotModel, path: Guidepath, fitted: Sequence[Fitted], held: Held, role: str = ""
) -> tuple[Element, list[Element]]:
    """The body of one robot at its B end, down, and its actuators.

    Args:
        model: the file of its type.
        path: its guidepath.
        fitted: its axes, the first one first. Other joints of its type are left out.
        held: its hand.
        role: one of ROLES; geometry of the material `paint` takes its colour.
    """
    axes = {each.axis.joint.joint: each for each in fitted}
    first, *_ = fitted
    robot = first.axis.robot.name
    body = prefixed(model.body, model.name)
    for node in body.iter():
        if "name" in node.attrib:
            node.set("name", f"{robot}/{node.get('name')}")
        if role and node.get("material") == f"{model.name}/paint":
            node.set("material", f"role/{role}")
    body.set("name", carriage(robot))
    x, y = path.carriage(path.length)
    body.set("pos", numbers((x, y, 0)))
    body.set("quat", numbers(heading_quaternion(path)))
    body.set("sleep", "allowed")
    bodies = {inner.get("name"): inner for inner in body.iter("body")}
    towers = any(limb.name == "tower" for limb in held.limbs)
    _fit_arm(body, path, OWN_HAND | {CAP} if towers else OWN_HAND, model.made)
    jaws = {jaw.name for jaw in model.made.jaws}
    turning = [limb for limb in held.limbs if not path.travels and limb.name in TOOL]
    others = [limb for limb in held.limbs if limb not in turning]
    others = [limb for limb in others if limb.name.partition("/")[0] not in jaws]
    add_hand(body, bodies.get(head(robot)), held.styles, robot, others, model.name)
    add_hand(body, bodies.get(tool(robot)), held.styles, robot, turning, model.name)
    joints = {joint.get("name"): joint for joint in body.iter("joint")}
    joint = joints[names.joint(first.axis)]
    joint.set("ref", number(path.length))
    first.stops.limit(joint)
    if path.turn is not None:
        mount_tool(body, joint, path.turn, held.limbs, model.made)
    actuators: list[Element] = []
    for actuator in model.actuators:
        each = axes.get(actuator.get("joint") or "")
        if actuator.get("joint") in jaws:
            continue
        if each is None:
            _lock(body, f"{robot}/{actuator.get('joint')}")
            continue
        moved = joints[names.joint(each.axis)]
        named = {"name": names.actuator(each.axis), "joint": names.joint(each.axis)}
        actuators.append(Element("pid", {**named, **each.drive.attributes()}))
        add_inertia(moved, each.drive)
        if each is not first:
            each.stops.limit(moved)
        elif path.way:
            actuators.append(_bend(body, moved, actuators[-1], robot, path, each.stops))
    return body, actuators


def _lock(body: Element, joint: str) -> None:
    """Take a joint out of a body, which nothing moves."""
    for inner in body.iter("body"):
        for each in inner.findall("joint"):
            if each.get("name") == joint:
                inner.remove(each)


def _bend(
    body: Element, slide: Element, actuator: Element, robot: str, path: Guidepath, stops: Stops
) -> Element:
    """A second slide for a guidepath with bends, beside the one along the heading, which gets the
    stops that the way has there; its actuator, which is like the first."""
    across = deepcopy(slide)
    across.set("name", slide_across(robot))
    across.set("axis", numbers((0.0, path.left, 0.0)))
    body.insert([*body].index(slide) + 1, across)
    beyond = stops.high - path.length
    pieces = path.framed(stops.low + beyond, stops.high - beyond)
    ends = np.concatenate(pieces).T.tolist()
    b_end = path.framed(path.length, path.length)[0][0].tolist()
    for joint, values, at in zip((slide, across), ends, b_end, strict=True):
        joint.set("ref", number(at))
        Stops(min(values) - beyond, max(values) + beyond, stops.buffers).limit(joint)
    second = deepcopy(actuator)
    second.attrib.update(name=drive_across(robot), joint=slide_across(robot))
    return second


def heading_quaternion(path: Guidepath) -> tuple[float, float, float, float]:
    """The orientation of a robot: its local x is the heading, one of four world directions."""
    half = 0.5**0.5
    east = {(1, 0): (1.0, 0.0), (0, 1): (half, half), (-1, 0): (0.0, 1.0), (0, -1): (half, -half)}
    w, z = east[round(path.heading[0]), round(path.heading[1])]
    return (w, 0.0, 0.0, z)


def _fit_arm(body: Element, path: Guidepath, without: Collection[str], made: RobotBody) -> None:
    """The arm from the mast to the rim, of a robot whose hand goes on from there, `without` some
    geoms; a tool's head reaches a little further."""
    rim = max(path.reach - path.arm, MAST / 2 + 0.002)
    parents = {child: parent for parent in body.iter() for child in parent}
    for geom in list(body.iter("geom")):
        name = (geom.get("name") or "").rpartition("/")[2]
        if name == "arm":
            _span(geom, 0.0, rim)
        elif name in without:
            parents[geom].remove(geom)
    for lifted in body.iter("body"):
        if (lifted.get("name") or "").endswith("/head"):
            beside = sum(jaw.mass for jaw in made.jaws)
            mass = number(round(made.axis(LIFT_JOINT).mass - beside, 9))
            inertia = {"pos": "0 0 0.1", "mass": mass, "diaginertia": "2e-4 2e-4 2e-4"}
            lifted.insert(1, Element("inertial", inertia))
    for site in body.iter("site"):
        if (site.get("name") or "").endswith("/nest"):
            site.set("pos", numbers((path.reach, 0.0, PAYLOAD)))


def _span(geom: Element, start: float, end: float) -> None:
    """Make a box reach ahead from start to end [m]."""
    _, y, z = (float(v) for v in (geom.get("pos") or "0 0 0").split())
    _, wide, high = (float(v) for v in (geom.get("size") or "1 1 1").split())
    geom.set("pos", numbers(((start + end) / 2, y, z)))
    geom.set("size", numbers(((end - start) / 2, wide, high)))
