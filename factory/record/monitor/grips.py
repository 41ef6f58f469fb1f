"""Who holds each copy of a part: by the welds that are active, and by where the part really is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.record.monitor.anatomy import GRIP, HOLD, Anatomy
from factory.record.monitor.frames import Frames
from factory.record.monitor.observation import Array, Index, Sight

HANGS = 2e-3
"""A part further than this from where its weld keeps it is not held [m], beyond twice the radius of
the goal balls in which robots hand over. The engine's welds yield by 0.03 mm, and hand-overs with a
gap above 1 mm are faults already."""

TURNS = 0.05
"""Nor is one that is turned by more than this [rad]."""

STRAIGHT = float(np.cos(TURNS / 2))
"""The least product of two quaternions that are no further apart."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A copy that is held by other welds than before, by number."""

    copy: int
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(slots=True)
class Hands:
    """The welds on each copy, kept from tick to tick. `radius`: the largest goal ball [m]."""

    anatomy: Anatomy
    radius: float
    held: list[tuple[int, ...]] = field(init=False, repr=False)
    _welds: Index | None = field(default=None, repr=False)
    _on: Index = field(init=False, repr=False)
    _copies: Index = field(init=False, repr=False)
    _owners: Index = field(init=False, repr=False)
    _at: Index = field(init=False, repr=False)
    _frames: Frames = field(init=False, repr=False)
    _off: set[int] = field(default_factory=set, repr=False)

    def __post_init__(self) -> None:
        self.held = [()] * len(self.anatomy.copies)
        self._owners = np.array([holder is not None for holder in self.anatomy.holder], bool)

    def switched(self, sight: Sight) -> list[Switch]:
        """The copies whose welds have changed since the sight before."""
        if sight.welds is self._welds:
            return []
        self._welds = sight.welds
        of_parts = sight.welds[self._owners[sight.welds[:, 0]]]
        copies = self.anatomy.copy_of[of_parts[:, 2]]
        order = np.argsort(copies, kind="stable")
        self._on, self._copies = of_parts[order, 0], copies[order]
        self._at = self.anatomy.body[self._copies][:, None] + np.arange(7)
        self._frames = self.anatomy.frames.of(self._on)
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

    def dropped(self, sight: Sight) -> list[tuple[int, int, float]]:
        """Copies that since the last sight have left the place where their weld keeps them: copy,
        weld, and how far off they are [m]."""
        pose = sight.qpos[self._at]
        apart = pose[:, :3] - self._frames.keep(sight.qpos)
        gap = np.einsum("ni,ni->n", apart, apart)
        along = np.abs(np.einsum("ni,ni->n", pose[:, 3:], self._frames.turn))
        limit = HANGS + 2 * self.radius
        if gap.max(initial=0.0) <= limit**2 and along.min(initial=1.0) >= STRAIGHT:
            self._off.clear()
            return []
        off = ~((gap <= limit**2) & (along >= STRAIGHT))
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
