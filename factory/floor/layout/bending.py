"""Bend guidepaths: what brings a robot its inputs is moved as it is, the robot goes round.

A guidepath with bends ends where it ended, along its heading, and begins elsewhere along the same
heading. So the branch behind it is only moved; nothing turns, and all that meets still meets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from factory.floor.layout.branches import carriers
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import Bend
from factory.support.boxes import Point2


@dataclass(frozen=True, slots=True)
class Detour:
    """How the guidepath of a robot is bent.

    Attributes:
        travel: its new travel [m].
        bends: where it bends; nothing where it is straight.
        rounding: of its bends [m].
    """

    travel: float
    bends: tuple[Bend, ...] = ()
    rounding: float = 0.0

    @classmethod
    def across(cls, travel: float, at: float, across: float, rounding: float) -> Detour:
        """A detour with one bend: after a distance so far to the side [m]."""
        return cls(travel, (Bend(at, across),), rounding)

    @property
    def first(self) -> tuple[Bend, float] | None:
        """Its first bend, and the rounding [m]; None where it is straight."""
        return (self.bends[0], self.rounding) if self.bends else None

    def of(self, path: Guidepath) -> Guidepath:
        """A guidepath with this travel and these bends."""
        return replace(path, travel=self.travel, bends=self.bends, rounding=self.rounding)


def bent(layout: Layout, detours: Mapping[int, Detour]) -> Layout:
    """A layout in which the guidepaths of some robots (index) are bent; not certified. The output
    robot keeps its own, since the outfeed stands before it."""
    on, paths = carriers(layout.factory), list(layout.guidepaths)
    moved, longer = list[Point2](), list[float]()
    for robot, path in enumerate(layout.guidepaths):
        x, y = moved[on[robot]] if on[robot] >= 0 else (0.0, 0.0)
        a = round(path.a[0] + x, 3), round(path.a[1] + y, 3)
        paths[robot] = path = replace(path, a=a)
        if robot in detours:
            paths[robot] = detours[robot].of(path)
        begins, began = paths[robot].middle(paths[robot].length), path.middle(path.length)
        moved.append((x + begins[0] - began[0], y + begins[1] - began[1]))
        longer.append(paths[robot].length - path.length)
    operations = layout.factory.operations
    visits = {
        (number, robot): replace(visit, at=round(visit.at + longer[robot], 6))
        if robot and operations[number].carrier == robot
        else visit
        for (number, robot), visit in layout.visits.items()
    }
    return replace(layout, guidepaths=tuple(paths), visits=visits, certificate=None)
