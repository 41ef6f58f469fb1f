"""From which side the two inputs of a mate come: that on which they lie in the product.

They come towards each other along the carrier's side t. Where their places in the product lie apart
along t but not across it, they would pass through each other if they came from the wrong sides.
"""

from __future__ import annotations

from collections.abc import Mapping

from factory.factory import Factory, Operation
from factory.geometry import Product
from factory.layout.plan import Box, Point2
from factory.layout.shapes import carriers, project
from factory.layout.stretching import Sides
from factory.pag import NOPART

APART = 0.25
"""Two inputs lie apart along t where they overlap there by less than this share of the shorter."""

TOUCH = 1e-3
"""Overlaps across t of no more than this [m] let two inputs pass each other."""

Span = tuple[float, float]


def uncrossed(
    factory: Factory, product: Product, payloads: Mapping[str, Box], sides: Sides
) -> Sides:
    """The sides, with the inputs of each mate swapped that would pass through each other.

    Carriers first: a swap turns the frames of all that comes after. Linear.
    """
    heights = _heights(factory, product)
    mates = {
        o.carrier: o for o in factory.operations[:-1] if o.before[o.template.carrier - 1] == NOPART
    }
    axes: list[tuple[Point2, Point2]] = []
    result = dict(sides)
    for robot, carrier in enumerate(carriers(factory)):
        u, t = (1.0, 0.0), (0.0, 1.0)
        if carrier >= 0:
            (u_on, t_on), side = axes[carrier], result[robot]
            u, t = (-side * t_on[0], -side * t_on[1]), u_on
        axes.append((u, t))
        guests = _guests(mates.get(robot))
        if guests is not None and _crossed(guests, payloads, heights, result, u, t):
            for guest, _ in guests:
                result[guest] = -result[guest]
    return result


def _guests(operation: Operation | None) -> list[tuple[int, str]] | None:
    """The two robots (and what they bring) that meet where a carrier begins; None if not two."""
    if operation is None:
        return None
    pairs = zip(operation.robots, operation.before, strict=True)
    guests = [(robot, label) for robot, label in pairs if label != NOPART]
    return guests if len(guests) == len(operation.robots) - 1 == 2 else None


def _crossed(
    guests: list[tuple[int, str]],
    payloads: Mapping[str, Box],
    heights: Mapping[str, Span],
    sides: Sides,
    u: Point2,
    t: Point2,
) -> bool:
    (one, first), (other, second) = guests
    a, b = project(payloads[first], u, t), project(payloads[second], u, t)
    if min(_overlap(a[:2], b[:2]), _overlap(heights[first], heights[second])) <= TOUCH:
        return False
    if _overlap(a[2:], b[2:]) >= APART * min(a[3] - a[2], b[3] - b[2]):
        return False
    ahead = one if a[2] + a[3] > b[2] + b[3] else other
    return sides[ahead] < 0


def _overlap(one: Span, other: Span) -> float:
    """How much two intervals share [m]; negative where they are apart."""
    return min(one[1], other[1]) - max(one[0], other[0])


def _heights(factory: Factory, product: Product) -> dict[str, Span]:
    """From where to where every sub-assembly reaches upwards, in the product's frame [m]."""
    found: dict[str, Span] = {}
    for operation in reversed(factory.operations[:-1]):
        spans = [found[label] for label in operation.inputs]
        if not spans:
            solid = product.solids[operation.label]
            spans = [(float(solid.low[2]), float(solid.high[2]))]
        found[operation.label] = (min(s[0] for s in spans), max(s[1] for s in spans))
    return found
