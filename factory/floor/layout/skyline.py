"""The skyline of one side of a guidepath: what stands there, and how far out the next robot must
be.

Everything is pushed outwards until it is clear, so a short branch can stand under the crown of a
long one, and a long one can reach past a short one: the contours fit into each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from factory.floor.layout.dimensions import LAYERS
from factory.floor.layout.footprint import Block
from factory.floor.layout.outline import Outline
from factory.support.decimals import up

WINDOW = 16
"""So many blocks a layer are looked at; what was there before is a wall."""

TOUCH = 1e-9
"""Blocks [m] that overlap by less do not."""


@dataclass(frozen=True, slots=True)
class Skyline:
    """The blocks beside a path, by layer: (from, to, near, far), along the path and away from it,
    in the order in which they were put there.

    `nested`: whether a robot may come past another, or stop before it.
    """

    blocks: tuple[tuple[Block, ...], ...] = ((), (), ())
    nested: bool = True

    @classmethod
    def behind(cls, frontier: Sequence[float], nested: bool) -> Skyline:
        """An empty skyline with a frontier: where along the path, by layer, something may come to
        it."""
        bars = (((-inf, end, 0.0, 2 * TOUCH),) if end > -inf else () for end in frontier)
        return cls(tuple(bars), nested)

    def travel(self, outline: Outline, station: float, least: float) -> float:
        """The travel, of at least some length, of a robot that ends at a station [m]; infinity if
        its path is blocked."""
        travel, settled = least, False
        while not settled and travel < inf:
            settled = True
            for layer in LAYERS:
                if self.blocks[layer] and outline.blocks[layer]:
                    further = self._pushed(outline, layer, station, travel)
                    settled = settled and further == travel
                    travel = further
        return travel

    def _pushed(self, outline: Outline, layer: int, station: float, travel: float) -> float:
        beside, (_, _, low, high) = self.blocks[layer], outline.blocks[layer][0]
        low, high = low + station + TOUCH, high + station - TOUCH
        rear = outline.rear(layer)
        for start, end, near, _ in beside:
            if low < end and high > start and near < travel + rear - TOUCH:
                return inf
        for ulo, uhi, tlo, thi in outline.blocks[layer]:
            tlo, thi = tlo + station + TOUCH, thi + station - TOUCH
            for start, end, near, far in beside:
                if (
                    tlo < end
                    and thi > start
                    and travel - uhi < far - TOUCH
                    and travel - ulo > near + TOUCH
                ):
                    if far == inf:
                        return inf
                    travel = up(far + uhi)
        return travel

    def starts(self, outline: Outline, least: float) -> set[float]:
        """The stations after `least` where something of an outline comes clear of something."""
        stations = set[float]()
        for layer in LAYERS:
            edges = {block[2] for block in outline.blocks[layer]}
            for _, end, _, _ in self.blocks[layer]:
                stations.update(end - edge for edge in edges if least < end - edge < inf)
        return stations

    def taken(self, outline: Outline, station: float, travel: float) -> Skyline:
        """The skyline with a robot added at a station."""
        blocks = []
        for layer in LAYERS:
            rear = outline.rear(layer)
            new = [
                (station + tlo, station + thi, 0.0, travel + rear)
                for _, _, tlo, thi in outline.blocks[layer][:1]
            ]
            new += [
                (station + tlo, station + thi, travel - uhi, travel - ulo)
                for ulo, uhi, tlo, thi in outline.blocks[layer]
            ]
            if not self.nested:
                new = [(start, end, 0.0, inf) for start, end, _, _ in new]
            blocks.append(_window((*self.blocks[layer], *new)))
        return Skyline(tuple(blocks), self.nested)


def _window(blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    if len(blocks) <= WINDOW:
        return blocks
    old, new = blocks[: -WINDOW + 1], blocks[-WINDOW + 1 :]
    return ((-inf, max(block[1] for block in old), 0.0, inf), *new)
