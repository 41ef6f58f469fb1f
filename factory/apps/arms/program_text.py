"""An arm's program in the words of a robot's language, to be read beside its table of joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from factory.api import Factory, Layout, Order, names
from factory.apps.arms.joint_table import JointLeg, legs_of

VIA = 3
"""Number of places between the straight ends of a leg that are told."""

BLEND = 0.05
"""Radius of a blend there [m]."""

HEAD = """\
# {name}, a {kind}: its cycle makes one unit of {product}.
# Joints in rad: {joints}.
# The certified curve is that of the table, {name}.joints.csv: servoj, or the cam of an external
# axis, follows it. movej with a blend is another curve: this program is to be read, and is not
# certified. x is the coordinate of the table, which grows from where the arm places to its feeders.
"""


def program_text(layout: Layout, robot: int, orders: Sequence[Order]) -> str:
    """The program of an arm.

    Args:
        layout: of a cell.
        robot: the arm (index).
        orders: the order places of the cell's coordinated net.
    """
    of = layout.factory.robots[robot]
    joints = [joint.partition("/")[2] for joint, _ in names.moved_along(of)]
    head = HEAD.format(
        name=of.name, kind=of.type, product=layout.factory.pag.root, joints=", ".join(joints)
    )
    return head + "\n".join((f"def {of.name}():", *_legs(layout, robot, orders), "end")) + "\n"


def _legs(layout: Layout, robot: int, orders: Sequence[Order]) -> Iterator[str]:
    legs = legs_of(layout, robot)
    for number, leg in enumerate(legs):
        yield ""
        yield from _leg(leg, legs[number - 1], orders)


def _leg(leg: JointLeg, before: JointLeg, orders: Sequence[Order]) -> Iterator[str]:
    """The lines of a leg, which the arm begins after it has followed another."""
    operation, factory = leg.operation, leg.layout.factory
    label, carrier = operation.label, factory.robots[operation.carrier].name
    begin, end = leg.ends
    sign, way = np.sign(end - begin), leg.way
    hover = begin + sign * way.hover
    if leg.brings:
        yield f"  # place on {carrier}: {label}"
        yield from _waits(factory, operation.start, orders)
        yield f'  wait_start("{label}")  # {carrier} brings what it is placed on'
    else:
        source = next((r for r in operation.robots if r != operation.carrier), None)
        carrier = factory.robots[operation.carrier if source is None else source].name
        yield f"  # fetch {label}" if source is None else f"  # take from {carrier}: {label}"
        yield from _passes(leg, before, orders)
    off = begin + sign * way.off
    yield f"  movel({_joints(leg, off)})  # straight, x = {off:.4f}"
    for x in np.linspace(off, hover, VIA + 2)[1:-1].tolist():
        yield f"  movej({_joints(leg, x)}, r={BLEND:g})  # x = {x:.4f}"
    yield f"  movej({_joints(leg, hover)})  # x = {hover:.4f}"
    if leg.brings or operation.inputs:
        yield f'  wait_carrier("{carrier}", "{label}")  # it stands at the station'
    else:
        yield f'  wait_part("{label}")  # its feeder shows it'
    yield f"  movel({_joints(leg, end)})  # straight, x = {end:.4f}"
    yield f"  set_vacuum({'False' if leg.brings else 'True'})"


def _joints(leg: JointLeg, x: float) -> str:
    return f"[{', '.join(f'{q:.4f}' for q in leg.at(np.array([x]))[0])}]"


def _waits(factory: Factory, start: int, orders: Iterable[Order]) -> Iterator[str]:
    """The order places that the start of an operation takes a token from."""
    for order in orders:
        if order.start == start:
            done = factory.operation_of(order.before)
            if order.past is None:
                yield f'  wait_order("{done.label}")'
            else:
                other = factory.robots[factory.robot_of(order.past.axis)].name
                yield f'  wait_past("{other}", x={order.past.at:.4f})  # after {done.label}'


def _passes(leg: JointLeg, before: JointLeg, orders: Iterable[Order]) -> Iterator[str]:
    """The passes of an arm on its way from where it has placed a part that others wait for."""
    for order in orders:
        past = order.past
        if past and past.axis == leg.robot and past.after == before.operation.end:
            waits = leg.layout.factory.operation_of(order.start).label
            yield f"  when_past(x={past.at:.4f})  # then {waits} may start"
