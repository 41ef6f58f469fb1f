"""The welds that a run switches, and the pairs of bodies that it may leave out of contact."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element

from factory.layout.layout import Layout
from factory.mjcf import names
from factory.mjcf.elements import add, numbers
from factory.mjcf.hanging import Hanging
from factory.mjcf.parts import parked_at, place_in
from factory.mjcf.robots import heading_quaternion
from factory.plant.fused_bodies import FusedBodies, Inside


def add_welds(
    equality: Element,
    layout: Layout,
    hanging: Hanging,
    bodies: FusedBodies,
    copies: Mapping[str, int],
) -> None:
    """Grips, feeders, parking places, and the star that holds a finished product together."""
    factory = layout.factory
    for robot, path in zip(factory.robots, layout.guidepaths, strict=True):
        w, _, _, z = heading_quaternion(path)
        holder = names.head if robot.index in factory.strokes else names.carriage
        for label in bodies.handled(factory, robot.index):
            pose = (*grip_position(layout, bodies, robot.index, label), w, 0, 0, -z)
            grip, body = names.grip(robot.name, label), names.part(label, 1)
            _weld(equality, grip, holder(robot.name), body, pose)
    for operation in factory.leaves:
        label = operation.label
        path = layout.guidepaths[operation.carrier]
        w, _, _, z = heading_quaternion(path)
        slider = hanging.slider[label]
        (x, y), (u, v) = layout.meeting(operation), layout.meeting(factory.by_label[slider])
        height = layout.elevation(operation.carrier, operation.index) - hanging.raised[label]
        offset = place_in(layout.product, bodies.centre[label], (x - u, y - v), height)
        pose = (*_turned(offset, path.heading), w, 0, 0, -z)
        shown, body = label == slider, names.part(label, 1)
        _weld(equality, names.feed(label), names.slider(slider), body, pose, shown)
        _park(equality, layout, label, copies[label], int(shown))
    for label in bodies.wholes:
        _park(equality, layout, label, copies[label], 0)
    for label in (body for product in factory.products for body in bodies.carried[product]):
        pose = (*place_in(layout.product, bodies.centre[label], (0.0, 0.0)), 1, 0, 0, 0)
        _weld(equality, names.hold(label), names.OUTFEED_TRAY, names.part(label, 1), pose)


def _park(equality: Element, layout: Layout, label: str, copies: int, used: int) -> None:
    """Where the copies of a body are kept, all but the first `used` of them now."""
    for n in range(1, copies + 1):
        at = (*parked_at(layout, label, n), 1, 0, 0, 0)
        _weld(equality, names.park(label, n), "world", names.part(label, n), at, n > used)


def add_exclusions(
    contact: Element, apart: Iterable[tuple[Inside, Inside]], copies: Mapping[str, int]
) -> None:
    """The pairs of parts between which there is no contact, each with the body that brings it, a
    slot for each unit that can be inside: a run aims them at the copies of one unit."""
    for (one, part), (other, partner) in apart:
        for n in range(1, min(copies[one], copies[other]) + 1):
            pair = names.solid(one, n, part), names.solid(other, n, partner)
            name = names.exclusion(part, partner, n)
            add(contact, "exclude", name=name, body1=pair[0], body2=pair[1])


def grip_position(
    layout: Layout, bodies: FusedBodies, robot: int, label: str
) -> tuple[float, float, float]:
    """Where a robot holds a body's centre of mass, in the frame of its carriage, or of its head
    [m]."""
    path = layout.guidepaths[robot]
    at = path.middle(0.0)
    foot = path.carriage(0.0)
    begins, *_ = layout.factory.tours[robot][layout.factory.tour_with(robot, label)]
    more = layout.shift(robot, begins)
    middle = (at[0] + more[0] - foot[0], at[1] + more[1] - foot[1])
    x, y, z = place_in(layout.product, bodies.centre[label], middle, layout.held_at(robot, begins))
    return _turned((x, y, z), path.heading)


def _turned(
    v: tuple[float, float, float], heading: tuple[float, float]
) -> tuple[float, float, float]:
    """A vector of the world in a frame whose x is the heading."""
    u, w = heading
    return (v[0] * u + v[1] * w, -v[0] * w + v[1] * u, v[2])


def _weld(
    equality: Element,
    name: str,
    body1: str,
    body2: str,
    pose: tuple[float, ...],
    active: bool = False,
) -> None:
    add(equality, "weld", name=name, body1=body1, body2=body2, relpose=numbers(pose), active=active)
