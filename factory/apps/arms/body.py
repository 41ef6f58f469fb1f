"""The body of an arm in a model: that of its file on a pedestal, with a suction tool."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, sin
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from factory.apps.arms.chain import SerialChain
from factory.apps.arms.model import ArmModel
from factory.support.xml_writer import prefixed

STEM, PAD = 0.10, 0.004
"""Length of the tool, of which its pad [m]."""

PAD_RADIUS, SLIM = 0.02, 0.75
"""Radius of the largest pad [m], and that of a stem as a share of its pad's."""

PEDESTAL = 0.075
"""Radius of a pedestal [m]."""

PEDESTAL_MASS, STEM_MASS = 20.0, 0.08
"""What these weigh [kg]."""

GRAPHITE = "0.13 0.14 0.16 1"

POSE = ("pos", "quat", "euler", "axisangle", "xyaxes", "zaxis")
"""The attributes by which MJCF gives a pose."""


@dataclass(frozen=True, slots=True)
class Stand:
    """Where an arm stands.

    Attributes:
        place: of its base in the world (3,) [m].
        yaw: angle of its base about the vertical [rad].
        pad: radius of its tool's pad [m].
    """

    place: tuple[float, float, float]
    yaw: float
    pad: float


RESERVED = ("carriage", "tool", "stem", "pad", "pedestal")
"""Names of what is added to an arm."""


def standing(model: ArmModel, stand: Stand) -> Element:
    """The MJCF of an arm on its stand: its outermost body is `carriage`, and `tool` is the frame of
    its site `tool`, z out of it, with a tool as long as STEM."""
    root = model.root()
    world = root.find("worldbody")
    assert world is not None
    site = "site[@name='tool']"
    body = next(b for b in world.findall("body") if b.find(f".//{site}") is not None)
    holder = next(b for b in body.iter("body") if b.find(site) is not None)
    (mount,) = holder.findall(site)
    contact = _own_contact(root, body.get("name", ""))
    for node in body.iter():
        if node.get("name") in RESERVED and node is not mount:
            node.set("name", f"own_{node.get('name')}")
    for inner in body.iter("body"):
        for number, geom in enumerate(inner.findall("geom")):
            if "name" not in geom.attrib:
                geom.set("name", f"{inner.get('name', 'link')}_{number}")
    for inner in [*body.iter()]:
        for light in [*inner.findall("light"), *inner.findall("camera")]:
            inner.remove(light)
    for other in [*world]:
        world.remove(other)
    base = body if body.find("joint") is None else Element("body")
    if base is not body:
        base.append(body)
    world.append(base)
    for key in POSE:
        base.attrib.pop(key, None)
    base.set("name", "carriage")
    base.set("pos", " ".join(f"{v:.9g}" for v in stand.place))
    base.set("quat", f"{cos(stand.yaw / 2):.12g} 0 0 {sin(stand.yaw / 2):.12g}")
    base.insert(0, _cylinder("pedestal", PEDESTAL, -stand.place[2], 0.0, PEDESTAL_MASS, GRAPHITE))
    pose = {key: mount.attrib[key] for key in POSE if key in mount.attrib}
    tool = SubElement(holder, "body", {"name": "tool", **pose})
    tool.append(_cylinder("stem", SLIM * stand.pad, 0.0, STEM - PAD, STEM_MASS, "0.66 0.68 0.71 1"))
    tool.append(_cylinder("pad", stand.pad, STEM - PAD, STEM, 0.0, GRAPHITE))
    first = next(inner for inner in base.iter("body") if inner.find("joint") is not None)
    if "name" not in first.attrib:
        first.set("name", "first_link")
    SubElement(contact, "exclude", {"body1": "carriage", "body2": first.get("name", "")})
    for name in ("keyframe", "sensor", "contact", "tendon", "equality"):
        for section in root.findall(name):
            root.remove(section)
    root.append(contact)
    return root


def _own_contact(root: Element, base: str) -> Element:
    """The pairs of an arm's bodies that its file leaves out of contact, by the names that they have
    on a stand."""
    contact = Element("contact")
    for pair in root.findall("contact/exclude"):
        bodies = (pair.get("body1", ""), pair.get("body2", ""))
        names = ["own_" * (name in RESERVED) + name for name in bodies]
        names = ["carriage" if name == base else name for name in names]
        SubElement(contact, "exclude", {"body1": names[0], "body2": names[1]})
    return contact


def with_tool(chain: SerialChain) -> SerialChain:
    """A chain to the tip of its tool, which it bears.

    Args:
        chain: the arm to its mount.
    """
    high = STEM - PAD
    across = STEM_MASS * (high**2 / 12 + (SLIM * PAD_RADIUS) ** 2 / 4)
    moment = np.diag([across, across, STEM_MASS * (SLIM * PAD_RADIUS) ** 2 / 2])
    borne = chain.with_payload(STEM_MASS, np.array([0.0, 0.0, high / 2]), moment)
    tip = chain.tool_place + chain.tool_turn @ [0.0, 0.0, STEM]
    return replace(borne, tool_place=tip)


def mass_of(model: ArmModel) -> float:
    """What an arm weighs with its pedestal and its tool [kg]."""
    m = model.compiled(standing(model, Stand((0.0, 0.0, 0.1), 0.0, PAD_RADIUS)))
    return float(m.body_subtreemass[m.body("carriage").id])


def _cylinder(name: str, radius: float, low: float, high: float, mass: float, rgba: str) -> Element:
    return Element(
        "geom",
        {
            "name": name,
            "type": "cylinder",
            "size": f"{radius:.6g}",
            "fromto": f"0 0 {low:.9g} 0 0 {high:.9g}",
            "mass": f"{mass:.6g}",
            "contype": "1",
            "conaffinity": "1",
            "group": "0",
            "rgba": rgba,
        },
    )


def add(root: Element, robot: str, kind: str, section: Mapping[str, Element]) -> None:
    """Put an arm, as `standing` gives it, into the sections of a model: its names begin with the
    robot's, and its classes and materials with those of its kind, which are there once."""
    body = prefixed(root.findall("worldbody/body")[0], kind)
    for node in body.iter():
        if "name" in node.attrib:
            node.set("name", f"{robot}/{node.get('name')}")
    body.set("childclass", body.get("childclass", kind))
    moved = next(inner for inner in body.iter("body") if inner.find("joint") is not None)
    moved.set("sleep", "allowed")
    section["worldbody"].append(body)
    for number, pair in enumerate(root.findall("contact/exclude")):
        bodies = {key: f"{robot}/{pair.get(key)}" for key in ("body1", "body2")}
        SubElement(section["contact"], "exclude", {"name": f"{robot}/{number}", **bodies})
    there = {d.get("class") for d in section["default"].findall("default")}
    if kind in there:
        return
    shared = SubElement(section["default"], "default", {"class": kind})
    for child in root.findall("default/*"):
        shared.append(prefixed(child, kind))
    for asset in root.findall("asset/*"):
        section["asset"].append(prefixed(asset, kind, names=True))
