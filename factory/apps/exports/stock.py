"""The MJCF that is written: the model of a run in the form that any MuJoCo, and other engines, load
and drive.

A run drives each axis by three setpoints, written ahead, and lets bodies sleep. The written model
has one `position` actuator an axis, whose law is the same, and nothing sleeps. It starts as a run
does. Each axis is at 0 then; a robot's goes up as it goes ahead, from B to A. What carries a weight
at the start is balanced by a soft spring. So nothing moves while all setpoints are 0.

The joints of a chain have the coordinates of its own file: where they start, and the setpoints that
hold them there, are in the keyframe `home`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from factory.api import Layout, LayoutMachines, Model, names
from factory.apps.drawing.markup import quoteattr
from factory.apps.exports.chain_rest import joints_at_rest, key_values
from factory.support.xml_writer import add, number, numbers

LAW = ("kp", "kv", "forcerange")
"""What an actuator of a run and the written one have in common."""


def write(model: Model, root: Element) -> None:
    """Give the element of a run's model the written form. The force of its actuators is
    kp (ctrl - q) - kv v; so a position x, a speed u and a force f, as a run sets them, are
    ctrl = x + (kv u + f) / kp."""
    for option in root.findall("option"):
        for flag in option.findall("flag"):
            option.remove(flag)
        option.text = None
    scales, weights = scales_of(model.layout), model.weights
    for body in root.iter("body"):
        body.attrib.pop("sleep", None)
        for joint in body.findall("joint"):
            name = joint.get("name") or ""
            if name in scales:
                _rescale(body, joint, scales[name])
            if name in weights:
                joint.set("stiffness", "1")
                joint.set("springref", number(weights[name]))
    for geom in root.iter("geom"):
        geom.attrib.pop("castshadow", None)
    for section in root.iter("actuator"):
        section[:] = sorted(map(_position, section), key=_turn)
    _mask_what_is_fed(root)
    _add_sensors(root)
    key = add(add(root, "keyframe"), "key", name="home")
    if rests := joints_at_rest(model.layout):
        from factory.api import load

        qpos, ctrl = key_values(load(model.with_tree(root)), rests)
        key.attrib.update(qpos=numbers(qpos.tolist()), ctrl=numbers(ctrl.tolist()))


@dataclass(frozen=True, slots=True)
class Scale:
    """The coordinate of a written slide, by that of a run, `q` [m]: 0 where q is `zero`, and up as
    q goes up, or down for `sign` -1."""

    zero: float = 0.0
    sign: float = 1.0

    def at(self, q: float) -> float:
        """The coordinate [m]."""
        return self.sign * (q - self.zero) + 0.0


def scales_of(layout: Layout) -> dict[str, Scale]:
    """Those of carriages and lifts, which are 0 at the start of a run, by the names of joints."""
    at = LayoutMachines(layout).starts(layout.factory.net.initial_marking).tolist()
    scales = {
        names.joint(axis): Scale(at[axis.index], 1.0 if axis.motion.hangs else -1.0)
        for axis in layout.factory.axes
    }
    for robot in () if layout.chains else layout.curves[0]:
        back, *further = layout.guidepaths[robot].framed(at[robot], at[robot])[0][0].tolist()
        (first, _), *others = names.moved_along(layout.factory.robots[robot])
        scales[first] = Scale(back, -1.0)
        scales |= {joint: Scale(x) for (joint, _), x in zip(others, further, strict=True)}
    return scales


def _rescale(body: Element, joint: Element, scale: Scale) -> None:
    """Give a slide another scale. Where it is 0 then the body is as far along the slide as before,
    from where it is placed at `ref`, which a carriage has."""
    axis = [float(value) for value in (joint.get("axis") or "").split()]
    ends = (float(end) for end in (joint.get("range") or "").split())
    further = scale.zero - float(joint.attrib.pop("ref", 0.0))
    if further:
        at = (float(value) for value in (body.get("pos") or "0 0 0").split())
        body.set("pos", numbers(p + further * a for p, a in zip(at, axis, strict=True)))
    joint.set("axis", numbers(scale.sign * value + 0.0 for value in axis))
    joint.set("range", numbers(sorted(map(scale.at, ends))))


def _position(actuator: Element) -> Element:
    """The actuator of a written model, whose setpoints are kept within its joint's range."""
    law = {key: actuator.get(key, "") for key in LAW}
    named = {key: actuator.get(key, "") for key in ("name", "joint")}
    return Element("position", {**named, "inheritrange": "1", **law})


def _turn(actuator: Element) -> int:
    """0 for the actuator of a carriage, 1 for that of a lift, 2 for any other."""
    name = actuator.get("name") or ""
    return 2 if names.kind(name) != "robot" else int(name != names.drive(names.holder(name)))


def _mask_what_is_fed(root: Element) -> None:
    """Parts that hang from a feeder's pad at the start have its contact masks, so that they do not
    touch it."""
    bodies = {body.get("name"): body for body in root.iter("body")}
    for weld in root.iter("weld"):
        if weld.get("active") != "true" or weld.get("body1") == "world":
            continue
        pad = bodies[weld.get("body1")].find("geom")
        assert pad is not None
        masks: Mapping[str, str] = {key: pad.get(key, "") for key in ("contype", "conaffinity")}
        for geom in bodies[weld.get("body2")].iter("geom"):
            if geom.get("class") == "part":
                geom.attrib.update(masks)


def _add_sensors(root: Element) -> None:
    """Position and speed of each axis, named after its joint, `r3/slide/position`; and where each
    part is, as seen by the robot, feeder or tray that a weld joins it to, named after the weld."""
    sensor = add(root, "sensor")
    for actuator in root.iterfind("actuator/position"):
        joint = actuator.get("joint")
        add(sensor, "jointpos", name=f"{joint}/position", joint=joint)
        add(sensor, "jointvel", name=f"{joint}/speed", joint=joint)
    for weld in root.iter("weld"):
        if weld.get("body1") != "world":
            part = {"objtype": "xbody", "objname": weld.get("body2")}
            holder = {"reftype": "xbody", "refname": weld.get("body1")}
            add(sensor, "framepos", name=weld.get("name"), **part, **holder)


def model_files(model: Model, path: Path) -> dict[Path, bytes]:
    """The XML at `path` and, beside it, its mesh folder `NAME_meshes`: what to write where."""
    folder = path.with_name(f"{path.stem}_meshes")
    xml = model.xml.replace('meshdir="meshes"', f"meshdir={quoteattr(folder.name)}", 1)
    meshes = {folder / name: content for name, content in model.files.items()}
    return {path: xml.encode(errors="surrogateescape"), **meshes}
