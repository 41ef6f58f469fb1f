"""Outfits: the skins in which a machine's solids are drawn, each in the frame of its solid.

An outfit lies within its solid, and stands out of it by no more than `OUT`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import cos, pi, sin

from factory.film.lettering import WEIGHT, height, lettering
from factory.film.look import EDGE, PART_EDGE
from factory.film.skins import RoundRectangle, Skin, extrusion, rounded, slab, spindle

OUT = 5e-4
"""Most that windows and words stand out of a solid [m]."""

Half = tuple[float, float, float]
"""Half the sides of a box [m]; of a cylinder its radius, and half its height."""

SLOTTED = (
    *((-1, -1), (-0.28, -1), (-0.28, -0.72), (0.28, -0.72), (0.28, -1)),
    *((1, -1), (1, -0.28), (0.72, -0.28), (0.72, 0.28), (1, 0.28)),
    *((1, 1), (0.28, 1), (0.28, 0.72), (-0.28, 0.72), (-0.28, 1)),
    *((-1, 1), (-1, 0.28), (-0.72, 0.28), (-0.72, -0.28), (-1, -0.28)),
)
"""The section of a post: an aluminium profile with a slot in each side."""

WAISTED = (
    *((-1, -1), (1, -1), (1, -0.4), (0.74, -0.2), (0.74, 0.15), (1, 0.35), (1, 1)),
    *((0.24, 1), (0.24, 0.55), (-0.24, 0.55), (-0.24, 1)),
    *((-1, 1), (-1, 0.35), (-0.74, 0.15), (-0.74, -0.2), (-1, -0.4)),
)
"""The section of a rail: waisted, with a groove on top."""

CUP = ((1.0, -0.8), (0.7, -0.4), (1.0, 0.0), (0.7, 0.4), (1.0, 0.8), (1.0, 1.0))
"""The profile of a suction cup: bellows of two folds."""

POST = 2 / 3
"""Width of a post's profile as a share of its solid's, whose foot is as wide as that."""


@dataclass(frozen=True, slots=True)
class Layer:
    """A skin of an outfit, by what it is, and the material it is of; "" for that of the solid."""

    what: str
    skin: Skin
    material: str = ""


Outfit = tuple[Layer, ...]


@cache
def block(half: Half, edge: float = EDGE) -> Outfit:
    """A box with round edges."""
    return (Layer("skin", rounded(*half, min(edge, 0.3 * min(half)))),)


@cache
def part_block(half: Half) -> Outfit:
    """A part that is a box, with edges so small that its seams are seen."""
    return (Layer("skin", rounded(*half, min(PART_EDGE, 0.12 * min(half)))),)


@cache
def part_disc(half: Half) -> Outfit:
    """A part that is a cylinder, its rims rounded as little."""
    radius, tall = half[0], half[1]
    bevel = min(PART_EDGE, 0.12 * min(radius, tall))
    side = ((radius - bevel, -tall), (radius, bevel - tall), (radius, tall - bevel))
    profile = ((0.0, -tall), *side, (radius - bevel, tall), (0.0, tall))
    return (Layer("skin", spindle(profile, 40)),)


@cache
def rail(half: Half) -> Outfit:
    """A rail along x."""
    section = tuple((half[1] * y, half[2] * z) for y, z in WAISTED)
    return (Layer("skin", extrusion(section, half[0]), "rail"),)


@cache
def post(half: Half) -> Outfit:
    """An upright profile on a foot, with a cap."""
    x, y, tall = half
    wide = POST * min(x, y)
    section = tuple((wide * u, wide * v) for u, v in SLOTTED)
    bar = extrusion(section, tall - 3e-3).along("y").moved(z=-1e-3)
    foot = slab(RoundRectangle(x, y, 4e-3), -tall, 5e-3 - tall, 1e-3)
    cap = slab(RoundRectangle(wide, wide, 2e-3), tall - 4e-3, tall, 1e-3)
    return Layer("skin", bar, "post"), Layer("caps", foot + cap, "dark")


@cache
def cup(half: Half) -> Outfit:
    """A suction cup."""
    radius, tall = half[0], half[1]
    profile = ((0.0, -1.0), (1.0, -1.0), *CUP, (0.0, 1.0))
    return (Layer("skin", spindle(tuple((radius * r, tall * z) for r, z in profile), 24), "cup"),)


@cache
def carriage(half: Half, number: str, seen: float) -> Outfit:
    """The body of a robot, of the paint of its role, on a dark skirt, with a dark plate on top, on
    which is its number, to be read from an azimuth `seen` in its frame [rad]."""
    x, y, z = half
    corner = 0.3 * min(x, y)
    shell = slab(RoundRectangle(x, y, corner), 4e-3 - z, z, 2.4e-3)
    skirt = slab(RoundRectangle(x - 2e-3, y - 2e-3, corner - 1e-3), -z, 9e-3 - z, 1e-3)
    plate = slab(RoundRectangle(x - 4e-3, y - 4e-3, corner - 3e-3), z - 1e-3, z + 2e-4, 2e-4)
    layers = [Layer("shell", shell), Layer("skirt", skirt, "dark"), Layer("plate", plate, "dark")]
    text = _number(half, number, seen)
    if text is not None:
        layers.append(Layer("number", text, "digit"))
    return tuple(layers)


MAST = 0.38
"""Share of the half top that the mast takes."""

RIM = 6e-3
"""Distance of a number from the edge of the top [m]."""


def _number(half: Half, number: str, seen: float) -> Skin | None:
    """The number beside the mast or behind it, whichever is nearest to the camera."""
    sides = (pi, half[0], half[1]), (pi / 2, half[1], half[0]), (-pi / 2, half[1], half[0])
    out, deep, wide = max(sides, key=lambda side: cos(side[0] - seen))
    near, far = MAST * deep, deep - RIM
    tall = height(number, 2 * (wide - RIM) - 4e-3, (far - near) / (1 + WEIGHT))
    text = lettering(number, tall) if tall > 0 else None
    if text is None:
        return None
    at = (near + far) / 2
    place = {"x": at * cos(out), "y": at * sin(out), "z": half[2] + 4e-4}
    return text.skin.spun(out + pi / 2).moved(**place)


def together(skins: Sequence[Skin]) -> Skin:
    """Several skins as one."""
    whole = skins[0]
    for skin in skins[1:]:
        whole = whole + skin
    return whole
