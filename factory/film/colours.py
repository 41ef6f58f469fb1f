"""The colours of operations and robots in panels and marks."""

from __future__ import annotations

from factory.engine.mjcf.robot_bodies import role_of
from factory.film.look import ROLES, Colour3
from factory.support.pictures.ink import Colour
from factory.theory.plant.factory import Factory

AMBER = (214, 148, 22)
"""Robots that stand."""

DEAD = (40, 40, 44)
"""Robots that are dead, until they are replaced."""

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
    users = [name for name in names if name not in TEMPLATES]
    chosen = {**TEMPLATES, **{name: OTHERS[n % len(OTHERS)] for n, name in enumerate(users)}}
    return {name: chosen[name] for name in (*names, factory.dropoff.template.name)}


def operation_colours(factory: Factory) -> tuple[Colour, ...]:
    """The colour of each operation: that of its template."""
    chosen = template_colours(factory)
    return tuple(chosen[o.template.name] for o in factory.operations)


def robot_colours(factory: Factory) -> tuple[Colour, ...]:
    """The colour of each robot: the paint of its role."""
    paint = {role: _colour(shade) for role, shade in ROLES.items()}
    return tuple(paint[role_of(factory, robot.index)] for robot in factory.robots)


def _colour(shade: Colour3) -> Colour:
    red, green, blue = (round(255 * part) for part in shade)
    return red, green, blue
