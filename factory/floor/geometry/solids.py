"""Solids: parts with a shape, a place and mass properties, in the frame of the finished product."""

from __future__ import annotations

import colorsys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from factory.floor.geometry.meshes import LEAST_MASS, MassProperties, Mesh, sound
from factory.floor.geometry.pieces import MOST_PIECES, box_piece, cylinder_piece, sphere_piece
from factory.support.arrays import Array
from factory.support.errors import Diagnostic
from factory.support.keeping import Keeping
from factory.support.rotations import about_vertical, rotation, upright
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import Assembly

DENSITY = 1000.0
"""Density of a part that states neither mass nor density [kg/m³]."""

PALETTE = (
    (0.035, 0.58, 0.88),
    (0.560, 0.55, 0.66),
    (0.110, 0.42, 0.95),
    (0.420, 0.36, 0.68),
    (0.960, 0.42, 0.72),
    (0.600, 0.30, 0.86),
    (0.075, 0.62, 0.62),
    (0.760, 0.26, 0.58),
    (0.240, 0.42, 0.74),
    (0.500, 0.50, 0.56),
)
"""Hue, saturation and value of parts without a colour; further rounds shift the hue."""


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Solid:
    """A part as a solid. Arrays are in the frame of the finished product unless stated otherwise.

    Attributes:
        label: of the part.
        kind: box, cylinder, sphere or mesh.
        size: half lengths, as in MJCF [m].
        position: where it is [m] (3,).
        quaternion: how it is turned (4,), w first.
        mass: [kg].
        centre: of mass [m] (3,).
        inertia: about the centre of mass [kg m²] (3, 3).
        low: lower corner of its bounding box [m] (3,).
        high: upper corner [m] (3,).
        rgba: colour, from 0 to 1.
        mesh: its mesh, for the kind mesh.
        corners: points of the surface whose displacements bound that of the whole [m] (n, 3).
        pieces: vertices of the convex bodies that represent it in collisions [m] (n, 3) each; one
            body for most. `factory.floor.geometry.pieces` states how exactly.
        fed: angle about the vertical by which it is turned where it is presented [rad].
    """

    MOST_PIECES: ClassVar[int] = MOST_PIECES

    label: str
    kind: str
    size: tuple[float, ...]
    position: Array
    quaternion: Array
    mass: float
    centre: Array
    inertia: Array
    low: Array
    high: Array
    rgba: tuple[float, ...]
    mesh: Mesh | None = None
    corners: Array = field(default_factory=lambda: np.zeros((0, 3)), repr=False)
    pieces: tuple[Array, ...] = field(default=(), repr=False)
    fed: float = 0.0

    @staticmethod
    def colour_of(node: Assembly, number: int) -> tuple[float, ...]:
        """The colour of a part in the PAG, else one of a sequence in which neighbours differ."""
        rgba = node.parameter("rgba")
        if isinstance(rgba, tuple):
            return rgba
        round_, index = divmod(number, len(PALETTE))
        hue, saturation, value = PALETTE[index]
        red, green, blue = colorsys.hsv_to_rgb((hue + 0.045 * round_) % 1.0, saturation, value)
        return (round(red, 3), round(green, 3), round(blue, 3), 1.0)

    @property
    def axis(self) -> Array:
        """Where the axis about which a part turns stands (3,), at height 0 [m]."""
        x, y, _ = (self.low + self.high) / 2
        return np.array([x, y, 0.0])

    def presented(self) -> Solid:
        """A part as it is presented: turned about its axis by `fed`; itself where that is 0."""
        if not self.fed:
            return self
        turn, axis = about_vertical(self.fed), self.axis

        def moved(points: Array) -> Array:
            return np.asarray((points - axis) @ turn.T + axis)

        corners, pieces = moved(self.corners), tuple(map(moved, self.pieces))
        every = np.concatenate(pieces)
        w, x, y, z = self.quaternion
        c, _, _, s = upright(self.fed)
        return replace(
            self,
            position=moved(self.position),
            quaternion=np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w]),
            centre=moved(self.centre),
            inertia=turn @ self.inertia @ turn.T,
            low=every.min(axis=0),
            high=every.max(axis=0),
            corners=corners,
            pieces=pieces,
            fed=0.0,
        )


@dataclass(frozen=True)
class Product(Keeping):
    """The solids of a product, in the frame of the finished product.

    Attributes:
        solids: by the label of each part.
        low: lower corner of its bounding box [m] (3,).
        high: upper corner [m] (3,).
        warnings: what was found in its shapes.
        twin: a product with the same parts, and the turn (3, 3) from it, which brings axes onto
            axes: what was measured of one is not measured again.
        entered: the parts in whose holes and hollows others stand.
    """

    solids: Mapping[str, Solid]
    low: Array
    high: Array
    warnings: tuple[Diagnostic, ...] = ()
    twin: tuple[Product, Array] | None = field(default=None, compare=False, repr=False)
    entered: frozenset[str] = field(default=frozenset(), compare=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "solids", MappingProxyType(dict(self.solids)))

    def __reduce__(self) -> tuple[Any, ...]:
        return Product, (dict(self.solids), self.low, self.high, self.warnings)

    @property
    def middle(self) -> Array:
        """The centre of the bounding box (3,) [m]."""
        return (self.low + self.high) / 2

    @property
    def mass(self) -> float:
        """The total mass [kg]."""
        return float(sum(solid.mass for solid in self.solids.values()))

    def repeated(self, factory: Factory) -> Product:
        """The product with a solid for each part of a factory: those for further units of a period
        are alike. Itself where one unit is made at a time."""
        if factory.period == 1:
            return self
        further = {
            leaf.label: replace(self.solids[leaf.written], label=leaf.label)
            for leaf in factory.leaves
            if leaf.label not in self.solids
        }
        return replace(self, solids={**self.solids, **further})


def primitive(
    node: Assembly, kind: str, size: Array, place: Array, quaternion: Array, number: int
) -> Solid:
    """A box, cylinder or sphere as the solid of a part. `number` chooses its colour."""
    turn = rotation(quaternion)
    if kind == "box":
        x, y, z = 2 * size
        volume, diagonal = x * y * z, np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12
        corners = piece = box_piece(size)
        reach = np.abs(turn) @ size
    elif kind == "cylinder":
        radius, half = size
        side = (3 * radius**2 + (2 * half) ** 2) / 12
        volume, diagonal = np.pi * radius**2 * 2 * half, np.array([side, side, radius**2 / 2])
        corners, piece = box_piece(np.array([radius, radius, half])), cylinder_piece(radius, half)
        axis = np.abs(turn[:, 2])
        reach = half * axis + radius * np.sqrt(np.maximum(0.0, 1 - axis**2))
    else:
        radius = size[0]
        volume, diagonal = 4 / 3 * np.pi * radius**3, np.full(3, 0.4 * radius**2)
        corners, piece = np.concatenate([np.eye(3), -np.eye(3)]) * radius, sphere_piece(radius)
        reach = np.full(3, radius)
    mass = _mass(node, float(volume))
    return Solid(
        node.label,
        kind,
        tuple(float(s) for s in size),
        place,
        quaternion,
        mass,
        place,
        sound(turn @ np.diag(mass * diagonal) @ turn.T),
        place - reach,
        place + reach,
        Solid.colour_of(node, number),
        None,
        corners @ turn.T + place,
        (piece @ turn.T + place,),
        fed_angle(node),
    )


def from_mesh(
    node: Assembly, properties: MassProperties, place: Array, quaternion: Array, number: int
) -> Solid:
    """A mesh as the solid of a part."""
    turn = rotation(quaternion)
    mass = _mass(node, properties.volume)
    corners = properties.hull @ turn.T + place
    return Solid(
        node.label,
        "mesh",
        (),
        place,
        quaternion,
        mass,
        turn @ properties.centre + place,
        sound(turn @ (properties.inertia * mass / properties.volume) @ turn.T),
        corners.min(axis=0),
        corners.max(axis=0),
        Solid.colour_of(node, number),
        properties.mesh,
        corners,
        tuple(piece @ turn.T + place for piece in properties.mesh.pieces) or (corners,),
        fed_angle(node),
    )


def fed_angle(node: Assembly) -> float:
    """The angle about the vertical by which a part is presented turned [rad]."""
    angle = node.parameter("fed", 0.0)
    assert isinstance(angle, float)
    return angle


def _mass(node: Assembly, volume: float) -> float:
    mass = node.parameter("mass")
    if mass is None:
        mass = float(node.parameter("density", DENSITY)) * volume  # type: ignore[arg-type]
    return max(float(mass), LEAST_MASS)  # type: ignore[arg-type]
