"""Feeders: each presents the next part of its label, the n-th for unit n."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from factory.mjcf import names
from factory.mjcf.model import Model
from factory.mjcf.parts import presented_at
from factory.problem.pag import NOPART
from factory.simulation.mujoco.copies import Copies
from factory.simulation.mujoco.welds import Welds
from factory.simulation.request import RunRequest
from factory.support.engine import mujoco


class Feeders:
    """The feeders of a factory, for as many products as are requested beside those that have been
    `released` to the outfeed. `counts`: how often each transition has
    fired where the run starts.

    `welds` (by label): what holds the part that a feeder presents.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        model: Model,
        copies: Copies,
        welds: Welds,
        request: RunRequest,
        counts: Mapping[int, int],
    ) -> None:
        self._copies, self._welds = copies, welds
        leaves, tray = model.factory.leaves, len(model.factory.robots) + 1
        self.welds = {o.label: m.equality(names.feed(o.label)).id for o in leaves}
        self._code_at = {
            o.label: (tray + 1 + n, presented_at(model.layout, o.label))
            for n, o in enumerate(leaves)
        }
        self._next = {o.label: counts.get(o.end, 0) for o in leaves}
        self._begun = {o.label: counts.get(o.start, 0) for o in leaves}
        self.released = counts.get(model.factory.dropoff.end, 0)
        self._units, self._wip = self.released + request.units, request.wip
        self._shown: dict[str, int] = {}
        self._away: set[str] = set()
        self._refilled = _refilled(model)

    def grips(self) -> Iterator[tuple[int, int]]:
        """The welds that hold what is presented, each with the code of its feeder."""
        return ((weld, self._code_at[label][0]) for label, weld in self.welds.items())

    def presents(self, label: str, unit: int) -> bool:
        """Whether the feeder shows the part for that unit, and it may be let in."""
        allowed = self._wip is None or unit < self.released + self._wip
        return allowed and self._shown.get(label) == unit

    def feed(self, label: str) -> None:
        """Put the next copy into its empty feeder, if there is one to spare and a unit that needs
        it, and the robot has delivered the part it took last: until then it may still stand
        there."""
        unit = self._next[label]
        if label in self._away or label in self._shown or not self._copies.free[label]:
            return
        if unit >= max(self._units, self._begun[label]):
            return
        self._shown[label] = unit
        self._next[label] += 1
        body = self._copies.take(label, unit)
        code, at = self._code_at[label]
        self._welds.place(body, at)
        self._welds.hold([body], code)
        self._welds.join({self.welds[label]: body})

    def taken(self, label: str) -> None:
        """The robot has taken the part."""
        del self._shown[label]
        self._welds.loose([self.welds[label]])
        self._away.add(label)

    def away(self, label: str) -> None:
        """The robot is under way with a part where the run starts."""
        self._away.add(label)

    def retire(self, labels: Iterable[str], unit: int) -> None:
        """Put bodies of a unit out of sight, and parts into their feeders where those are empty."""
        for label in labels:
            self._copies.put_back(label, unit)
        for label in labels:
            if label in self.welds:
                self.feed(label)

    def refill(self, operation: int) -> None:
        """Feed what is fed again when an operation (index) has ended."""
        for label in self._refilled[operation]:
            self._away.discard(label)
            self.feed(label)


def _refilled(model: Model) -> list[list[str]]:
    """For each operation the labels that its end delivers from a feeder's robot."""
    fed = {o.carrier: o.label for o in model.factory.leaves}
    return [
        [fed[r] for r, k in zip(o.robots, o.after, strict=True) if r in fed and k == NOPART]
        for o in model.factory.operations
    ]
