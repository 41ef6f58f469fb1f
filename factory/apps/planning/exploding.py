"""The exploded view of a product: the distance and direction by which each input of an operation is
moved away from the others, so that every part is free on its way in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.api import PAG, Approach, Matings, Product
from factory.support.arrays import Array

ROOM = 0.15
"""The gap between separated inputs, as a share of the product's diagonal."""


MOST = 24
"""The most operations that are taken back, from the last one; earlier sub-assemblies stay
together."""


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """The inverse of an operation: its `label`, the parts that move, the `direction` (3,) in which
    they leave, a unit vector in the product's frame, their `distance` [m], and the kind of
    approach."""

    label: str
    moving: tuple[str, ...]
    direction: Array
    distance: float
    kind: str


@dataclass(frozen=True)
class Explosion:
    """The withdrawals of the last operations, in the order of assembly, and the parts of the
    product."""

    parts: tuple[str, ...]
    steps: tuple[Withdrawal, ...] = field(repr=False)

    def offsets(self, done: float) -> Array:
        """The displacements of the parts (n, 3) [m] when a number of operations is done: 0 for all
        apart, 2.5 for two operations and half of the third."""
        index = {label: number for number, label in enumerate(self.parts)}
        offsets = np.zeros((len(self.parts), 3))
        for number, step in enumerate(self.steps):
            share = min(max(done - number, 0.0), 1.0)
            left = 1.0 - share * share * (3 - 2 * share)  # with zero slope at either end
            if left > 0:
                offsets[[index[label] for label in step.moving]] += (
                    left * step.distance * step.direction
                )
        return offsets


def explosion(pag: PAG, matings: Matings, product: Product) -> Explosion:
    """The exploded view of a product whose operations were judged. Each step moves the smaller
    number of parts, as far as their boxes need to be clear of the others along the way."""
    parts = tuple(node.label for node in pag.parts())
    index = {label: number for number, label in enumerate(parts)}
    low = np.array([product.solids[label].low for label in parts])
    high = np.array([product.solids[label].high for label in parts])
    room = ROOM * float(np.linalg.norm(product.high - product.low))
    inside: dict[str, list[int]] = {}
    for node in pag.postorder():
        itself = [] if node.inputs else [index[node.label]]
        inside[node.label] = itself + [n for label in node.inputs for n in inside[label]]
    steps = []
    for number, mating in enumerate(matings.all, MOST - len(matings.all)):
        *first, last = mating.inputs
        ours = inside[last]
        rest = [n for label in first for n in inside[label]]
        inside[mating.label] = rest + ours
        if number < 0:
            continue
        moving, direction = _moving(mating.approach, last, ours, rest)
        others = rest if moving is ours else ours
        distance = _clear(low, high, moving, others, direction) + room
        low[moving] += distance * direction
        high[moving] += distance * direction
        labels = tuple(parts[n] for n in moving)
        steps.append(Withdrawal(mating.label, labels, direction, distance, mating.approach.kind))
    return Explosion(parts, tuple(steps))


def _moving(
    approach: Approach, last: str, ours: list[int], rest: list[int]
) -> tuple[list[int], Array]:
    """The parts that are moved, and their direction."""
    direction = np.zeros(3)
    if approach.kind == "lower":
        direction[2] = 1.0
        return (ours if approach.lowered == last else rest), direction
    direction[approach.axis] = approach.sides[0]
    return (ours, direction) if len(ours) <= len(rest) else (rest, -direction)


def _clear(
    low: Array, high: Array, moving: Sequence[int], others: Sequence[int], direction: Array
) -> float:
    """The distance that the boxes of moving parts travel along an axis until they have passed all
    others in their way."""
    axis, side = int(np.abs(direction).argmax()), float(direction.sum())
    across = [k for k in range(3) if k != axis]
    needed = 0.0
    for n in moving:
        meets = (low[others][:, across] < high[n, across]).all(axis=1)
        meets &= (high[others][:, across] > low[n, across]).all(axis=1)
        if meets.any():
            ahead = np.asarray(others)[meets]
            reach = high[ahead, axis].max() if side > 0 else -low[ahead, axis].min()
            edge = low[n, axis] if side > 0 else -high[n, axis]
            needed = max(needed, float(reach - edge))
    return needed
