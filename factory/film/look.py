"""The look: surfaces by colour, metallic share and roughness, sizes of edges, and light.

A machine in white, graphite and aluminium on a light floor. Only the robots' roles and the product
are saturated, so the eye goes there. Both renderers read the same table: the classic one takes the
colour and a highlight that follows from the roughness, Filament takes all of it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from factory.support.xml_writer import add, numbers

Colour3 = tuple[float, float, float]
"""sRGB, each from 0 to 1."""


@dataclass(frozen=True, slots=True)
class Surface:
    """What a skin is made of.

    Attributes:
        colour: sRGB.
        metallic: 0 for a paint or plastic, 1 for a bare metal.
        rough: 0 for a mirror, 1 for chalk.
        opacity: 0 for what cannot be seen.
    """

    colour: Colour3
    metallic: float = 0.0
    rough: float = 0.4
    opacity: float = 1.0

    def coat(self, material: Element) -> None:
        """Give a material this surface; its highlight is that of the classic renderer."""
        smooth = 1.0 - self.rough
        material.attrib.update(
            rgba=numbers((*self.colour, self.opacity)),
            metallic=numbers([self.metallic]),
            roughness=numbers([self.rough]),
            specular=f"{(0.15 + 0.5 * self.metallic) * smooth:.3g}",
            shininess=f"{smooth * smooth:.3g}",
        )


ROLES: dict[str, Colour3] = {
    "output": (0.03, 0.50, 0.43),
    "carrier": (0.07, 0.29, 0.66),
    "fed": (0.28, 0.50, 0.78),
    "tool": (0.95, 0.42, 0.04),
}
"""The paint of robots by what they do, the same in 3-D and in panels."""

PART = Surface((0.5, 0.5, 0.5))
"""A part, which has a colour of its own."""

SURFACES = {
    "rail": Surface((0.56, 0.58, 0.61), 0.45, 0.36),
    "post": Surface((0.80, 0.81, 0.825), 0.25, 0.42),
    "buffer": Surface((0.09, 0.09, 0.10), 0.0, 0.60),
    "housing": Surface((0.90, 0.905, 0.91)),
    "tray": Surface((0.30, 0.32, 0.35), 0.3, 0.38),
    "belt": Surface((0.075, 0.078, 0.085), 0.0, 0.75),
    "frame": Surface((0.78, 0.79, 0.80), 0.5, 0.40),
    "dark": Surface((0.085, 0.09, 0.10), 0.0, 0.48),
    "glass": Surface((0.075, 0.083, 0.098), 0.0, 0.10),
    "ink": Surface((0.13, 0.14, 0.16), 0.0, 0.60),
    "cup": Surface((0.10, 0.105, 0.115), 0.0, 0.55),
    "digit": Surface((0.96, 0.97, 0.98), 0.0, 0.60),
    "steel": Surface((0.80, 0.81, 0.825), 0.45, 0.34),
    "rubber": Surface((0.085, 0.09, 0.10), 0.0, 0.70),
    **{f"role/{role}": Surface(colour, 0.0, 0.32) for role, colour in ROLES.items()},
}
"""Surfaces by the names of materials, those of robot types by the last word: `dot/steel`."""


@dataclass(frozen=True, slots=True)
class FloorPaint:
    """The floor's colour, and that of the seams between its tiles."""

    tile: Colour3
    seam: Colour3


CLASSIC_FLOOR = FloorPaint((0.855, 0.865, 0.88), (0.80, 0.812, 0.83))
FILAMENT_FLOOR = FloorPaint((0.53, 0.545, 0.565), (0.47, 0.485, 0.505))
"""Darker than the classic renderer's, which has no tone mapping."""

AMBIENT, DIFFUSE = (0.59, 0.59, 0.60), (0.08, 0.08, 0.08)
"""The headlight of the classic renderer."""

LIGHTS: dict[str, tuple[Colour3, float]] = {
    "key": ((0.39, 0.38, 0.36), 0.30),
    "fill": ((0.10, 0.105, 0.12), 0.0),
}
"""Its sun and its sky: their light, and the strength of their highlights."""

EDGE, PART_EDGE = 1.6e-3, 8e-4
"""Radius of the edges of machines and of parts [m]."""


def paint(root: Element, floor: FloorPaint = CLASSIC_FLOOR) -> None:
    """Give all materials of a model their surfaces, add those that it lacks, and set its lights."""
    asset = next(root.iter("asset"))
    here = {material.get("name") or "": material for material in asset.findall("material")}
    for name, material in here.items():
        surface = SURFACES.get(name) or SURFACES.get(name.rpartition("/")[2])
        if surface is not None:
            surface.coat(material)
    for name, surface in SURFACES.items():
        if name not in here:
            surface.coat(add(asset, "material", name=name))
    if "floor" in here:
        here["floor"].attrib.update(metallic="0", roughness="0.55", specular="0", shininess="0")
    _lay(asset.findall("texture"), floor)
    _light(root)


def _lay(textures: Iterable[Element], floor: FloorPaint) -> None:
    for texture in textures:
        if texture.get("name") == "floor":
            texture.attrib.update(rgb1=numbers(floor.tile), markrgb=numbers(floor.seam))


def _light(root: Element) -> None:
    for head in root.iter("headlight"):
        head.attrib.update(ambient=numbers(AMBIENT), diffuse=numbers(DIFFUSE))
    for light in root.iter("light"):
        colour, highlight = LIGHTS.get(light.get("name") or "", LIGHTS["fill"])
        light.attrib.update(diffuse=numbers(colour), specular=numbers([highlight] * 3))
