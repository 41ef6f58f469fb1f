"""The holder of each copy of a part, from the active welds and from the position of the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np
from numpy.typing import NDArray

from factory.api import MonitorSubject, Observation, WeldFrames
from factory.apps.monitor.anatomy import GRIP, HOLD, Anatomy
from factory.support.arrays import Array, Index

HANGS = 2e-3
"""Distance from its place above which a part is not held [m], in addition to twice the radius of
the goal balls of hand-overs. The engine's welds yield by 0.03 mm, and a hand-over with a gap above
1 mm is a fault already."""

MISSED = 1e-4
"""Tolerance [m] as an operation ends: of a robot beyond its goal ball, and of a part beyond twice
the radius of those balls where its next holder takes it over."""

TWISTS = radians(0.5)
"""Angle to its weld above which a part is not held [rad]."""

TURNED = radians(0.1)
"""Tolerance of the angle of a part where its next holder takes it over, and of a weld to the
product [rad]. Correct runs stay below 1e-6."""

FIRST = np.zeros((1, 1), np.intp)
"""The index of the only observation."""

UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
"""Held parts have the axes of the product, which are those of the world."""


@dataclass(frozen=True, slots=True)
class Switch:
    """A copy with the numbers of the welds that held it before and hold it after."""

    copy: int
    before: tuple[int, ...]
    after: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Kept:
    """The active welds, by number, their copies, the addresses (n, 7) of those, and their
    frames."""

    welds: Index
    copies: Index
    at: Index
    frames: WeldFrames


class Grips:
    """The welds on each copy, `held[copy]`, updated from tick to tick. `radius`: largest goal ball
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
        """The copies whose welds have changed since the previous observation."""
        if seen.welds is self._welds:
            return []
        self._welds, self._kept, before = seen.welds, None, self._copy
        on = seen.welds[:, 0]
        now = np.full_like(before, -1)
        now[on] = np.where(self._of_parts[on], self.anatomy.copy_of[seen.welds[:, 2]], -1)
        self._copy = now
        changed = (now != before).nonzero()[0]
        welds = zip(*(x.tolist() for x in (changed, before[changed], now[changed])), strict=True)
        welds_of: dict[int, set[int]] = {}
        for weld, old, new in welds:
            if old >= 0:
                welds_of.setdefault(old, set(self.held[old])).discard(weld)
            if new >= 0:
                welds_of.setdefault(new, set(self.held[new])).add(weld)
        switches = []
        for copy in sorted(welds_of):
            after, held = tuple(sorted(welds_of[copy])), self.held[copy]
            if after != held:
                self.held[copy] = after
                switches.append(Switch(copy, held, after))
        return switches

    def take(self, seen: Observation, switches: Sequence[Switch]) -> int:
        """Store the copies that robots or the tray take over, before any force acts on them;
        returns the number of observations stored for `missed`."""
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
        """The copies that were not in the place of their weld as they were taken over: time [s],
        copy, weld, and distance [m]."""
        if not self._taken:
            return []
        looks, copies, welds = np.array(self._taken).T
        at, frames = self.anatomy.body[copies][:, None] + np.arange(7), self.anatomy.frames
        qpos = np.array([seen.qpos for seen in self._taking])
        gap, turned = _apart(qpos, looks[:, None], at, frames.chosen(welds), TURNED)
        rows = np.flatnonzero((gap > self.near) | turned).tolist()
        misses = [
            (self._taking[look].time, copy, weld, float(gap[row]))
            for row in rows
            for look, copy, weld in (self._taken[row],)
        ]
        self._taking.clear()
        self._taken.clear()
        return misses

    def dropped(self, seen: Observation) -> list[tuple[int, int, float]]:
        """The copies that have left the place of their weld since the last observation: copy, weld,
        and distance [m]."""
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
    """Distance [m] of bodies from the places of their welds, and whether they are turned by more
    than `most` [rad], NaN included; bodies by addresses (n, 7) in the states (k, nq) of the
    observations `look` (n, 1)."""
    pose = qpos[look, at]
    slides = qpos[look, frames.along]
    apart = pose[:, :3] - frames.at(slides)
    straight = _straight(pose[:, 3:], frames.turned(slides), most)
    return np.sqrt(np.einsum("ni,ni->n", apart, apart)), ~straight


def _straight(one: Array, other: Array, most: float) -> NDArray[np.bool_]:
    """Whether the angle between quaternions (n, 4) is at most `most` [rad]."""
    along = np.abs(np.einsum("ni,ni->n", one, np.broadcast_to(other, one.shape)))
    return np.asarray(along >= np.cos(most / 2))


def misplaced(
    anatomy: Anatomy, subject: MonitorSubject, places: dict[str, Array], tolerance: float = 1e-6
) -> list[int]:
    """The welds (by number) that turn a part, or hold it out of its place in the product relative
    to the other parts of the same holder, for a robot on the same tour. A part alone is turned by
    the angle at which it is presented, but where a fixed robot delivers it. At the end of a chain
    of joints a part is as the chain is."""
    factory, inside = subject.factory, subject.factory.contents
    first: dict[tuple[int, ...], tuple[Array, Array]] = {}
    wanted = np.tile(UPRIGHT, (len(anatomy.holder), 1))
    slides = np.zeros(anatomy.frames.along.shape)
    for weld, holder in enumerate(anatomy.holder):
        part = anatomy.part[weld]
        if holder is None or holder[0] != GRIP:
            continue
        if not factory.robots[holder[1]].travels:
            slides[weld, 0] = subject.gear_goals[holder[1]][-1]
        elif {part} in ({*inside[x]} for x in factory.deliveries(holder[1])):
            half = subject.fed(part) / 2
            wanted[weld] = np.cos(half), 0.0, 0.0, np.sin(half)
    wrong, straight = [], _straight(anatomy.frames.turned(slides), wanted, TURNED)
    for weld, holder in enumerate(anatomy.holder):
        if holder is None or holder[0] not in (GRIP, HOLD) or anatomy.frames.deep[weld]:
            continue
        base, place = anatomy.frames.base[weld], places[anatomy.part[weld]]
        tour = factory.tour_with(holder[1], anatomy.part[weld]) if holder[0] == GRIP else 0
        anchor, middle = first.setdefault((*holder, tour), (base, place))
        if not straight[weld] or np.abs((base - anchor) - (place - middle)).max() > tolerance:
            wrong.append(weld)
    return wrong
