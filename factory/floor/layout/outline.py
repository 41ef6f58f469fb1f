"""The outline of a subtree: the floor that a robot and all that bring it something take.

Frame of a robot: u ahead along its heading, t along the heading of the robot it delivers to, the
origin at its B station. Blocks are rectangles of one layer with half a clearance around them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from operator import add

from factory.floor.layout.dimensions import LAYERS, TOOL_TRAVEL
from factory.floor.layout.footprint import Block, Footprint, Placed, Strip
from factory.floor.layout.shapes import Shape
from factory.support.boxes import hull
from factory.support.decimals import up

NOWHERE: Block = (inf, -inf, inf, -inf)

DETAILED = 4
"""Guests whose crowns an outline keeps apart; of more, all on one side are one block."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The choices for a robot: the side and the travel [m] of each robot that delivers to it, and
    the station [m] of each of its operations."""

    sides: dict[int, int] = field(default_factory=dict)
    travels: dict[int, float] = field(default_factory=dict)
    stations: dict[int, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Outline:
    """By layer the blocks, of which the first is what the robot itself takes about its stations, as
    wide as the lane of its path. `least`: its least travel [m]. Derived, by layer: `front`, the
    farthest extent ahead; `low`, `high`, to the sides."""

    shape: Shape
    choice: Choice
    blocks: tuple[tuple[Block, ...], ...]
    least: float
    front: tuple[float, ...] = field(init=False)
    low: tuple[float, ...] = field(init=False)
    high: tuple[float, ...] = field(init=False)

    def __post_init__(self) -> None:
        hulls = [
            hull(blocks) if len(blocks) > 1 else (*blocks, NOWHERE)[0] for blocks in self.blocks
        ]
        _, front, low, high = zip(*hulls, strict=True)
        for name, values in (("front", front), ("low", low), ("high", high)):
            object.__setattr__(self, name, values)

    @property
    def ahead(self) -> float:
        """The farthest extent ahead [m]."""
        return max(self.front)

    def rear(self, layer: int) -> float:
        """How far behind its B station the robot's own path reaches in a layer [m]."""
        return -self.blocks[layer][0][0] if self.blocks[layer] else 0.0

    @property
    def behind(self) -> float:
        """The farthest extent behind [m]."""
        return -min(block[0] for blocks in self.blocks for block in blocks)

    @property
    def crown(self) -> float:
        """Extent ahead of its guests [m]; negative without any."""
        return max((b[1] for blocks in self.blocks for b in blocks[1:]), default=-inf)

    def clear(self, strip: Strip) -> float:
        """Least travel to a path that takes a strip of the floor on its side, so that the outline
        is clear of it [m]."""
        return up(max(self.least, *map(add, self.front, strip)))


@dataclass(frozen=True, slots=True)
class Guest:
    """A robot that delivers to another: its outline, its side, its travel [m], its least travel
    [m], and its station."""

    robot: int
    outline: Outline
    side: int
    travel: float
    wanted: float = 0.0
    station: float = 0.0

    def seen(self, layer: int) -> list[Block]:
        """The blocks of a layer in its carrier's frame: its lane with what is about its B end, and
        its crown, the box of its guests."""
        blocks = self.outline.blocks[layer]
        if not blocks:
            return []
        lane = blocks[0]
        near = min(0.0, self.travel - lane[1])
        blocks_seen = [(lane[2], lane[3], near, self.travel - lane[0])]
        if len(blocks) > 1:
            ulo, uhi, tlo, thi = hull(blocks[1:])
            blocks_seen.append((tlo, thi, self.travel - uhi, self.travel - ulo))
        at = self.station
        if self.side > 0:
            return [(at + tlo, at + thi, near, far) for tlo, thi, near, far in blocks_seen]
        return [(at + tlo, at + thi, -far, -near) for tlo, thi, near, far in blocks_seen]


def crowns(guests: Sequence[Guest], layer: int) -> list[Block]:
    """The blocks of a layer that the guests of a robot take, in its frame."""
    if len(guests) <= DETAILED:
        return [block for guest in guests for block in guest.seen(layer)]
    boxes = []
    for side in (-1, +1):
        blocks = [b for guest in guests if guest.side == side for b in guest.seen(layer)]
        if blocks:
            boxes.append(hull(blocks))
    return boxes


def outlined(
    footprint: Footprint,
    piles: Sequence[Placed],
    guests: Sequence[Guest],
    choice: Choice,
    boxed: bool = False,
) -> Outline:
    """The outline of a robot with its piles and with those that deliver to it; with one block a
    layer if it is to be `boxed`."""
    blocks = tuple(footprint.blocks(piles))
    if guests:
        blocks = tuple((*blocks[layer], *crowns(guests, layer)) for layer in LAYERS)
        if boxed:
            blocks = tuple((hull(layer_blocks),) if layer_blocks else () for layer_blocks in blocks)
    least = max(
        TOOL_TRAVEL if footprint.shape.tool else footprint.shape.least, footprint.clearance.c
    )
    return Outline(footprint.shape, choice, blocks, least)
