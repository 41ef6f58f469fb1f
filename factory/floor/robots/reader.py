"""Reads the body of a robot type from its MJCF.

Its sizes, masses, friction and drives are free within what is checked here. Whatever else differs
from a shipped type would make the model another robot than the one that is laid out, and is refused
by name (BadRobot).
"""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil, inf
from pathlib import Path

from factory.floor.robots.jaws import JawReader
from factory.floor.robots.schema import (
    FITTED,
    HAND,
    JOINTS,
    KINDS,
    LIMBS,
    MATERIALS,
    MOVING,
    SIZES,
    RobotDocument,
    numbers,
)
from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.files import TABLE, read_bytes
from factory.support.xml_tree import Element
from factory.theory.problem.robot_bodies import (
    ARM_LOW,
    ARM_TOP,
    ARM_WIDTH,
    CARRIAGE,
    CARRIAGE_TOP,
    MAST,
    MOTIONS,
    SLIDE,
    RobotAxis,
    RobotBody,
)

WIDEST = 1.0
"""Greatest width of a carriage [m]."""

UNSET = {"type": "sphere", "contype": "1", "conaffinity": "1", "group": "0", "pos": "0 0 0"}
"""What the engine takes for what a geom leaves out."""

SOLID, SHOWN = ("1", "1", "0"), ("0", "0", "1")
"""contype, conaffinity and group of what collides, and of what is only shown."""

ABOVE = ("column", "pad", "wrist")
"""Geoms of what a lift raises."""

OUT = 5e-3
"""What is only shown stands out from what is solid by no more [m]."""

ROOM = 1e-9
"""Sizes are compared to this [m]."""

HINT = "docs: Extensions, Robot types; the shipped mjcf/dot.xml is the model to copy"

Values = Mapping[str, str]


def read_body(name: str, path: Path) -> RobotBody:
    """The body of a robot type in its MJCF. Raises InputError: BadRobot with all that is wrong,
    Syntax, BadFile."""
    try:
        text = read_bytes(path, TABLE).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        why = "it is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else error.strerror
        words = f"the file of robot type '{name}' cannot be read: {why}"
        raise InputError(Diagnostic("BadFile", words, Position(str(path), 1, 1), HINT)) from error
    document = RobotDocument(name, str(path), text)
    return _Reader(document).body(document.read(text))


class _Reader:
    """Reads one file. What was met so far: `classes` of geoms, `materials`, the body of each of
    the `geoms`, `joints`, `nests`, `jaws`; `masses`: of each body with a joint [kg]; where the
    `nest` is, `wide`: width of the carriage, and `shown`: what is seen of it [m]."""

    def __init__(self, document: RobotDocument) -> None:
        self.document = document
        self.classes: dict[str, Values] = {"": UNSET}
        self.materials = set[str]()
        self.geoms, self.bodies = dict[str, str](), set[str]()
        self.masses = dict.fromkeys(MOVING, 0.0)
        self.joints = dict[str, Element]()
        self.nests, self.nest = list[tuple[str, str]](), [0.0, 0.0, 0.0]
        self.jaws = JawReader(document, self._merged)
        self.wide = 0.0
        self.shown = list[tuple[Element, str, list[float], list[float]]]()

    def body(self, root: Element) -> RobotBody:
        """The body in a document."""
        self.document.schema(root)
        sections = {
            n: [c for s in root.all(n) for c in s.children]
            for n in ("default", "asset", "worldbody", "actuator")
        }
        for child in sections["default"]:
            self._defaults(child, UNSET)
        for asset in sections["asset"]:
            self.materials.add(self.document.name(asset, self.materials))
        bodies = sections["worldbody"]
        if [body.attributes.get("name") for body in bodies] != ["carriage"]:
            called = ", ".join(f"'{body.attributes.get('name', '')}'" for body in bodies) or "none"
            self._wrong(root, f"the bodies in the world are {called}", "one, called 'carriage'")
            self.document.stop()
        self._inside(bodies[0], "carriage", "")
        self._fittings(root)
        jaws = self.jaws.read(self.nests[0][0] if self.nests else "", self.nest, root)
        for jaw in jaws:
            self.masses[self.nests[0][0]] += jaw.mass
        axes = self._axes(bodies[0], self.jaws.others(sections["actuator"]))
        self.document.stop()
        wide = max(CARRIAGE, 0.002 * ceil(self.wide * 500 - 1e-6))
        for shown in self.shown:
            self._stands_out(*shown, wide / 2)
        self.document.stop()
        return RobotBody(round(wide, 6), round(sum(self.masses.values()), 9), axes, jaws)

    def _merged(self, geom: Element, inherited: str) -> Values:
        """The attributes of a geom, with those of its class."""
        of = geom.attributes.get("class", inherited)
        return {**self.classes.get(of, UNSET), **geom.attributes}

    def _wrong(self, element: Element, what: str, valid: str) -> None:
        self.document.wrong(element, what, valid)

    def _defaults(self, element: Element, above: Values) -> None:
        """The classes of an element, which take over what is `above` them."""
        name = element.attributes.get("class", "")
        if element.name != "default" or not name or name in self.classes:
            what = f"<{element.name} class='{name}'> inside <default>"
            self._wrong(element, what, '<default class="..."> of a new name')
            return
        values = [geom.attributes for geom in element.all("geom")]
        if any({"name", "class"} & each.keys() for each in values):
            self._wrong(element, f"the class '{name}' has a geom with a name", "no name, no class")
        self.classes[name] = {k: v for each in (above, *values) for k, v in each.items()}
        for child in element.all("default"):
            self._defaults(child, self.classes[name])

    def _inside(self, body: Element, name: str, inherited: str) -> None:
        """A body with what is in it. Bodies with joints are inside each other."""
        inherited = body.attributes.get("childclass", inherited)
        for joint in body.all("joint"):
            self._joint(joint, name)
        for geom in body.all("geom"):
            self._geom(geom, name if name in MOVING else "", inherited)
        for site in body.all("site"):
            self.nests.append((name, site.attributes.get("name", "")))
            self.nest = numbers(site.attributes.get("pos", "0 0 0"))
        below = MOVING[MOVING.index(name) + 1 :][:1] if name in MOVING else ()
        for child in body.all("body"):
            called = self.document.name(child, self.bodies)
            self.bodies.add(called)
            if self.jaws.take(child, name, inherited):
                continue
            if called in MOVING and called not in below:
                what = f"the body '{called}' is inside '{name}'"
                self._wrong(child, what, "'head' inside 'carriage', 'tool' inside 'head'")
            else:
                self._inside(child, called, inherited)

    def _joint(self, joint: Element, body: str) -> None:
        name = self.document.name(joint, self.joints)
        self.joints[name] = joint
        if "range" in joint.attributes:
            self._wrong(joint, "<joint> has 'range', which is not read", "none: layouts give it")
        where, kind, axis = JOINTS.get(name, ("", "", ()))
        if where != body:
            valid = ", ".join(f"'{j}' in '{b}'" for j, (b, *_) in JOINTS.items())
            self._wrong(joint, f"the joint '{name}' is in the body '{body}'", valid)
            return
        motion = joint.attributes.get("type", "hinge")
        if motion != kind:
            self._wrong(joint, f"the joint '{name}' is of the type {motion}", kind)
        at = joint.attributes.get("axis", "0 0 1")
        if numbers(at) != [*axis]:
            valid = " ".join(f"{value:g}" for value in axis)
            self._wrong(joint, f"the joint '{name}' has the axis {at}", valid)

    def _geom(self, geom: Element, body: str, inherited: str) -> None:
        """A geom of a `body` with a joint, "" of one without."""
        name = self.document.name(geom, self.geoms)
        self.geoms[name] = body
        of = geom.attributes.get("class", inherited)
        if of not in self.classes:
            valid = ", ".join(filter(None, self.classes)) or "a class of <default>"
            self._wrong(geom, f"the geom '{name}' is of the class '{of}'", valid)
        values = self._merged(geom, inherited)
        material = values.get("material")
        if material is not None and material not in self.materials:
            valid = did_you_mean(material, sorted(self.materials), "materials")
            self._wrong(geom, f"the geom '{name}' is of the material '{material}'", valid)
        if name in LIMBS:
            self._wrong(geom, f"a geom is called '{name}', as a limb of a hand is", "another name")
        if values.get("condim", "3") not in ("1", "3", "4", "6"):
            self._wrong(geom, f"the geom '{name}' has condim {values['condim']}", "1, 3, 4 or 6")
        self._weigh(geom, name, values, body)
        masks = values["contype"], values["conaffinity"], values["group"]
        if masks not in (SOLID, SHOWN):
            what = "contype {}, conaffinity {}, group {}".format(*masks)
            valid = "1, 1 and 0 for what collides; 0, 0 and 1 for what is only shown"
            self._wrong(geom, f"the geom '{name}' has {what}", valid)
        elif masks == SOLID and (body != "carriage" or name in HAND):
            valid = "contype 0, conaffinity 0, group 1: only the carriage, its mast and its arm are"
            self._wrong(geom, f"the geom '{name}' is solid", valid)
        elif half := self._half(geom, name, values):
            if masks == SOLID:
                self._extent(geom, name, numbers(values["pos"]), half)
            elif name in ("carriage", "mast", "arm"):
                self._wrong(geom, f"the geom '{name}' is only shown", "solid: it collides")
            elif body in MOVING[1:] and name not in ABOVE:
                valid = f"only {', '.join(ABOVE)}, which are where the payload is"
                self._wrong(geom, f"the geom '{name}' is in '{body}'", valid)
            elif name not in ABOVE and name not in HAND:
                self.shown.append((geom, name, numbers(values["pos"]), half))

    def _weigh(self, geom: Element, name: str, values: Values, body: str) -> None:
        if "mass" not in values:
            valid = 'mass="0.1" [kg], 0 where it is only shown'
            self._wrong(geom, f"the geom '{name}' has no mass", valid)
            return
        (mass,) = numbers(values["mass"])
        if mass < 0 or (mass and (not body or (body == "carriage" and name in HAND))):
            valid = "0 for bodies without joints and hands, 0 or more in carriage, head and tool"
            self._wrong(geom, f"the geom '{name}' has the mass {mass:g} kg", valid)
        elif body:
            self.masses[body] += mass

    def _half(self, geom: Element, name: str, values: Values) -> list[float]:
        """Half the box of a geom [m]; nothing where it has none."""
        kind, wanted = values["type"], FITTED.get(name)
        if kind not in SIZES or (wanted and kind != wanted):
            self._wrong(
                geom, f"the geom '{name}' is of the type {kind}", wanted or ", ".join(SIZES)
            )
            return []
        size = numbers(values.get("size", ""))[: SIZES[kind]]
        if len(size) < SIZES[kind] or min(size) <= 0:
            what = f"the geom '{name}' has the size '{values.get('size', '')}'"
            self._wrong(geom, what, f"{SIZES[kind]} lengths above 0 [m]")
            return []
        if len(size) == 2:
            size = [size[0], size[0], size[1] + size[0] * (kind == "capsule")]
        return (size * 3)[:3]

    def _extent(self, geom: Element, name: str, at: list[float], half: list[float]) -> None:
        """Keep a solid geom within the room that it has, and note how wide the carriage is."""
        x, y = (abs(at[n]) + half[n] for n in (0, 1))
        low, high = at[2] - half[2], at[2] + half[2]
        what = f"the geom '{name}' reaches from {low * 1e3:g} to {high * 1e3:g} mm up"
        if name == "arm":
            if y > ARM_WIDTH / 2 + ROOM or low < ARM_LOW - ROOM or high > ARM_TOP + ROOM:
                heights = f"{ARM_LOW * 1e3:g} to {ARM_TOP * 1e3:g} mm up"
                valid = f"{heights}, {ARM_WIDTH * 500:g} mm: others go under it and over it"
                self._wrong(geom, f"{what}, and {y * 1e3:g} mm to a side", valid)
        elif low < -ROOM:
            self._wrong(geom, what, "0 mm up: the floor")
        elif high <= CARRIAGE_TOP + ROOM and name != "mast":
            self.wide = max(self.wide, 2 * x, 2 * y)
            if max(x, y) > WIDEST / 2:
                what = f"the geom '{name}' reaches {max(x, y) * 1e3:g} mm from the mast's axis"
                self._wrong(geom, what, f"{WIDEST * 500:g} mm")
        elif max(x, y) > MAST / 2 + ROOM or high > ARM_TOP + ROOM:
            valid = (
                f"up to {CARRIAGE_TOP * 1e3:g} mm up; or up to {ARM_TOP * 1e3:g} mm, within"
                f" {MAST * 500:g} mm of the mast's axis: arms of others go over carriages"
            )
            self._wrong(geom, f"{what}, {max(x, y) * 1e3:g} mm from the mast's axis", valid)

    def _stands_out(
        self, geom: Element, name: str, at: list[float], half: list[float], carriage: float
    ) -> None:
        """Check that what is only shown is seen where nothing else goes."""
        side, high = max(abs(at[n]) + half[n] for n in (0, 1)), at[2] + half[2]
        room = carriage if high <= CARRIAGE_TOP + ROOM else MAST / 2
        if side > room + OUT + ROOM or high > ARM_TOP + OUT + ROOM or at[2] - half[2] < -ROOM:
            what = f"the geom '{name}' is seen {side * 1e3:g} mm from the mast's axis"
            valid = (
                f"{(carriage + OUT) * 1e3:g} mm, above {CARRIAGE_TOP * 1e3:g} mm up"
                f" {(MAST / 2 + OUT) * 1e3:g} mm, and {(ARM_TOP + OUT) * 1e3:g} mm up at most"
            )
            self._wrong(geom, f"{what}, up to {high * 1e3:g} mm up", valid)

    def _fittings(self, root: Element) -> None:
        """Check that there is what hands are made of, and what is stretched."""
        for name in sorted({*MATERIALS} - self.materials):
            self._wrong(root, f"it has no material '{name}'", f'<material name="{name}"/>: hands')
        solid = {**UNSET, "contype": "0", **self.classes.get("solid", {"contype": "0"})}
        if (solid["contype"], solid["conaffinity"], solid["group"]) != SOLID:
            valid = 'contype="1" conaffinity="1", group 0; hands are of it'
            self._wrong(root, "it has no class 'solid' of geoms that collide", valid)
        for name in ("carriage", "mast", "arm")[: 2 + (SLIDE in self.joints)]:
            if self.geoms.get(name) != "carriage":
                self._wrong(root, f"the body 'carriage' has no geom '{name}'", "one of this name")

    def _axes(self, carriage: Element, drives: list[Element]) -> tuple[RobotAxis, ...]:
        """The axes, with their drives."""
        joints = tuple(joint for joint in JOINTS if joint in self.joints)
        if joints not in KINDS:
            valid = "; ".join(" and ".join(kind) for kind in KINDS)
            self._wrong(carriage, f"its joints are {', '.join(joints) or 'none'}", valid)
            return ()
        holder = JOINTS[joints[-1]][0]
        if self.nests != [(holder, "nest")]:
            sites = ", ".join(f"'{name}' in '{body}'" for body, name in self.nests) or "none"
            self._wrong(carriage, f"its sites are {sites}", f"one, 'nest' in '{holder}'")
        names = {joint: MOTIONS[joint].drive for joint in joints}
        driven = {(d.attributes.get("name"), d.attributes.get("joint")): d for d in drives}
        if len(drives) != len(joints) or driven.keys() != {(names[j], j) for j in joints}:
            words = ", ".join(f"'{name}' of '{joint}'" for name, joint in driven) or "none"
            valid = ", ".join(f"'{names[joint]}' of '{joint}'" for joint in joints)
            self._wrong(carriage, f"its actuators are {words}", valid)
            return ()
        return tuple(self._axis(joint, driven[names[joint], joint]) for joint in joints)

    def _axis(self, name: str, drive: Element) -> RobotAxis:
        """The axis of a joint."""
        joint, body = self.joints[name], JOINTS[name][0]
        if self.masses[body] <= 0:
            self._wrong(joint, f"what '{name}' moves has no mass", "above 0 [kg]")
        mass = round(sum(self.masses[each] for each in MOVING[MOVING.index(body) :]), 9)
        armature, rub = (self.document.least(joint, k, False) for k in ("armature", "frictionloss"))
        kp, kv = (self.document.least(drive, k, True) or None for k in ("kp", "kv"))
        if (kp is None) != (kv is None):
            self._wrong(drive, f"'{name}' has one of kp and kv", "both, or neither: then sized")
        force = inf
        if "forcerange" in drive.attributes:
            low, force = numbers(drive.attributes["forcerange"])
            if not force > 0 or low != -force:
                what = f"the forcerange of '{name}' is {drive.attributes['forcerange']}"
                self._wrong(drive, what, "-F F with F above 0")
        return RobotAxis(name, mass, armature, rub, kp, kv, force, self.document.at(drive))
