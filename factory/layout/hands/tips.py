"""What a hand holds with: the tips of the catalogue, a file in `mjcf/hands/` each, and how much of
their strength a load uses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from factory.geometry.meshes import Array
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
        """The share (n,) of the strength of a hand's tips that a load uses; above 1 it lets go.

        `outward` (n, 3) or (3,): from a tip's face to the payload; `radius` (n,) of a tip [m];
        `apart` (n, 3) or (3,): from one tip to the other [m], 0 where there is but one; `force`
        (n, 3) [N] and `moment` (n, 3) [Nm] of the load, about the middle of the tips.

        A tip holds while the pressure left at its face bears friction, twist and the bending of its
        rim. Two share the load like the bolts of a plate: their distance bears the moments about
        all that is across it.
        """
        length = np.sqrt((apart**2).sum(axis=-1))
        two = length > 0
        count, lever = np.where(two, 2.0, 1.0), np.where(two, length, np.inf)
        along = apart / np.where(two, length, 1.0)[..., None]
        off = (force * outward).sum(axis=-1)
        beside = force - off[..., None] * outward
        turn = (moment * outward).sum(axis=-1)
        over = moment - turn[..., None] * outward
        rolled = (over * along).sum(axis=-1)[..., None] * along
        bent = np.where(two[..., None], rolled, over)
        tilted = np.sqrt(((over - bent) ** 2).sum(axis=-1)) / lever
        slips = np.sqrt((beside**2).sum(axis=-1)) / count + np.abs(turn) / lever
        slips += np.where(two, 0.0, TWIST * np.abs(turn) / radius)
        bends = 2 * np.sqrt((bent**2).sum(axis=-1)) / (count * radius)
        needed = off / count + tilted + np.maximum(slips / self.friction, bends)
        return np.asarray(np.maximum(needed, 0.0) / (self.pull * np.pi * radius**2))


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
        found = Tip(name, numbers["pull"], numbers["friction"])
        if not (found.pull > 0 and found.friction > 0):
            raise ValueError("pull and friction are positive")
    except (OSError, ElementTree.ParseError, KeyError, ValueError) as error:
        message = f"the file of tips {name} is unusable: {error}"
        hint = "its custom section gives numerics 'pull' [Pa] and 'friction', like the shipped one"
        raise InputError(
            Diagnostic("BadTemplate", message, Position(str(path), 1, 1), hint)
        ) from error
    return found
