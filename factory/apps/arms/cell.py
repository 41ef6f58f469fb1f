"""A cell: a carrier's line with an arm beside it, and the arm's feeders on a circle round its base.

The carrier stops at one station, or near it if the tool of the arm stays on a circle. The arm takes
each part from a feeder of its own, in which it rises from below, and places it on the product.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, hypot, sin
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np

from factory.api import Dimensions, Factory, Hand, Product, Solid
from factory.apps.arms.body import STEM, Stand, add, standing
from factory.apps.arms.curves import LegTable, SoughtLegs
from factory.apps.arms.holds import UP, facing_up, product_of, quaternion
from factory.apps.arms.model import ArmModel
from factory.floor.layout.guidepath import Feeder
from factory.support.arrays import Array
from factory.support.boxes import Point2

GAP = 2e-4
"""Between the pad of an arm and what it holds [m]."""

FLOOR = 0.02
"""Height of the bottom of a well above the floor [m]."""

BELOW = 0.005
"""Between the lowest place of a feeder's pad and the bottom of its well [m]."""


@dataclass(frozen=True, slots=True)
class Well:
    """A feeder in which a part rises.

    Attributes:
        place: of the product's middle when the part is shown (x, y) [m].
        elevation: of the part above its place in the product [m].
        feeder: its shape.
    """

    place: tuple[float, float]
    elevation: float
    feeder: Feeder


@dataclass(frozen=True, slots=True, eq=False)
class ToolGrip:
    """Where an arm's tool is on a part.

    Attributes:
        tip: of the tool, in the product's frame (3,) [m].
        yaw: angle of the tool about its own axis [rad].
        radius: of what its pad covers there [m].
        kind: of the tip: its pad holds by suction, or a pin in the pad's middle in a bore.
        normal: out of the face that it is on (3,).
    """

    tip: Array
    yaw: float
    radius: float
    kind: Literal["suction", "pin"] = "suction"
    normal: Array = field(default_factory=UP.copy)

    @property
    def turn(self) -> Array:
        """Orientation of the tool in the product's frame (3, 3), its z against the normal."""
        return facing(self.normal, self.yaw)

    def local(self, place: Array) -> Array:
        """A place of the product's frame in that of the tool's tip (3,) [m]."""
        return np.asarray(self.turn.T @ (place - self.tip))


def down(yaw: float) -> Array:
    """The orientation (3, 3) of a tool that points down, turned about the vertical [rad]: a half
    turn about the horizontal axis at half of that angle."""
    c, s = cos(yaw), sin(yaw)
    return np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])


def facing(normal: Array, yaw: float) -> Array:
    """The orientation (3, 3) of a tool on a face with a normal (3,), turned about that [rad]."""
    return np.asarray(facing_up(normal).T @ down(yaw))


@dataclass(eq=False)
class CellChains:
    """What a cell says of its arms to the layout (`factory.floor.layout.chains.Chains`).

    Attributes:
        factory: the factory.
        robots: the arms (index).
        model: the kind of the arms.
        stands: where each stands.
        wells: the feeder of each label.
        grips: of each label.
        curves: the legs.
        rows: by operation and robot, the leg.
        standoffs: by operation, how far short of its place an arm waits [m].
        private: by operation before which an arm waits nearer to its place than its feeder, how far
            short of that place [m].
        clear: by operation that takes a part, how far it goes until that part's feeder is
            clear [m].
    """

    factory: Factory
    robots: tuple[int, ...]
    model: ArmModel
    stands: Mapping[int, Stand]
    wells: Mapping[str, Well]
    grips: Mapping[str, ToolGrip]
    curves: LegTable
    rows: Mapping[tuple[int, int], int]
    standoffs: Mapping[int, float]
    clear: Mapping[int, float]
    private: Mapping[int, float] = field(default_factory=dict)
    timestep: float = 0.002

    @property
    def files(self) -> Mapping[str, bytes]:
        """The meshes of the arms by name."""
        return self.model.files

    @cached_property
    def sought(self) -> SoughtLegs:
        """The legs for one who does not know which an arm follows."""
        return SoughtLegs(
            [
                [self.curves.legs[n] for (_, arm), n in self.rows.items() if arm == robot]
                for robot in self.robots
            ]
        )

    def row(self, operation: int, robot: int) -> int:
        return self.rows[operation, robot]

    def feeder(self, label: str) -> Feeder:
        return self.wells[label].feeder

    def passing(self, operation: int) -> float:
        return self.clear[operation]

    def standoff(self, operation: int) -> float:
        return self.standoffs[operation]

    def waits(self, operation: int) -> float | None:
        return self.private.get(operation)

    def grip(self, robot: int, label: str, centre: Array) -> tuple[float, ...]:
        grip = self.grips[label]
        x, y, z = grip.local(np.asarray(centre)).tolist()
        turn = np.array([0.0, cos(grip.yaw / 2), sin(grip.yaw / 2), 0.0])
        if not grip.normal[2]:
            turn = product_of(turn, quaternion(facing_up(grip.normal)))
        return (x, y, z + STEM, *turn.tolist())

    def heading(self, label: str) -> Point2:
        x, y, _ = (-self.grips[label].normal + 0.0).tolist()
        return x, y

    def hand(self, label: str) -> Hand:
        grip = self.grips[label]
        x, y, z = map(float, grip.tip)
        return Hand.on_face(grip.normal, (x, y, z), grip.radius, grip.kind)

    def add(self, robot: int, section: Mapping[str, Element]) -> None:
        of = self.factory.robots[robot]
        root = standing(self.model, self.stands[robot])
        add(root, of.name, of.type, section)

    def drives(self, robot: int) -> Sequence[tuple[float, float, float]]:
        return self.model.gains


def well_of(
    solid: Solid, place: tuple[float, float], product: Product, show: float, clearance: float
) -> Well:
    """The feeder of a part that is shown with its bottom at a height.

    Args:
        solid: the part.
        place: of the part's middle in the world (x, y) [m].
        product: the product.
        show: height of its bottom [m].
        clearance: between the part and the rim, and the rim and others [m].
    """
    low, high, middle = solid.low, solid.high, product.middle
    half = (high - low)[:2] / 2
    at = (low + high)[:2] / 2
    tall = float(high[2] - low[2])
    room = clearance / 2
    stroke = room + Dimensions.RISE * hypot(2 * half[0], 2 * half[1]) + tall
    rim = show - room
    bottom = show - stroke - Dimensions.PAD - BELOW
    x, y = place[0] - at[0] + middle[0], place[1] - at[1] + middle[1]
    off = at - middle[:2]
    inside = (
        float(off[0] - half[0] - Dimensions.PLAY),
        float(off[0] + half[0] + Dimensions.PLAY),
        float(off[1] - half[1] - Dimensions.PLAY),
        float(off[1] + half[1] + Dimensions.PLAY),
    )
    box = (
        x + inside[0] - Dimensions.WALL,
        x + inside[1] + Dimensions.WALL,
        y + inside[2] - Dimensions.WALL,
        y + inside[3] + Dimensions.WALL,
    )
    elevation = show - (Dimensions.PAYLOAD + float(low[2] - product.low[2]))
    feeder = Feeder(0.0, 0.0, inside, box, box, box, max(bottom, FLOOR), rim, -stroke)
    return Well((float(x), float(y)), elevation, feeder)


def shown_height(solids: Sequence[Solid], clearance: float) -> float:
    """The height at which the bottoms of parts are shown, so that their wells stand on the floor
    [m]."""
    tallest = max(float(s.high[2] - s.low[2]) for s in solids)
    widest = max(hypot(*(s.high - s.low)[:2].tolist()) for s in solids)
    return FLOOR + BELOW + Dimensions.PAD + clearance / 2 + Dimensions.RISE * widest + tallest
