"""The exploded view of a product: how far, and along which way, each input of an operation is taken
away from the others, so that each part stands free on the way that it comes along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.compiler.mating.findings import Matings
from factory.geometry.meshes import Array
from factory.geometry.solids import Product
from factory.plant.approaches import Approach, Kind
from factory.problem.pag import PAG

ROOM = 0.15
"""Between what is taken apart there is this share of the product's diagonal."""


MOST = 24
"""So many operations, the last ones, are taken back; what was made before stands together."""


@dataclass(frozen=True, slots=True)
class Withdrawal:
    """What is done to take an operation back: its `label`, the parts that move, the direction (3,)
    in which they leave, a unit vector of the product's frame, how far they go [m], and the kind of
    its approach."""

    label: str
    moving: tuple[str, ...]
    direction: Array
    distance: float
    kind: Kind


@dataclass(frozen=True)
class Explosion:
    """The withdrawals of the last operations, in the order of assembly, and the parts of the
    product."""

    parts: tuple[str, ...]
    steps: tuple[Withdrawal, ...] = field(repr=False)

    def offsets(self, done: float) -> Array:
        """How far each part is from its place (n, 3) [m], when so many operations are done: 0 is
        all apart, 2.5 two operations and half of the third."""
        index = {label: number for number, label in enumerate(self.parts)}
        found = np.zeros((len(self.parts), 3))
        for number, step in enumerate(self.steps):
            left = 1.0 - _eased(min(max(done - number, 0.0), 1.0))
            if left > 0:
                found[[index[label] for label in step.moving]] += (
                    left * step.distance * step.direction
                )
        return found


def _eased(share: float) -> float:
    """From 0 to 1, slowly at either end."""
    return share * share * (3 - 2 * share)


def explosion(pag: PAG, matings: Matings, product: Product) -> Explosion:
    """The exploded view of a product whose operations were judged. Each step moves the fewer parts
    away from the others, as far as their boxes need to be clear of each other along the way."""
    parts = tuple(node.label for node in pag.parts())
    index = {label: number for number, label in enumerate(parts)}
    low = np.array([product.solids[label].low for label in parts])
    high = np.array([product.solids[label].high for label in parts])
    room = ROOM * float(np.linalg.norm(product.high - product.low))
    inside: dict[str, list[int]] = {}
    for node in pag.postorder():
        own = [] if node.inputs else [index[node.label]]
        inside[node.label] = own + [n for label in node.inputs for n in inside[label]]
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
    """The parts that are moved, and the way in which they leave."""
    direction = np.zeros(3)
    if approach.kind == "lower":
        direction[2] = 1.0
        return (ours if approach.lowered == last else rest), direction
    direction[approach.axis] = approach.sides[0]
    return (ours, direction) if len(ours) <= len(rest) else (rest, -direction)


def _clear(
    low: Array, high: Array, moving: Sequence[int], others: Sequence[int], direction: Array
) -> float:
    """How far the boxes of what moves go along an axis until they have passed all others that are
    in their way."""
    axis, side = int(np.abs(direction).argmax()), float(direction.sum())
    across = [k for k in range(3) if k != axis]
    needed = 0.0
    for n in moving:
        meets = (low[others][:, across] < high[n, across]).all(axis=1)
        meets &= (high[others][:, across] > low[n, across]).all(axis=1)
        if meets.any():
            ahead = np.asarray(others)[meets]
            reach = high[ahead, axis].max() if side > 0 else -low[ahead, axis].min()
            own = low[n, axis] if side > 0 else -high[n, axis]
            needed = max(needed, float(reach - own))
    return needed
