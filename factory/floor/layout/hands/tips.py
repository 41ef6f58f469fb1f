"""The tips of hands: a catalogue with a file in `mjcf/hands/` each, and the share of their strength
that a load uses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from factory.support.arrays import Array
from factory.support.errors import Diagnostic, InputError, Position
from factory.support.resources import mjcf_folder

TipName = Literal["suction", "pin"]
"""`suction`: a pad with bellows, which holds whatever has a surface. `pin`: a collar that a pin in
it, locked in a bore of the part, draws onto the surface."""

STRONG = 1.0
"""No more than this share of a tip's strength may be used."""

TWIST = 1.5
"""A round pad that slips about its middle bears as much as one that slips as a whole at 1/TWIST of
its radius."""


@dataclass(frozen=True, slots=True)
class Tip:
    """How strong a tip is: what presses its face onto the surface, `pull` [Pa], and the coefficient
    of `friction` there."""

    name: TipName
    pull: float
    friction: float

    def used(
        self, outward: Array, radius: Array, apart: Array, force: Array, moment: Array
    ) -> Array:
        """The share (n,) of the strength of a hand's tips that a load uses; above 1 it lets go. All
        but the load as `gauge`: `force` (n, 3) [N] and `moment` (n, 3) [Nm] about the middle of the
        tips."""
        load = np.concatenate(np.broadcast_arrays(force, moment), axis=-1)
        used = shares((self.gauge(outward, radius, apart) @ load[..., None])[..., 0])
        return np.maximum(used, 0.0)

    def alone(self, side: tuple[int, int], radius: Array, force: Array, moment: Array) -> Array:
        """As `used` (...,), for hands with one tip on a side of the payload, an axis and a way (+1,
        -1) along it; below 0 where the tip is pressed on. `radius` (...,), `force` and `moment`
        (3, ...)."""
        axis, way = side
        one, other = (a for a in range(3) if a != axis)
        bears = self.pull * np.pi * radius**2
        beside, bent = 1 / self.friction / bears, 2 / radius / bears
        turn = TWIST / radius / self.friction / bears
        slips = np.sqrt((beside * force[one]) ** 2 + (beside * force[other]) ** 2)
        slips = slips + np.abs(turn * moment[axis])
        bends = np.sqrt((bent * moment[one]) ** 2 + (bent * moment[other]) ** 2)
        return np.asarray(-way / bears * force[axis] + np.maximum(slips, bends))

    def gauge(self, outward: Array, radius: Array, apart: Array) -> Array:
        """What of a load uses the strength of a hand's tips, as matrices (n, 11, 6): from a force
        [N] and a moment [Nm] about the middle of the tips to the terms of `shares`.

        `outward` (n, 3) or (3,): from a tip's face to the payload; `radius` (n,) of a tip [m];
        `apart` (n, 3) or (3,): from one tip to the other [m], 0 where there is but one.

        A tip holds while the pressure left at its face bears friction, twist and the bending of its
        rim. Two share the load like the bolts of a plate: their distance bears the moments about
        all that is across it.
        """
        length = np.sqrt((apart**2).sum(axis=-1))
        two = length > 0
        count, lever = np.where(two, 2.0, 1.0), np.where(two, length, np.inf)
        along = apart / np.where(two, length, 1.0)[..., None]
        over = np.eye(3) - _squared(outward)
        bent = np.where(two[..., None, None], _squared(along) @ over, over)
        twist = (1 / lever + np.where(two, 0.0, TWIST / radius)) / self.friction
        force = outward / count[..., None], over / _deep(count * self.friction)
        moment = (
            twist[..., None] * outward,
            bent * _deep(2 / (count * radius)),
            (over - bent) / _deep(lever),
        )
        terms = np.zeros(
            (*np.broadcast_shapes(outward.shape[:-1], radius.shape, two.shape), TERMS, 6)
        )
        terms[..., OFF, :3], terms[..., BESIDE, :3] = force[0], force[1]
        terms[..., TURN, 3:], terms[..., BENT, 3:], terms[..., TILTED, 3:] = moment
        return np.asarray(terms / _deep(self.pull * np.pi * radius**2))


OFF, BESIDE, TURN, BENT, TILTED = 0, slice(1, 4), 4, slice(5, 8), slice(8, 11)
"""Where the terms of a load are: what pulls off, what pulls beside, what turns about the outward
direction, what bends rims, what tilts one tip against the other."""

TERMS = 11
"""Of so many numbers the terms of a load are."""


def shares(terms: Array) -> Array:
    """The share (n,) of the strength of hands' tips that loads of such terms (n, 11) use, below 0
    where tips are pressed on; above 1 a hand lets go. Pressure is lost to what pulls off and tilts,
    and to what slips or bends: rim and friction have it one as well as the other."""
    squares = terms * terms
    slips = _length(squares[..., BESIDE]) + np.abs(terms[..., TURN])
    bends, tilts = _length(squares[..., BENT]), _length(squares[..., TILTED])
    return np.asarray(terms[..., OFF] + tilts + np.maximum(slips, bends))


def _length(squares: Array) -> Array:
    """Length (n,) of vectors with such squares (n, 3)."""
    return np.asarray(np.sqrt(squares.sum(axis=-1)))


def _squared(direction: Array) -> Array:
    """The projection (n, 3, 3) onto a direction (n, 3)."""
    return np.asarray(direction[..., :, None] * direction[..., None, :])


def _deep(values: Array | float) -> Array:
    """Values (n,) broadcast to matrices (n, 3, 3)."""
    return np.asarray(values)[..., None, None]


@cache
def tip(name: TipName, folder: Path | None = None) -> Tip:
    """A tip of the catalogue. Raises InputError (BadTemplate) where its file does not say how
    strong it is."""
    path = (folder or mjcf_folder()) / "hands" / f"{name}.xml"
    try:
        numbers = {
            numeric.attrib["name"]: float(numeric.attrib["data"])
            for numeric in ElementTree.parse(path).getroot().iterfind("custom/numeric")
        }
        made = Tip(name, numbers["pull"], numbers["friction"])
        if not (made.pull > 0 and made.friction > 0):
            raise ValueError("pull and friction are positive")
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        message = f"the file of tips {name} is unusable: {error}"
        hint = "its custom section gives numerics 'pull' [Pa] and 'friction', like the shipped one"
        raise InputError(
            Diagnostic("BadTemplate", message, Position(str(path), 1, 1), hint)
        ) from error
    return made
