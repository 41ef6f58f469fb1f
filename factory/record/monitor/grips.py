"""What holds each copy of a part: by the welds that are active, and by where the part really is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from factory.mjcf.weld_frames import GRIP, HOLD, WeldFrames
from factory.plant.factory import Factory
from factory.record.monitor.anatomy import Anatomy
from factory.record.monitor.observation import Array, Index, Observation

HANGS = 2e-3
"""A part is not held where it is further than this from its place [m], beyond twice the radius of
the goal balls in which robots hand over. The engine's welds yield by 0.03 mm, and a hand-over with
a gap above 1 mm is a fault already."""

MISSED = 1e-4
"""As an operation ends, a robot is not at its goal that is further than this beyond its goal ball
[m]; nor is a part where its next holder takes it over that is further than this beyond twice the
radius of those balls."""

TWISTS = radians(0.5)
"""A part that is turned by more than this against its weld is not held either [rad]."""

TURNED = radians(0.1)
"""Nor is one where it should be, where its next holder takes it over, that is turned by more than
this; nor does a weld put a part in its place that does [rad]. Honest runs stay below 1e-6."""

FIRST = np.zeros((1, 1), np.intp)
"""The only one of several looks."""

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
"""All that is held has the axes of the product, which are those of the world."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A copy that is held by other welds than before; all by number."""

    copy: int
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Kept:
    """The welds that are active, by number, the copies they hold, the addresses (n, 7) of those,
    and where they are kept."""

    welds: Index
    copies: Index
    at: Index
    frames: WeldFrames


class Grips:
    """The welds on each copy, kept from tick to tick: `held[copy]`. `radius`: the largest goal ball
    [m]."""

    def __init__(self, anatomy: Anatomy, radius: float) -> None:
        self.anatomy, self.limit, self.near = anatomy, HANGS + 2 * radius, MISSED + 2 * radius
        self.held: list[tuple[int, ...]] = [()] * len(anatomy.copies)
        self._of_parts = np.array([holder is not None for holder in anatomy.holder], bool)
        self._copy = np.full(len(anatomy.holder), -1, np.intp)
        self._welds: Index | None = None
        self._kept: _Kept | None = None
        self._off: set[int] = set()
        self._taking: list[Observation] = []
        self._taken: list[tuple[int, int, int]] = []

    def switched(self, seen: Observation) -> list[Switch]:
        """The copies whose welds have changed since the observation before."""
        if seen.welds is self._welds:
            return []
        self._welds, self._kept, before = seen.welds, None, self._copy
        on = seen.welds[:, 0]
        now = np.full_like(before, -1)
        now[on] = np.where(self._of_parts[on], self.anatomy.copy_of[seen.welds[:, 2]], -1)
        self._copy = now
        changed = (now != before).nonzero()[0]
        welds = zip(*(x.tolist() for x in (changed, before[changed], now[changed])), strict=True)
        found: dict[int, set[int]] = {}
        for weld, old, new in welds:
            if old >= 0:
                found.setdefault(old, set(self.held[old])).discard(weld)
            if new >= 0:
                found.setdefault(new, set(self.held[new])).add(weld)
        switches = []
        for copy in sorted(found):
            after, held = tuple(sorted(found[copy])), self.held[copy]
            if after != held:
                self.held[copy] = after
                switches.append(Switch(copy, held, after))
        return switches

    def take(self, seen: Observation, switches: Sequence[Switch]) -> int:
        """Robots or the tray take copies over, and nothing has pulled at them yet; gives how many
        observations of that wait for `missed`."""
        holder = self.anatomy.holder
        taken = [
            (len(self._taking), switch.copy, weld)
            for switch in switches
            for weld in switch.after
            if weld not in switch.before and (held := holder[weld]) and held[0] in (GRIP, HOLD)
        ]
        if taken:
            self._taking.append(seen)
            self._taken += taken
        return len(self._taking)

    def missed(self) -> list[tuple[float, int, int, float]]:
        """Of the copies that were taken over those that were not where their weld keeps them: when
        [s], copy, weld, and how far off they were [m]."""
        if not self._taken:
            return []
        looks, copies, welds = np.array(self._taken).T
        at, frames = self.anatomy.body[copies][:, None] + np.arange(7), self.anatomy.frames
        qpos = np.array([seen.qpos for seen in self._taking])
        gap, turned = _apart(qpos, looks[:, None], at, frames.chosen(welds), TURNED)
        rows = np.flatnonzero((gap > self.near) | turned).tolist()
        found = [
            (self._taking[look].time, copy, weld, float(gap[row]))
            for row in rows
            for look, copy, weld in (self._taken[row],)
        ]
        self._taking.clear()
        self._taken.clear()
        return found

    def dropped(self, seen: Observation) -> list[tuple[int, int, float]]:
        """Copies that since the last observation have left the place where their weld keeps them:
        copy, weld, and how far off they are [m]."""
        if self._kept is None:
            on = (self._copy >= 0).nonzero()[0]
            copies = self._copy[on]
            at = self.anatomy.body[copies][:, None] + np.arange(7)
            self._kept = _Kept(on, copies, at, self.anatomy.frames.chosen(on))
        kept = self._kept
        gap, turned = _apart(seen.qpos[None], FIRST, kept.at, kept.frames, TWISTS)
        rows = np.flatnonzero((gap > self.limit) | turned).tolist()
        if not rows:
            self._off.clear()
            return []
        fresh = [row for row in rows if int(kept.copies[row]) not in self._off]
        self._off = {int(kept.copies[row]) for row in rows}
        return [(int(kept.copies[r]), int(kept.welds[r]), float(gap[r])) for r in fresh]


def _apart(
    qpos: Array, look: Index, at: Index, frames: WeldFrames, most: float
) -> tuple[Array, NDArray[np.bool_]]:
    """How far bodies, at these addresses (n, 7) in the states (k, nq) of looks (n, 1), are from
    where welds keep them [m], and whether they are turned by more than a `most` [rad]; bodies that
    are nowhere are."""
    pose = qpos[look, at]
    apart = pose[:, :3] - frames.at(qpos[look, frames.along])
    straight = _straight(pose[:, 3:], frames.turn, most)
    return np.sqrt(np.einsum("ni,ni->n", apart, apart)), ~straight


def _straight(one: Array, other: Array, most: float) -> NDArray[np.bool_]:
    """Whether quaternions (n, 4) are apart by no more than an angle [rad]."""
    along = np.abs(np.einsum("ni,ni->n", one, np.broadcast_to(other, one.shape)))
    return np.asarray(along >= np.cos(most / 2))


def misplaced(
    anatomy: Anatomy, factory: Factory, places: dict[str, Array], tolerance: float = 1e-6
) -> list[int]:
    """The welds (by number) that turn a part, or do not keep it in its place in the product,
    relative to the others that the same holder keeps, a robot on one tour. Those by which robots
    hold nothing in this factory, but may as deputies, are left out."""
    first: dict[tuple[int, ...], tuple[Array, Array]] = {}
    inside, robots = factory.contents, range(len(factory.robots))
    brought = [{part for x in factory.deliveries(r) for part in inside[x]} for r in robots]
    found, straight = [], _straight(anatomy.frames.turn, UPRIGHT, TURNED)
    for weld, holder in enumerate(anatomy.holder):
        if holder is None or holder[0] not in (GRIP, HOLD):
            continue
        if holder[0] == GRIP and not _brings(brought, holder[1], inside[anatomy.part[weld]]):
            continue
        base, place = anatomy.frames.base[weld], places[anatomy.part[weld]]
        tour = factory.tour_with(holder[1], anatomy.part[weld]) if holder[0] == GRIP else 0
        anchor, middle = first.setdefault((*holder, tour), (base, place))
        if not straight[weld] or np.abs((base - anchor) - (place - middle)).max() > tolerance:
            found.append(weld)
    return found


def _brings(brought: Sequence[set[str]], robot: int, parts: Iterable[str]) -> bool:
    """Whether a robot, -1 for one that is gone, ever brings parts."""
    return robot >= 0 and brought[robot].issuperset(parts)
