"""Reads the jaws of a gripper from the MJCF of a robot type.

A jaw is a body inside the one with the nest, with a joint across the heading, a geom and an
actuator, all of its name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

from factory.floor.robots.schema import JOINTS, RobotDocument, numbers
from factory.support.xml_tree import Element
from factory.theory.problem.robot_bodies import MOTIONS, TURN_JOINT, Jaw

LONGEST = 0.05
"""Greatest stroke of a jaw [m]."""

TALLEST = 0.03
"""How far a jaw reaches up beside what it holds at the most [m]."""

WIDEST = 0.03
"""Greatest width of a jaw along the heading [m]."""

TURNS = MOTIONS[TURN_JOINT].body
"""The body that turns what it holds: its jaws would sweep a circle."""

SOLID = ("1", "1", "0")
"""contype, conaffinity and group of what collides."""

Merge = Callable[[Element, str], Mapping[str, str]]
"""Gives the attributes of a geom, with those of its class, or of the one that its body has."""


class JawReader:
    """Reads the jaws in a document.

    Args:
        document: the document, in which faults are noted.
        merge: gives the attributes of a geom, as `Merge`.
    """

    def __init__(self, document: RobotDocument, merge: Merge) -> None:
        self.document, self._merge = document, merge
        self._bodies = list[tuple[Element, str, str]]()
        self._nest: Sequence[float] = ()
        self._drives: dict[str | None, Element] = {}

    def take(self, body: Element, inside: str, of: str) -> bool:
        """Whether a body is a jaw, which is kept with the body that it is in, and the class of that
        one's geoms: its joint is none of those that move robots."""
        joint = body.first("joint")
        if joint is None or joint.attributes.get("name") in JOINTS:
            return False
        self._bodies.append((body, inside, body.attributes.get("childclass", of)))
        return True

    def others(self, drives: Iterable[Element]) -> list[Element]:
        """Those of some actuators that are not of jaws."""
        names = {body.attributes.get("name") for body, *_ in self._bodies}
        return [drive for drive in drives if drive.attributes.get("joint") not in names]

    def read(self, holder: str, nest: Sequence[float], root: Element) -> tuple[Jaw, ...]:
        """The jaws of a document; `holder`: the body with the nest, which is there [m]."""
        drives = (drive for section in root.all("actuator") for drive in section.children)
        self._drives = {drive.attributes.get("joint"): drive for drive in drives}
        self._nest, jaws, bodies = nest, list[Jaw](), self._bodies
        for body, inside, of in bodies:
            if inside != holder or holder == TURNS:
                what = f"the jaw '{body.attributes['name']}' is in '{inside}'"
                self.document.wrong(body, what, "in the carriage or the head, where the nest is")
            elif jaw := self._jaw(body, of):
                jaws.append(jaw)
        if bodies and len(jaws) == len(bodies) and sorted(jaw.side for jaw in jaws) != [-1, 1]:
            what = f"it has {len(jaws)} jaws, of which {sum(j.side > 0 for j in jaws)} on the left"
            self.document.wrong(bodies[0][0], what, "two, one on each side of the nest")
        return tuple(jaws)

    def _jaw(self, body: Element, of: str) -> Jaw | None:
        name = body.attributes["name"]
        parts = {kind: list(body.all(kind)) for kind in ("joint", "geom")}
        named = [each.attributes.get("name") for kind in parts for each in parts[kind]]
        drive = self._drives.get(name)
        if len(body.children) != 2 or named != [name, name] or drive is None:
            what = f"the jaw '{name}' has {', '.join(map(str, named)) or 'nothing'}"
            valid = f"a joint, a geom and an actuator, all called '{name}'"
            self.document.wrong(body, what, valid)
            return None
        (joint,), (geom,) = parts["joint"], parts["geom"]
        values = self._merge(geom, of)
        box = self._box(geom, values, name)
        if box is None or not self._slides(joint, name):
            return None
        low, high = box
        side = 1 if low[1] > 0 else -1
        stroke = numbers(joint.attributes["range"])[1]
        opening = low[1] if side > 0 else -high[1]
        way = numbers(joint.attributes["axis"])
        if way[1] != -side or not stroke < opening:
            at, far = opening * 1e3, stroke * 1e3
            what = f"the jaw '{name}' is {at:g} mm beside the nest and goes {far:g} mm along {way}"
            self.document.wrong(joint, what, "towards the nest, and less far than there")
            return None
        force = self._force(drive, name)
        mass = numbers(values.get("mass", "0"))[0]
        if mass <= 0:
            self.document.wrong(geom, f"the jaw '{name}' has the mass {mass:g} kg", "above 0")
        rub = [self.document.least(joint, key, False) for key in ("armature", "frictionloss")]
        grip = numbers(values.get("friction", "1"))[0]
        return Jaw(name, side, low, high, stroke, mass, rub[0], rub[1], force, grip)

    def _slides(self, joint: Element, name: str) -> bool:
        """Whether a joint is that of a jaw."""
        values = joint.attributes
        way, reach = numbers(values.get("axis", "")), numbers(values.get("range", ""))
        kind = values.get("type", "hinge")
        across = len(way) == 3 and abs(way[1]) == 1 and way[0] == way[2] == 0
        bounded = len(reach) == 2 and reach[0] == 0 and 0 < reach[1] <= LONGEST
        if kind == "slide" and across and bounded:
            return True
        what = f"the jaw '{name}' has the type {kind}, the axis {way} and the range {reach}"
        self.document.wrong(joint, what, f"a slide along 0 1 0 or 0 -1 0, from 0 to {LONGEST:g} m")
        return False

    def _box(
        self, geom: Element, values: Mapping[str, str], name: str
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
        """The corners of a jaw's box from the nest, open [m]."""
        masks = tuple(values[key] for key in ("contype", "conaffinity", "group"))
        half = numbers(values.get("size", ""))
        if values["type"] != "box" or len(half) != 3 or min(half) <= 0 or masks != SOLID:
            self.document.wrong(geom, f"the jaw '{name}' is no solid box", "a box that collides")
            return None
        middle = [round(a - b, 9) for a, b in zip(numbers(values["pos"]), self._nest, strict=True)]
        (x, y, z), (u, v, w) = (
            [round(a + sign * b, 9) for a, b in zip(middle, half, strict=True)] for sign in (-1, 1)
        )
        if y * v <= 0 or not 0 < w <= TALLEST or max(-x, u) > WIDEST / 2 or x * u >= 0:
            what = f"the jaw '{name}' is from {x:g} {y:g} {z:g} to {u:g} {v:g} {w:g} m of the nest"
            valid = (
                f"beside the nest, {WIDEST * 500:g} mm before and behind it at the most,"
                f" up to {TALLEST * 1e3:g} mm over it"
            )
            self.document.wrong(geom, what, valid)
            return None
        return (x, y, z), (u, v, w)

    def _force(self, drive: Element, name: str) -> float:
        """What the actuator of a jaw presses with [N]."""
        values = drive.attributes
        low, high = ([*numbers(values.get("forcerange", "")), 0.0, 0.0])[:2]
        if values.get("name") != name or not high > 0 or low != -high or "kp" in values:
            what = f"the actuator of '{name}' has {' '.join(sorted(values))}"
            self.document.wrong(drive, what, f"the name {name}, and -F F as its forcerange; no kp")
        return high
