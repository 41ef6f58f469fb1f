"""The colours of the panels: robots as they are painted, operations by what they do."""

from __future__ import annotations

from collections.abc import Sequence

from factory.mjcf.robot_bodies import role_of
from factory.mjcf.robots import ROLES
from factory.plant.factory import Factory
from factory.rendering.ink import Colour, mixed

GROUND, INK, FAINT, LINE = (243, 243, 245), (38, 44, 54), (112, 121, 134), (205, 209, 215)
"""The ground, a shade lighter than the floor in the pictures; words, lesser words, lines."""

EDGE, FLASH = (222, 224, 229), (232, 60, 48)
"""Between the picture and the panels; what fires, and the present."""

AMBER = (214, 148, 22)
"""Robots that stand."""

DEAD = (40, 40, 44)
"""Robots that are dead, until they are replaced."""

WHITE = (255, 255, 255)

TEMPLATES = {
    "atomic": (120, 144, 172),
    "mate": (66, 133, 190),
    "insert": (124, 108, 178),
    "weld": (222, 128, 48),
    "dropoff": (44, 138, 118),
}
"""Operations that come with factory."""

OTHERS = ((190, 84, 130), (150, 132, 38), (98, 128, 66), (168, 92, 70), (70, 150, 160))
"""Operations of the user's own, in the order in which the factory needs them."""


def template_colours(factory: Factory) -> dict[str, Colour]:
    """The colour of each template of a factory, in the order in which products come by."""
    names = dict.fromkeys(o.template.name for o in reversed(factory.making))
    own = [name for name in names if name not in TEMPLATES]
    chosen = {**TEMPLATES, **{name: OTHERS[n % len(OTHERS)] for n, name in enumerate(own)}}
    return {name: chosen[name] for name in (*names, factory.dropoff.template.name)}


def operation_colours(factory: Factory) -> tuple[Colour, ...]:
    """The colour of each operation: that of its template."""
    chosen = template_colours(factory)
    return tuple(chosen[o.template.name] for o in factory.operations)


def robot_colours(factory: Factory) -> tuple[Colour, ...]:
    """The colour of each robot: the paint of its role."""
    paint = {role: _colour(rgba.split()) for role, rgba in ROLES.items()}
    return tuple(paint[role_of(factory, robot.index)] for robot in factory.robots)


def _colour(rgba: Sequence[str]) -> Colour:
    red, green, blue = (round(255 * float(word)) for word in rgba[:3])
    return red, green, blue


def pale(colour: Colour, share: float = 0.78) -> Colour:
    """A colour thinned with white."""
    return mixed(colour, WHITE, share)
