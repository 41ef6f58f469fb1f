"""Where a pad holds what an arm brings: on top, or on the face that is behind as it comes to its
place from a side.

A place is sought in a frame in which the face is on top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from factory.api import Hand, Solid
from factory.apps.arms.body import PAD_RADIUS
from factory.apps.arms.chain import cross
from factory.apps.arms.dynamics import GRAVITY
from factory.floor.geometry.suction import PadPlace
from factory.support.arrays import Array
from factory.support.engine import mujoco

SHARES = 0.45, 0.35, 0.25
"""Radii of pads as shares of a part's least extent in plan that are tried."""

BESIDE = 0.002
"""Between a pad and what is higher beside it [m]."""

FAR = 0.1
"""What is farther from a tool is not in its way [m]."""

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """A pad on a part.

    Attributes:
        part: its label.
        normal: a unit vector out of the face (3,), in the product.
        pad: the pad's place in the product.
        clear: whether nothing is in the pad's way out of the face.
        room: radius of the largest tool that has room beside what is higher there [m].
    """

    part: str
    normal: Array
    pad: PadPlace
    clear: bool
    room: float

    def used(self, mass: float, centre: Array) -> float:
        """The share of a pad's strength that the weight of something needs, as it is held in the
        product.

        Args:
            mass: [kg].
            centre: of mass (3,) [m].
        """
        force = mass * GRAVITY
        moment = cross(centre - self.pad.at, force)
        radius = np.array(self.pad.radius)
        return float(Hand.tip_of("suction").used(-self.normal, radius, np.zeros(3), force, moment))


def facing_up(normal: Array) -> Array:
    """The turn (3, 3) that brings a face with a normal up or level onto the top."""
    x, y, z = normal.tolist()
    return np.eye(3) if z else np.array([[-y, x, 0.0], [0.0, 0.0, 1.0], [x, y, 0.0]])


def quaternion(turn: Array) -> Array:
    """The quaternion (4,) of a turn (3, 3)."""
    made = np.empty(4)
    mujoco.mju_mat2Quat(made, np.ascontiguousarray(turn).reshape(9))
    return made


def product_of(one: Array, other: Array) -> Array:
    """The quaternion (4,) of two turns, of which the `other` is the first."""
    made = np.empty(4)
    mujoco.mju_mulQuat(made, one, other)
    return made


def holds(
    solids: Sequence[Solid], there: Sequence[Solid], centre: Array, normal: Array
) -> list[Hold]:
    """The pads on a face of what an arm brings, one on each of its parts, the best first: those
    that nothing is in the way of; that are level; the largest; the nearest to the centre of mass.

    Args:
        solids: its parts.
        there: what it is placed onto.
        centre: of its mass (3,) [m].
        normal: of the face (3,).
    """
    turn = facing_up(normal)
    mine, others = ([_turned(one, turn) for one in each] for each in (solids, there))
    ranked = list[tuple[tuple[bool, bool, float, float], Hold]]()
    for solid in mine:
        over = [*others, *(one for one in mine if one is not solid)]
        pad, clear = _pad_on(solid, over)
        off = float(np.linalg.norm((pad.at - turn @ centre)[:2]))
        at = pad.at if turn[2, 2] else turn.T @ pad.at
        hold = Hold(solid.label, normal, replace(pad, at=at), clear, _room(pad, over))
        ranked.append(((not clear, not pad.level, -round(pad.radius, 4), off), hold))
    return [hold for _, hold in sorted(ranked, key=lambda one: one[0])]


def _turned(solid: Solid, turn: Array) -> Solid:
    """A part, turned."""
    if turn[2, 2]:
        return solid
    ends = np.stack([solid.low, solid.high]) @ turn.T
    return replace(
        solid,
        position=turn @ solid.position,
        quaternion=product_of(quaternion(turn), solid.quaternion),
        centre=turn @ solid.centre,
        low=ends.min(axis=0),
        high=ends.max(axis=0),
        corners=solid.corners @ turn.T,
        pieces=tuple(piece @ turn.T for piece in solid.pieces),
    )


def _pad_on(solid: Solid, others: Sequence[Solid]) -> tuple[PadPlace, bool]:
    """The largest pad on a part, beside what is higher there if there is room, and whether it is
    clear of that."""
    place = _largest_pad(solid)
    if _is_clear(place, others):
        return place, True
    boxes = [*_over(place.at[2], solid.low[:2], solid.high[:2], others)]
    if not boxes:
        return place, False
    taken = (
        np.min([low[:2] for low, _ in boxes], axis=0) - BESIDE,
        np.max([high[:2] for _, high in boxes], axis=0) + BESIDE,
    )
    beside = _largest_pad(solid, taken)
    return (beside, True) if _is_clear(beside, others) else (place, False)


def _largest_pad(solid: Solid, taken: tuple[Array, Array] | None = None) -> PadPlace:
    """The largest pad that a part is level under; one of the least share for none."""
    for share in SHARES:
        place = PadPlace.on(solid, (1.0, 0.0), taken, PAD_RADIUS, share)
        if place.level:
            break
    return place


def _is_clear(place: PadPlace, others: Sequence[Solid]) -> bool:
    """Whether no other part is above a pad."""
    reach, at = place.radius + BESIDE, place.at[:2]
    return not any(True for _ in _over(place.at[2], at - reach, at + reach, others))


def _room(place: PadPlace, others: Sequence[Solid]) -> float:
    """How far from the middle of a pad what is higher is, less what a tool keeps from it [m]."""
    at, away = place.at[:2], [np.inf]
    for low, high in _over(place.at[2], at - FAR, at + FAR, others):
        away.append(float(np.linalg.norm(np.clip(at, low[:2], high[:2]) - at)))
    return min(away) - BESIDE


def _over(
    height: float, low: Array, high: Array, others: Sequence[Solid]
) -> Iterator[tuple[Array, Array]]:
    """The boxes of pieces of parts that are higher over a rectangle [m]."""
    for solid in others:
        for piece in solid.pieces:
            least, most = piece.min(axis=0), piece.max(axis=0)
            if most[2] > height and (most[:2] > low).all() and (least[:2] < high).all():
                yield least, most
