"""What holds each copy of a part: by the welds that are active, and by where the part really is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.mjcf.weld_frames import GRIP, HOLD
from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.observation import Array, Index, Observation

HANGS = 2e-3
"""A part is not held where it is further than this from its place [m], beyond twice the radius of
the goal balls in which robots hand over. The engine's welds yield by 0.03 mm, and a hand-over with
a gap above 1 mm is a fault already."""

TURNS = 0.05
"""A part that is turned by more than this is not held either [rad]."""

STRAIGHT = float(np.cos(TURNS / 2))
"""The least product of two quaternions that are no further apart."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A copy that is held by other welds than before; all by number."""

    copy: int
    before: tuple[int, ...]
    after: tuple[int, ...]


class Grips:
    """The welds on each copy, kept from tick to tick: `held[copy]`. `radius`: the largest goal ball
    [m]."""

    def __init__(self, anatomy: Anatomy, radius: float) -> None:
        self.anatomy, self.limit = anatomy, HANGS + 2 * radius
        self.held: list[tuple[int, ...]] = [()] * len(anatomy.copies)
        self._of_parts = np.array([holder is not None for holder in anatomy.holder], bool)
        self._welds: Index | None = None
        self._off: set[int] = set()

    def switched(self, seen: Observation) -> list[Switch]:
        """The copies whose welds have changed since the observation before."""
        if seen.welds is self._welds:
            return []
        self._welds = seen.welds
        of_parts = seen.welds[self._of_parts[seen.welds[:, 0]]]
        copies = self.anatomy.copy_of[of_parts[:, 2]]
        order = np.argsort(copies, kind="stable")
        self._on, self._copies = of_parts[order, 0], copies[order]
        self._at = self.anatomy.body[self._copies][:, None] + np.arange(7)
        self._frames = self.anatomy.frames.chosen(self._on)
        now: dict[int, list[int]] = {}
        for copy, weld in zip(self._copies.tolist(), self._on.tolist(), strict=True):
            now.setdefault(copy, []).append(weld)
        found = []
        for copy, before in enumerate(self.held):
            after = tuple(now.get(copy, ()))
            if after != before:
                self.held[copy] = after
                found.append(Switch(copy, before, after))
        return found

    def dropped(self, seen: Observation) -> list[tuple[int, int, float]]:
        """Copies that since the last observation have left the place where their weld keeps them:
        copy, weld, and how far off they are [m]."""
        pose, frames = seen.qpos[self._at], self._frames
        apart = pose[:, :3] - frames.at(seen.qpos[frames.along])
        gap = np.einsum("ni,ni->n", apart, apart)
        along = np.abs(np.einsum("ni,ni->n", pose[:, 3:], frames.turn))
        if gap.max(initial=0.0) <= self.limit**2 and along.min(initial=1.0) >= STRAIGHT:
            self._off.clear()
            return []
        off = ~((gap <= self.limit**2) & (along >= STRAIGHT))
        rows = np.flatnonzero(off).tolist()
        fresh = [row for row in rows if int(self._copies[row]) not in self._off]
        self._off = {int(self._copies[row]) for row in rows}
        return [(int(self._copies[r]), int(self._on[r]), float(gap[r] ** 0.5)) for r in fresh]


def misplaced(anatomy: Anatomy, places: dict[str, Array], tolerance: float = 1e-6) -> list[int]:
    """The welds (by number) that do not keep a part in its place in the product, relative to the
    others that the same holder keeps."""
    first: dict[tuple[int, int], tuple[Array, Array]] = {}
    found = []
    for weld, holder in enumerate(anatomy.holder):
        if holder is None or holder[0] not in (GRIP, HOLD):
            continue
        base, place = anatomy.frames.base[weld], places[anatomy.part[weld]]
        anchor, middle = first.setdefault(holder, (base, place))
        if np.abs((base - anchor) - (place - middle)).max() > tolerance:
            found.append(weld)
    return found
