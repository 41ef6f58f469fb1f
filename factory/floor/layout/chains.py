"""Robots each of whose first axes moves several joints along curves in joint space.

A layout has one `Chains` for all of them, given by what lays them out; a layout of carriages on
rails has none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol
from xml.etree.ElementTree import Element

from factory.floor.layout.guidepath import Feeder
from factory.floor.layout.hands.hand import Hand
from factory.support.arrays import Array, Index
from factory.support.boxes import Point2


class JointCurves(Protocol):
    """Curves in a joint space of d dimensions, by rows. The coordinate of each is that of its
    robot's axis [m]."""

    @property
    def dimension(self) -> int:
        """d."""

    def at(self, rows: Index, x: Array) -> tuple[Array, Array, Array]:
        """Places, first and second derivatives (..., m, d) of the curves `rows` (m,) at coordinates
        (..., m) [m]."""

    def along(
        self, rows: Index, places: Array, velocities: Array, near: Array
    ) -> tuple[Array, Array]:
        """The coordinates (m,) of the points of the curves `rows` (m,) that are nearest to places
        (m, d), sought from `near` (m,) on, and the speeds (m,) along the curves of velocities
        (m, d)."""

    def force(
        self, rows: Index, motion: tuple[Array, Array, Array], mass: Array, load: Array
    ) -> Array:
        """The forces or torques (..., m, d) of the drives of the joints along the curves `rows`
        (m,): at coordinates (..., m), speeds and accelerations, of robots of these masses (m,)
        with these payloads (m,) [kg; N, N m]."""


class SoughtCurves(Protocol):
    """Curves in a joint space of d dimensions, of b robots of which it is not known where on their
    curves they are."""

    @property
    def dimension(self) -> int:
        """d."""

    def nearest(self, places: Array) -> tuple[Array, Array]:
        """The coordinates (b,) of the points of the robots' curves that are nearest to places
        (b, d), and first derivatives (b, d) there."""

    def apart(self, places: Array) -> Array:
        """Distances (b,) of places (b, d) from the robots' curves."""


class Chains(Protocol):
    """What a layout says of its robots whose first axes move several joints."""

    @property
    def robots(self) -> tuple[int, ...]:
        """The robots (index)."""

    @property
    def curves(self) -> JointCurves:
        """The curves of all of them."""

    @property
    def sought(self) -> SoughtCurves:
        """The same for one who does not know which of them each follows."""

    @property
    def files(self) -> Mapping[str, bytes]:
        """The mesh files of their bodies by name."""

    @property
    def timestep(self) -> float:
        """Longest timestep with which their drives follow them [s]."""

    def row(self, operation: int, robot: int) -> int:
        """The curve that a robot (index) follows in an operation (index) of its program."""

    def feeder(self, label: str) -> Feeder:
        """The feeder of a part that one of them takes."""

    def passing(self, operation: int) -> float:
        """How far a robot goes from the feeder of a part, which it takes in an operation (index),
        until it is clear of any part that comes there next [m]."""

    def standoff(self, operation: int) -> float:
        """How far short of its place a robot waits with what it brings to an operation (index)
        until the carrier stands [m]."""

    def waits(self, operation: int) -> float | None:
        """How far short of its place a robot goes by itself with what it brings, and waits until an
        operation (index) starts [m]; None where it waits where it took it."""

    def grip(self, robot: int, label: str, centre: Array) -> tuple[float, ...]:
        """The pose (7,) of a part with this centre of mass (3,), in the product, in the body that
        holds it: its place [m] and a quaternion."""

    def heading(self, label: str) -> Point2:
        """The direction, in the frame of the product, in which a tool that lies level faces what it
        holds."""

    def hand(self, label: str) -> Hand:
        """The tool that holds a part (label), with its pad where it is on the part."""

    def add(self, robot: int, section: Mapping[str, Element]) -> None:
        """Put the body of a robot, its joints where they are at the beginning, and what its file
        shares into the sections of a model. Names begin with the robot's; its outermost body is
        `NAME/carriage`, and what holds parts is `NAME/tool`."""

    def drives(self, robot: int) -> Sequence[tuple[float, float, float]]:
        """Gains and greatest force of the drive of each joint: kp, kv, force [N m/rad, N m s/rad,
        N m; N/m, N s/m, N]."""
