"""The welds that a run switches, and the pairs of bodies that it may leave out of contact."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element

from factory.engine.mjcf import names
from factory.engine.mjcf.grips import grips_of, seen_from, turned
from factory.engine.mjcf.parts import parked_at, place_in
from factory.floor.geometry.fused_bodies import FusedBodies, Inside
from factory.floor.layout.feeding import outlets_of
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.support.rotations import upright
from factory.support.xml_writer import add, numbers


def add_welds(
    equality: Element,
    layout: Layout,
    hanging: Hanging,
    bodies: FusedBodies,
    copies: Mapping[str, int],
) -> None:
    """Grips, feeders, parking places, and the star that holds a finished product together."""
    factory = layout.factory
    for grip in grips_of(layout, bodies):
        axis = factory.chain(grip.robot)[-1]
        name, body = names.grip(axis.robot.name, grip.label), names.part(grip.label, 1)
        _weld(equality, name, names.moved(axis), body, grip.pose)
    outlets = {outlet.label: outlet for outlet in outlets_of(layout)}
    for label, outlet in outlets.items():
        path, slider = layout.guidepaths[outlet.robot], hanging.slider[label]
        (x, y), (u, v) = (o.layout.meeting(o.leaf) for o in (outlet, outlets[slider]))
        height = outlet.elevation - hanging.raised[label]
        solid, shown = layout.product.solids[label], slider == label
        centre = solid.presented().centre if solid.fed else bodies.centre[label]
        offset = place_in(layout.product, centre, (x - u, y - v), height)
        pose = *turned(offset, path.heading), *seen_from(path, solid.fed)
        body = names.part(label, 1)
        _weld(equality, names.feed(label), names.slider(slider), body, pose, shown)
        _park(equality, layout, label, copies[label], int(shown))
    for label in bodies.wholes:
        _park(equality, layout, label, copies[label], 0)
    for label in (body for product in factory.products for body in bodies.carried[product]):
        pose = (*place_in(layout.product, bodies.centre[label], (0.0, 0.0)), 1, 0, 0, 0)
        _weld(equality, names.hold(label), names.OUTFEED_TRAY, names.part(label, 1), pose)


def _park(equality: Element, layout: Layout, label: str, copies: int, used: int) -> None:
    """Where the copies of a body are kept, all but the first `used` of them now."""
    solid = layout.product.solids.get(label)
    fed = solid.fed if solid else 0.0
    for n in range(1, copies + 1):
        at = (*parked_at(layout, label, n), *upright(fed))
        _weld(equality, names.park(label, n), "world", names.part(label, n), at, n > used)


def add_exclusions(
    contact: Element, apart: Iterable[tuple[Inside, Inside]], copies: Mapping[str, int]
) -> None:
    """The pairs of parts between which there is no contact, each with a body that may bring it, a
    slot for each unit that can be inside: a run aims them at the copies of one unit."""
    slots = defaultdict[tuple[str, str], int](int)
    for (one, part), (other, partner) in apart:
        for n in range(1, min(copies[one], copies[other]) + 1):
            pair = names.solid(one, n, part), names.solid(other, n, partner)
            slots[part, partner] += 1
            name = names.exclusion(part, partner, slots[part, partner])
            add(contact, "exclude", name=name, body1=pair[0], body2=pair[1])


def _weld(
    equality: Element,
    name: str,
    body1: str,
    body2: str,
    pose: tuple[float, ...],
    active: bool = False,
) -> None:
    add(equality, "weld", name=name, body1=body1, body2=body2, relpose=numbers(pose), active=active)
