"""Plans are what an engineer would do: products with a known order, from STL files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.titles import Titles
from factory.apps.planning.writing import Screwed, Tree, leaves
from factory.theory.lang.template_reader import all_templates

Parts = Mapping[str, Manifold]

FIT = 0.15
"""Room between parts that slide in each other [mm]."""


@dataclass(frozen=True)
class Engineered:
    """Parts in place, and what an engineer knows of them: the `base`, or any of several; the pairs
    of parts of which the first is there `before` the second comes; a name that ends in `*` means
    all that begin so."""

    parts: Parts
    base: frozenset[str]
    before: tuple[tuple[str, str], ...]

    def pairs(self) -> list[tuple[str, str]]:
        """The pairs of parts, written out."""
        return [
            (one, other)
            for first, then in self.before
            for one in self._named(first)
            for other in self._named(then)
        ]

    def _named(self, name: str) -> list[str]:
        if not name.endswith("*"):
            return [name]
        return [label for label in self.parts if label.startswith(name[:-1])]


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> Manifold:
    """A box that stands on a point."""
    return Manifold.cube((x, y, z), True).translate((at[0], at[1], at[2] + z / 2))


def rod(
    radius: float, low: float, high: float, at: tuple[float, float] = (0, 0), sides: int = 24
) -> Manifold:
    """An upright round bar."""
    return Manifold.cylinder(high - low, radius, radius, sides).translate((*at, low))


def tube(
    outer: float, inner: float, low: float, high: float, at: tuple[float, float] = (0, 0)
) -> Manifold:
    """An upright round bar with a hole."""
    return rod(outer, low, high, at) - rod(inner, low - 1, high + 1, at)


def along_x(body: Manifold) -> Manifold:
    """A body that was drawn upright, with its upper end at +x."""
    return body.rotate((0, 90, 0))


def along_y(body: Manifold) -> Manifold:
    """A body that was drawn upright, with its upper end at -y."""
    return body.rotate((90, 0, 0))


def screw(at: tuple[float, float], under: float, long: float, radius: float = 1.5) -> Manifold:
    """A screw whose head stands at a height."""
    head = rod(1.9 * radius, under, under + 2 * radius, at)
    return rod(radius, under - long, under, at) + head


def nut(at: tuple[float, float], low: float, radius: float = 1.5) -> Manifold:
    """A nut on a height."""
    return rod(2.1 * radius, low, low + 1.6 * radius, at, 6) - rod(radius, low - 1, low + 9, at)


def corners(x: float, y: float) -> list[tuple[float, float]]:
    """The four corners of a rectangle."""
    return [(a, b) for a in (-x, x) for b in (-y, y)]


def drilled(body: Manifold, at: list[tuple[float, float]], radius: float) -> Manifold:
    """A body with upright holes."""
    for place in at:
        body = body - rod(radius, -200, 200, place)
    return body


def numbered(
    name: str, make: Callable[[tuple[float, float]], Manifold], at: list[tuple[float, float]]
) -> Parts:
    """Copies of a part."""
    return {f"{name}{n}": make(place) for n, place in enumerate(at, 1)}


def instrument() -> Engineered:
    """A battery, a board and a display in a case with a screwed lid, and a knob through it."""
    at = corners(26, 16)
    case = box(60, 42, 24) - box(54, 36, 24, (0, 0, 3))
    for place in at:
        case = case + rod(4, 3, 24, place) - rod(1.5, 8, 40, place)
    lid = drilled(box(60, 42, 3, (0, 0, 24)), at, 1.7) - rod(5.2, 20, 40)
    parts = {
        "case": case,
        "battery": box(30, 22, 6, (0, 0, 3)),
        "board": box(38, 26, 2, (0, 0, 9)),
        "display": box(14, 14, 8, (0, 0, 11)),
        "lid": lid,
        "knob": rod(5, 19.0, 27) + rod(8, 27, 33),
        **numbered("screw", lambda p: screw(p, 27, 14), at),
    }
    order = (("battery", "board"), ("board", "display"), ("display", "lid"), ("lid", "screw*"))
    return Engineered(parts, frozenset({"case"}), (*order, ("lid", "knob")))


def flange() -> Engineered:
    """Two plates and a gasket, bolted through, with nuts below."""
    at = corners(18, 18)
    plates = [drilled(box(50, 50, h, (0, 0, z)), at, 2.1) for h, z in ((8, 0), (1, 8), (6, 9))]
    parts = dict(zip(("foot", "gasket", "cover"), plates, strict=True))
    parts["foot"] = parts["foot"] + box(26, 26, 20, (0, 0, -20))
    parts |= numbered("bolt", lambda p: screw(p, 15, 21, 2), at)
    parts |= numbered("nut", lambda p: nut(p, -3.2, 2), at)
    order = (("foot", "gasket"), ("gasket", "cover"), ("cover", "bolt*"))
    nuts = tuple((f"bolt{n}", f"nut{n}") for n in range(1, 5))
    return Engineered(parts, frozenset({"foot"}), (*order, *nuts))


def keyed_shaft() -> Engineered:
    """A shaft with a foot, a key in it, a gear over the key, a collar and a nut on top."""
    slot = box(4, 4, 20, (8, 0, 12))
    shaft = rod(20, 0, 8) + rod(8, 8, 46) + rod(5, 46, 60) - slot
    key = box(6 - 2 * FIT, 4 - 2 * FIT, 20 - 2 * FIT, (9, 0, 12 + FIT))
    gear = tube(24, 8 + FIT, 8, 34) - box(6, 4, 40, (10.5, 0, 0))
    parts = {
        "shaft": shaft,
        "key": key,
        "gear": gear,
        "collar": tube(14, 8 + FIT, 34, 42),
        "nut": nut((0, 0), 46, 5),
    }
    order = (("key", "gear"), ("gear", "collar"), ("collar", "nut"))
    return Engineered(parts, frozenset({"shaft"}), order)


def hinge() -> Engineered:
    """Two leaves and a pin through their knuckles."""

    def knuckle(low: float, high: float) -> Manifold:
        return along_x(tube(5, 2.5 + FIT, low, high))

    left = box(60, 30, 4, (0, -18, -5)) + knuckle(-30, -10.2) + knuckle(10.2, 30)
    right = box(60, 30, 4, (0, 18, -5)) + knuckle(-10, 10)
    left = left - box(20.4, 12, 12, (0, 0, -6)) - along_x(rod(2.5 + FIT, -40, 40))
    right = right - box(20, 11, 12, (-20.2, 0, -6)) - box(20, 11, 12, (20.2, 0, -6))
    right = right - along_x(rod(2.5 + FIT, -40, 40))
    pin = along_x(rod(2.5, -30, 31) + rod(4.5, 31, 34))
    order = (("left", "pin"), ("right", "pin"))
    return Engineered(
        {"left": left, "right": right, "pin": pin}, frozenset({"left", "right"}), order
    )


def piston() -> Engineered:
    """A rod in a piston, held by its pin; both in a cylinder with a screwed head."""
    at = corners(19, 19)
    block = drilled(box(50, 50, 70), at, 0.1) - rod(15 + FIT, 6, 90) - box(14, 14, 90)
    for place in at:
        block = block - rod(1.5, 50, 80, place)
    across = along_x(rod(3 + FIT, -40, 40)).translate((0, 0, 50))
    piston_ = rod(15, 40, 62) - box(8, 12, 18, (0, 0, 39)) - across
    conrod = box(8 - 2 * FIT, 8, 50, (0, 0, 5)) - across
    pin = along_x(rod(3, -12, 12)).translate((0, 0, 50))
    head = drilled(box(50, 50, 8, (0, 0, 70)), at, 1.7)
    parts = {"block": block, "piston": piston_, "conrod": conrod, "pin": pin, "head": head}
    parts |= numbered("screw", lambda p: screw(p, 78, 22), at)
    order = (("piston", "pin"), ("conrod", "pin"), ("pin", "head"), ("head", "screw*"))
    return Engineered(parts, frozenset({"block"}), order)


def cabinet() -> Engineered:
    """Two drawers, with knobs, in a body that is open in front, and a top on four dowels."""
    body = box(60, 50, 62) - box(54, 50, 26, (0, -3, 4)) - box(54, 50, 26, (0, -3, 33))
    at = corners(26, 20)
    for place in at:
        body = body - rod(2, 59.5, 70, place)
    parts = {"body": drilled(body, [], 1)}
    for n, z in enumerate((4, 33), 1):
        drawer = box(54 - 2 * FIT, 46, 22, (0, -2, z)) - box(48, 40, 22, (0, -2, z + 3))
        parts[f"drawer{n}"] = drawer - along_y(rod(2 + FIT, 15, 40)).translate((0, 0, z + 11))
        grip = along_y(rod(2, 19, 25) + rod(5, 25, 31)).translate((0, 0, z + 11))
        parts[f"knob{n}"] = grip
    parts |= numbered("dowel", lambda p: rod(2, 59.5, 66, p), at)
    top = box(66, 56, 8, (0, 0, 62))
    for place in at:
        top = top - rod(2 + FIT, 60, 66.2, place)
    parts["top"] = top
    order = (("dowel*", "top"), ("drawer1", "knob1"), ("drawer2", "knob2"))
    return Engineered(parts, frozenset({"body"}), order)


def valve() -> Engineered:
    """A seat, a ball and a stem with a bonnet, and a handle with its nut."""
    body = box(40, 40, 40) - rod(12, 6, 50) - along_x(rod(6, -30, 30)).translate((0, 0, 16))
    parts = {
        "body": body,
        "seat": tube(12 - FIT, 5, 6, 9),
        "ball": Manifold.sphere(8, 48).translate((0, 0, 9 + 6.35)),
        "bonnet": tube(17, 3 + FIT, 40, 46) + tube(12 - FIT, 3 + FIT, 30, 40),
        "stem": rod(3, 24, 66) + rod(6, 24, 29.8),
        "handle": box(60, 12, 5, (18, 0, 50)) - rod(3 + FIT, 40, 60),
        "nut": nut((0, 0), 55, 3),
    }
    order = (("seat", "ball"), ("ball", "bonnet"), ("bonnet", "handle"), ("handle", "nut"))
    return Engineered(parts, frozenset({"body"}), order)


def clamp() -> Engineered:
    """A strap over a pipe on a saddle, with two bolts, washers under their heads, and nuts."""
    at = [(-24.0, 0.0), (24.0, 0.0)]
    pipe = along_y(tube(14, 11, -40, 40)).translate((0, 0, 24))
    room = along_y(rod(14 + FIT, -60, 60)).translate((0, 0, 24))
    saddle = drilled(box(64, 30, 23, (0, 0, 0)), at, 2.1) - room
    strap = drilled(box(64, 24, 16, (0, 0, 25)), at, 2.1) - room
    parts = {"saddle": saddle, "pipe": pipe, "strap": strap}
    parts |= numbered("washer", lambda p: tube(5, 2 + FIT, 41, 42, p), at)
    parts |= numbered("bolt", lambda p: screw(p, 42, 48, 2), at)
    parts |= numbered("nut", lambda p: nut(p, -3.2, 2), at)
    order = (("pipe", "strap"), ("strap", "bolt*"), ("washer1", "bolt1"), ("washer2", "bolt2"))
    return Engineered(parts, frozenset({"saddle"}), (*order, ("bolt1", "nut1"), ("bolt2", "nut2")))


def upright_flange() -> Engineered:
    """The same of two brackets with upright faces: bolts come from the side, or the product is laid
    down so that they come from above."""
    at = corners(14, 14)
    left = drilled(box(44, 44, 8), at, 2.1) + box(44, 8, 40, (0, -22, -40))
    right = drilled(box(44, 44, 8, (0, 0, 8)), at, 2.1) + box(44, 8, 40, (0, -22, 16))
    parts = {"left": left, "right": right}
    parts |= numbered("bolt", lambda p: screw(p, 16, 20, 2), at)
    parts |= numbered("nut", lambda p: nut(p, -3.2, 2), at)
    nuts = tuple((f"bolt{n}", f"nut{n}") for n in range(1, 5))
    order = (("left", "bolt*"), ("right", "bolt*"), *nuts)
    turned = {name: along_x(body) for name, body in parts.items()}
    return Engineered(turned, frozenset({"left", "right"}), order)


def pulley() -> Engineered:
    """A wheel in a fork, on an axle with a head, kept by a ring at its end."""
    fork = box(50, 40, 8) + box(6, 30, 40, (-14, 0, 8)) + box(6, 30, 40, (14, 0, 8))
    fork = fork - along_x(rod(4 + FIT, -40, 40)).translate((0, 0, 34))
    axle = along_x(rod(4, -25, 17) + rod(7, 17, 21)).translate((0, 0, 34))
    wheel = along_x(tube(18, 4 + FIT, -10, 10)).translate((0, 0, 34))
    ring = along_x(tube(7, 4 + FIT, -22, -17.2)).translate((0, 0, 34))
    parts = {"fork": fork, "wheel": wheel, "axle": axle, "ring": ring}
    return Engineered(parts, frozenset({"fork"}), (("wheel", "axle"), ("axle", "ring")))


def bearing_block() -> Engineered:
    """A bearing in a housing, under a screwed cap, on a shaft that goes through both."""
    at = corners(24, 24)
    housing = box(70, 70, 10) + rod(30, 10, 30) + sum_of(rod(6, 10, 30, p) for p in at)
    housing = housing - rod(16 + FIT, 12, 40) - rod(12, -5, 20)
    for place in at:
        housing = housing - rod(2, 16, 40, place)
    parts = {
        "housing": housing,
        "bearing": tube(16, 8 + FIT, 12, 26),
        "shaft": rod(8, -4, 60) + rod(10, 26, 28),
        "cap": drilled(box(64, 64, 5, (0, 0, 30)), at, 2.2) - rod(10 + FIT, 20, 40),
    }
    parts |= numbered("screw", lambda p: screw(p, 35, 14, 2), at)
    order = (("bearing", "cap"), ("bearing", "shaft"), ("cap", "screw*"))
    return Engineered(parts, frozenset({"housing"}), order)


def sum_of(bodies: object) -> Manifold:
    """The union of bodies."""
    made = Manifold()
    for body in bodies:  # type: ignore[attr-defined]
        made = made + body
    return made


def battery_box() -> Engineered:
    """Two springs and two cells in a tub with a cover that slides in."""
    tub = box(50, 80, 24) - box(44, 74, 40, (0, 0, 3)) + box(2, 74, 15, (0, 0, 3))
    tub = tub - box(46, 80, 2.4, (0, 3, 20))
    parts = {"tub": tub}
    for n, x in enumerate((-11.5, 11.5), 1):
        parts[f"spring{n}"] = along_y(tube(6, 4, 30, 36.8)).translate((x, 0, 11))
        parts[f"cell{n}"] = along_y(rod(8, -36.8, 29.8)).translate((x, 0, 11))
    parts["cover"] = box(46 - 2 * FIT, 76, 2, (0, 2, 20.2))
    order = (("cell*", "cover"), ("spring*", "cover"))
    return Engineered(parts, frozenset({"tub"}), order)


def board_stack() -> Engineered:
    """A board on four standoffs on a plate, screwed down, and a second one above it."""
    at = corners(22, 14)
    plate = box(60, 44, 6)
    for place in at:
        plate = plate - rod(1.5, 2, 9, place)
    parts = {"plate": plate}
    parts |= numbered(
        "standoff", lambda p: rod(3, 6, 18, p) + rod(1.5, 2, 6, p) - rod(1, 10, 20, p), at
    )
    parts["board"] = drilled(box(54, 38, 2, (0, 0, 18)), at, 1.2)
    parts["heatsink"] = box(16, 16, 9, (0, 0, 20))
    parts |= numbered("screw", lambda p: screw(p, 20, 9, 1), at)
    order = (("standoff*", "board"), ("board", "screw*"), ("board", "heatsink"))
    return Engineered(parts, frozenset({"plate"}), order)


def pump() -> Engineered:
    """An impeller on a shaft in a body, a gasket, a cover and six screws."""
    at = [(26 * np.cos(a), 26 * np.sin(a)) for a in np.pi / 3 * np.arange(6)]
    body = rod(31, 0, 24) - rod(20, 5, 30) - rod(4 + FIT, -5, 10)
    for place in at:
        body = body - rod(1.5, 12, 30, place)
    wheel = rod(18, 6, 14) + sum_of(
        box(16, 2, 8, (9, 0, 14)).rotate((0, 0, 90 * n)) for n in range(4)
    )
    parts = {
        "body": body,
        "impeller": wheel + rod(4, -12, 6),
        "gasket": drilled(tube(31, 20, 24, 25), at, 1.7),
        "cover": drilled(rod(31, 25, 30), at, 1.7) - rod(6, 20, 40),
    }
    parts |= numbered("screw", lambda p: screw(p, 30, 15), at)
    order = (("impeller", "cover"), ("gasket", "cover"), ("cover", "screw*"))
    return Engineered(parts, frozenset({"body"}), order)


def lantern() -> Engineered:
    """A candle in a glass on a base, under a roof with a finial."""
    base = rod(30, 0, 8) - tube(24 + FIT, 21 - FIT, 5, 10) - rod(8 + FIT, 4, 10)
    parts = {
        "base": base,
        "candle": rod(8, 4, 34),
        "glass": tube(24, 21, 5, 60),
        "roof": rod(32, 60, 68) - rod(24 + FIT, 55, 62) + rod(20, 60, 62) - rod(4 + FIT, 64, 70),
        "finial": rod(4, 64, 70) + Manifold.sphere(7, 48).translate((0, 0, 76)),
    }
    parts["glass"] = tube(24, 21, 5, 61.8)
    order = (("candle", "roof"), ("glass", "roof"), ("roof", "finial"))
    return Engineered(parts, frozenset({"base"}), order)


def gear_train() -> Engineered:
    """Two gears on pins in a plate, under a bridge that is screwed onto two posts."""
    at, posts = [(-12.0, 0.0), (13.0, 0.0)], [(0.0, 24.0), (0.0, -24.0)]
    plate = box(70, 60, 8) - sum_of(rod(3, 3, 9, p) for p in at)
    for place in posts:
        plate = plate + rod(5, 8, 24, place) - rod(1.5, 12, 30, place)
    parts = {"plate": plate}
    parts |= numbered("pin", lambda p: rod(3, 3, 22, p), at)
    parts |= {
        f"gear{n}": tube(r, 3 + FIT, 8.2, 18, p)
        for n, (p, r) in enumerate(zip(at, (14, 10.5), strict=True), 1)
    }
    parts["bridge"] = drilled(box(46, 58, 4, (0, 0, 24)), posts, 1.7)
    parts |= numbered("screw", lambda p: screw(p, 28, 14), posts)
    order = (("pin1", "gear1"), ("pin2", "gear2"), ("gear*", "bridge"), ("bridge", "screw*"))
    return Engineered(parts, frozenset({"plate"}), order)


def toy_car() -> Engineered:
    """A chassis on two axles with four wheels, and a shell on it with a screw."""
    chassis = box(80, 30, 10, (0, 0, 8)) - rod(1.5, 0, 30)
    parts: dict[str, Manifold] = {}
    for n, x in enumerate((-25, 25), 1):
        hole = along_y(rod(3 + FIT, -40, 40)).translate((x, 0, 12))
        chassis = chassis - hole
        parts[f"axle{n}"] = along_y(rod(3, -24, 24)).translate((x, 0, 12))
        for side in (-1, 1):
            wheel = tube(11, 3 + FIT, 17, 23) if side > 0 else tube(11, 3 + FIT, -23, -17)
            parts[f"wheel{n}{'lr'[side > 0]}"] = along_y(wheel).translate((x, 0, 12))
    shell = box(76, 30, 20, (0, 0, 18)) - box(60, 24, 14, (0, 0, 17)) - rod(1.7, 10, 50)
    parts = {"chassis": chassis, **parts, "shell": shell, "screw": screw((0, 0), 38, 28)}
    order = (("axle1", "wheel1*"), ("axle2", "wheel2*"), ("shell", "screw"))
    return Engineered(parts, frozenset({"chassis"}), order)


def doweled() -> Engineered:
    """A block on two dowels in a table, with two screws."""
    at, screws = [(-20.0, 12.0), (20.0, -12.0)], [(-20.0, -12.0), (20.0, 12.0)]
    table = box(90, 60, 12)
    block = drilled(box(60, 40, 18, (0, 0, 12)), at, 3 + FIT)
    for place in at:
        table = table - rod(3, 2, 20, place)
    for place in screws:
        table = table - rod(2, 2, 20, place)
    block = drilled(block, screws, 2.2)
    parts = {"table": table, "block": block, **numbered("dowel", lambda p: rod(3, 2, 22, p), at)}
    parts |= numbered("screw", lambda p: screw(p, 30, 26, 2), screws)
    return Engineered(parts, frozenset({"table"}), (("dowel*", "block"), ("block", "screw*")))


def tower() -> Engineered:
    """Rings on a post, and a cap."""
    parts = {"foot": rod(30, 0, 8) + rod(6, 8, 60)}
    parts |= {f"ring{n}": tube(28 - 4 * n, 6 + FIT, 12 * n - 4, 12 * n + 8) for n in (1, 2, 3, 4)}
    parts["cap"] = rod(10, 56, 66) - rod(6 + FIT, 50, 60.2)
    order = tuple((f"ring{n}", f"ring{n + 1}") for n in (1, 2, 3))
    return Engineered(parts, frozenset({"foot"}), (*order, ("ring4", "cap")))


def push_button() -> Engineered:
    """A spring and a plunger in a housing, under a bezel with two screws."""
    at = [(-16.0, 0.0), (16.0, 0.0)]
    housing = box(44, 26, 24) - rod(10, 4, 40)
    for place in at:
        housing = housing - rod(1.5, 10, 40, place)
    parts = {
        "housing": housing,
        "spring": tube(8, 6, 4, 14),
        "plunger": rod(10 - FIT, 14, 20) + rod(6, 20, 34),
        "bezel": drilled(box(44, 26, 4, (0, 0, 24)), at, 1.7) - rod(6 + FIT, 20, 40),
    }
    parts |= numbered("screw", lambda p: screw(p, 28, 14), at)
    order = (("spring", "plunger"), ("plunger", "bezel"), ("bezel", "screw*"))
    return Engineered(parts, frozenset({"housing"}), order)


MADE: tuple[Callable[[], Engineered], ...] = (
    instrument,
    flange,
    upright_flange,
    keyed_shaft,
    hinge,
    pulley,
    piston,
    cabinet,
    bearing_block,
    battery_box,
    board_stack,
    pump,
    valve,
    lantern,
    gear_train,
    toy_car,
    doweled,
    tower,
    clamp,
    push_button,
)


def write_stl(parts: Parts, folder: Path) -> Path:
    """The parts as STL files in millimetres, each where it is in the product."""
    folder.mkdir(parents=True, exist_ok=True)
    for label, body in parts.items():
        mesh = body.to_mesh()
        points = np.asarray(mesh.vert_properties)[:, :3]
        made = trimesh.Trimesh(points, np.asarray(mesh.tri_verts), process=False)
        made.export(folder / f"{label}.stl")
    return folder


TEMPLATES = all_templates()


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ways are the same without CoACD, which takes most of the time."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


def joins(tree: Tree) -> Iterator[tuple[list[str], list[str]]]:
    """The operations of a tree: the pile, and what comes."""
    below = (tree.tree, *tree.screws) if isinstance(tree, Screwed) else tree
    if isinstance(below, str):
        return
    pile = list[str]()
    for one in below:
        yield from joins(one)
        if pile:
            yield pile, list(leaves(one))
        pile = [*pile, *leaves(one)]


def faults(made: Engineered, found: Planned) -> list[str]:
    """What an engineer would do otherwise."""
    base = leaves(found.tree)[0]
    wrong = [] if base in made.base else [f"{base} is the base"]
    for first, then in made.pairs():
        for pile, come in joins(found.tree):
            if then in pile and first in come:
                wrong.append(f"{then} is there before {first}")
    return wrong


def planned(made: Engineered, folder: Path, options: PlanOptions) -> Planned:
    source = read_source(write_stl(made.parts, folder), TEMPLATES, SourceOptions("mm"))
    return plan_of(source, options)


def plan_of(source: InPlace, options: PlanOptions) -> Planned:
    found = plan(source, options)
    assert isinstance(found, Planned)
    return found


@pytest.mark.slow
def test_orders_are_those_of_an_engineer_with_a_layout(tmp_path: Path) -> None:
    wrong = {}
    for make in MADE:
        made = make()
        found = planned(made, tmp_path / make.__name__, PlanOptions())
        if bad := faults(made, found):
            wrong[make.__name__] = bad
    assert len(MADE) == 20 and len(wrong) <= 2, wrong


def test_names_say_what_is_in_and_what_on_another(tmp_path: Path) -> None:
    """The key is named before the shaft, whichever comes; what is under a flange is not in it."""
    shaft = rod(20, 60, 70) + rod(8, 0, 80)
    parts = {
        "tub": box(60, 60, 40) - box(54, 54, 50, (0, 0, 3)),
        "cell": box(20, 20, 20, (0, 0, 3)),
        "spool": shaft,
        "ring": rod(3, 50, 60, (13, 0)),
    }
    source = read_source(write_stl(parts, tmp_path), TEMPLATES, SourceOptions("mm"))
    titles = Titles(source, set())
    assert titles.joined(("tub",), ("cell",)) == "cell_in_tub"
    assert titles.joined(("ring",), ("spool",)) == "ring_on_spool"
    assert titles.joined(("tub", "cell"), ("ring", "spool")) == "spool_on_tub"
