"""Faults and sensors of the ideal world."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from factory.api import NOPART, Operation, Simulation
from factory.apps.deviations.deviation import Deviation
from factory.apps.recovery.books import RunState
from factory.apps.recovery.plant import Plant
from factory.engine.simulation.ideal import IdealWorld


class IdealPlant(Plant):
    """The faults of an ideal world: a part is where its robot is, or lost; sensors never err."""

    def __init__(self, simulation: Simulation, books: RunState) -> None:
        self._simulation, self._books = simulation, books
        self._gone: set[int] = set()
        self._slipped: dict[int, float] = {}
        self._bad: dict[str, Deviation] = {}
        self._shown: dict[str, int] = {}

    def lose(self, robot: int) -> bool:
        if self._books.held()[robot] == NOPART or robot in self._gone:
            return False
        self._gone.add(robot)
        return True

    def slip(self, operation: Operation, metres: float) -> None:
        self._slipped[operation.index] = metres

    @property
    def slipped(self) -> frozenset[int]:
        return frozenset(self._slipped)

    def fresh(self) -> Sequence[tuple[str, int]]:
        factory, fired = self._books.factory, self._books.supervisor.fired
        upcoming = self._books.supervisor.word.upcoming
        now = {o.label: upcoming(factory.unit(o, fired[o.end])) for o in factory.leaves}
        shown = [part for part in now.items() if self._shown.get(part[0]) != part[1]]
        self._shown = now
        return shown

    def spoil(self, label: str, fault: Deviation) -> None:
        self._bad[label] = fault

    def supplied(self) -> None:
        self._simulation.world.supplied = True

    def lost(self) -> Sequence[int]:
        if not self._gone:
            return ()
        holds = self._books.held()
        self._gone = {robot for robot in self._gone if holds[robot] != NOPART}
        return sorted(self._gone)

    def feels(self, robots: Sequence[int]) -> bool:
        return self._gone.isdisjoint(robots)

    def offers(self, label: str) -> bool:
        return label not in self._bad

    def refused(self) -> Sequence[tuple[str, int, str]]:
        faulty = [
            (label, self._shown[label], "rejected" if fault.kind == "bad_part" else "misplaced")
            for label, fault in self._bad.items()
        ]
        for label in self._bad:
            del self._shown[label]
        self._bad.clear()
        return faulty

    def residual(self, operation: Operation) -> float:
        return self._slipped.get(operation.index, 0.0)

    def undone(self, holds: Sequence[str], fired: Sequence[int], going: Set[int]) -> Sequence[int]:
        before, gone = self._books.held(), self._gone
        self._gone = set()
        operations = self._books.factory.operations
        under_way = {o.index for o in operations if fired[o.start] > fired[o.end]}
        self._slipped = {n: by for n, by in self._slipped.items() if n in under_way}
        changed = (r for r, label in enumerate(holds) if label == NOPART != before[r])
        return [robot for robot in changed if robot not in gone]

    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        world = self._simulation.world
        assert isinstance(world, IdealWorld)
        for axis, x in at.items():
            world.x[axis] = x
