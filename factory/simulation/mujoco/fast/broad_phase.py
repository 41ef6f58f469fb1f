"""Which bodies the engine's broad phase looks at: those of whoever is under way, and of all that
they may meet there.

The engine boxes every body that can collide in every step, and drops pairs of sleepers afterwards.
Most of a factory rests, far from what moves: it is left out of the broad phase until it moves
itself, or somebody goes by. Where they go is known; should anybody leave their way, or anything
touch, all is looked at until the next modes begin. No pair that could touch is left out, so a run
is the same to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import or_

import numpy as np

from factory.control.mode import Array, Index, Truth
from factory.simulation.mujoco.contacts import NOBODY, Contacts
from factory.simulation.mujoco.fast.swept_boxes import CELL, Reach
from factory.support.engine import mujoco

TIMES = 2.0
"""Nothing gains speed faster than so many times what the settings ask for, unless it touches
something or is pushed."""

FEW = 120
"""Where there are fewer holders, looking takes longer than it saves: up to some 60 robots."""

CALM = 0.1
"""What has touched is back in its place in the hand so long [s] after that."""

AWAKE = np.iinfo(np.int32).min
"""The engine has less than nought for who is awake, and more than this."""

SWAY = 1e-3
"""What is held is not further than this from its place in the hand [m], unless something
touches."""

KEPT = 500
"""So many views are kept: in steady production the same robots go the same ways again and again."""


def margin(accelerations: Array, period: float) -> Array:
    """How far [m] anything may have been off its way, further than is watched for, and have come
    back, while nobody looked for so long [s], where the settings ask for such accelerations [m/s²];
    and sway besides."""
    return np.asarray(np.maximum(TIMES * accelerations * period**2 / 8 - CELL, 0.0) + SWAY)


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """Whom some holders that go their ways may meet, and themselves (holders + 1,); and where those
    on slides are meanwhile: their addresses in `qpos`, between `low` and `high` [m]."""

    near: Truth
    watched: Index
    low: Array
    high: Array


class Vicinity:
    """The bodies that the broad phase of a model looks at: all, where there are few `holders`.

    `planned` tells, where it is needed, the reach of the holders, the number that it has for each
    robot (index) with what it carries, by label (what holders have at first has their own numbers),
    and the accelerations in the settings [m/s²], of each holder. `culls`: something may be left
    out. `stale`: it has to look before the engine's next step.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        contacts: Contacts,
        holders: int,
        planned: Callable[[], tuple[Reach, Mapping[tuple[int, str], int], Array]],
    ) -> None:
        self.m, self.d, self.contacts, self.holder = m, d, contacts, contacts.code
        self._everybody = np.ones(holders + 1, bool)
        self.culls, self._all = holders >= FEW, True
        self.stale = self._foreseen = False
        if not self.culls:
            return
        self.reach, self._loads, self._asked = planned()
        count, self._calm = holders + 1, -np.inf
        self._woken: list[int] = []
        self._goal = np.full(count, np.nan)
        self._ways = np.zeros((3, count), np.intp)
        self._ways[0] = np.arange(count)
        self._views: dict[bytes, _View] = {}
        self._view = _View(self._everybody, np.empty(0, np.intp), np.empty(0), np.empty(0))
        self._of_tree, self._asleep = _of_trees(m, self.holder), np.zeros_like(d.tree_asleep)

    def woken(self, bodies: Collection[int]) -> None:
        """Bodies are about to move."""
        if self.culls and bodies:
            self._woken += bodies
            self.stale = True

    def carries(self, robots: Sequence[int], labels: Sequence[str]) -> None:
        """Robots (index) have something else from now on, by its label."""
        if self.culls:
            loads = map(self._loads.__getitem__, zip(robots, labels, strict=True))
            self._ways[0, np.array(robots) + 1] = [*loads]

    def goes(self, holders: Index, x: Array, v: Array, places: Array) -> None:
        """From now on holders go to `places` on their slides [m], from x at speed v, and straight;
        they may have to stop first. Who has not been told otherwise goes on."""
        if not self.culls:
            return
        new = (places != self._goal[holders]) | (places == x)
        if not np.count_nonzero(new):
            return
        holders, x, v, places = holders[new], x[new], v[new], places[new]
        self._goal[holders] = places
        self._foreseen = self.stale = True
        low, high = np.minimum(x, places), np.maximum(x, places)
        if np.count_nonzero(v):
            stop = x + v * np.abs(v) / (2 * self._asked[holders])
            low, high = np.minimum(low, stop), np.maximum(high, stop)
        self._ways[1, holders], self._ways[2, holders] = low // CELL - 1, high // CELL + 2

    def astray(self) -> None:
        """From now on nobody knows who goes where."""
        if self.culls:
            self._foreseen, self.stale = False, True

    def holds(self) -> bool:
        """Whether everybody that moves is where that was foreseen, if it was."""
        if self._all:
            return True
        view = self._view
        x = self.d.qpos.take(view.watched)
        return not np.count_nonzero((x < view.low) | (x > view.high))

    def notice(self) -> None:
        """It is stale where something touches, or the engine has woken something by itself."""
        touches = self.d.ncon > 0
        if touches and self.culls:
            self._calm = self.d.time + CALM
        if not self._all and (touches or np.count_nonzero(self.d.tree_asleep < self._asleep)):
            self.stale = True

    def everything(self) -> None:
        """From now on nothing is left out: somebody pushes."""
        self.culls = self.stale = False
        self._all = True
        self._show(self._everybody)

    def look(self) -> None:
        """Choose what the broad phase looks at."""
        before, self._all = self._all, not self._foreseen or self.d.time < self._calm
        if not self._all:
            self._view = self._seen()
            self._show(self._view.near)
            if self.reach.beyond:
                self.everything()
        elif not before:
            self._show(self._everybody)
        self._woken.clear()
        self.stale = False

    def _seen(self) -> _View:
        """What is to be seen of all that move."""
        awake, moves = self.d.tree_asleep < 0, np.zeros_like(self._everybody)
        if self._woken:
            self._wake(awake, self.m.body_treeid[self._woken])
        moves[self.holder[self._of_tree[awake]]] = True
        moves[NOBODY] = False
        np.multiply(awake, AWAKE, out=self._asleep, dtype=np.int32)
        ways = self._ways[:, moves]
        key = moves.tobytes() + ways.tobytes()
        view = self._views.get(key)
        if view is None:
            if len(self._views) == KEPT:
                self._views.clear()
            self._views[key] = view = self._viewed(moves, ways)
        return view

    def _viewed(self, moves: Truth, ways: Index) -> _View:
        """What is to be seen of those that move (holders + 1,), each with a load between two places
        (3, n)."""
        bits = reduce(or_, map(self.reach.met.__getitem__, zip(*ways.tolist(), strict=True)), 0)
        packed = np.frombuffer(bits.to_bytes(len(moves) // 8 + 1, "little"), np.uint8)
        meets = np.unpackbits(packed, count=len(moves), bitorder="little")
        address = self.reach.address[moves]
        on = address >= 0
        low, high = ways[1:, on] * CELL
        return _View(moves | meets.view(bool), address[on], low, high)

    def _wake(self, awake: Truth, trees: Index) -> None:
        """Trees are `awake` from now on (ntree,), and those that the engine wakes with them: that
        fell asleep together, each with the number of the next."""
        while len(trees):
            awake[trees] = True
            trees = self.d.tree_asleep[trees]
            trees = trees[trees >= 0]
            trees = trees[~awake[trees]]

    def _show(self, near: np.ndarray) -> None:
        seen = near[self.holder]
        np.multiply(self.contacts.contype, seen, out=self.m.body_contype)
        np.multiply(self.contacts.conaffinity, seen, out=self.m.body_conaffinity)


def _of_trees(m: mujoco.MjModel, holder: Index) -> Index:
    """A body of each tree (ntree,) that says whose it is."""
    trees, first = np.unique(m.body_treeid, return_index=True)
    found = first[trees >= 0]
    (own,) = ((holder != NOBODY) & (m.body_treeid >= 0)).nonzero()
    found[m.body_treeid[own]] = own
    return np.asarray(found)
