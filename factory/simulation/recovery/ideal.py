"""What goes wrong in the ideal world: the same faults, and sensors that are never wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from factory.layout.layout import Layout
from factory.plant.factory import Operation
from factory.problem.pag import NOPART
from factory.simulation.ideal import IdealWorld
from factory.simulation.recovery.books import Books
from factory.simulation.recovery.faults import WorldFault
from factory.simulation.simulation import Simulation


class IdealPlant:
    """Parts are where their robots are, or nowhere."""

    contacts, binned = 0, 0
    spilled: tuple[str, ...] = ()

    def __init__(self, simulation: Simulation, books: Books) -> None:
        self._simulation, self._books = simulation, books
        self._gone: set[int] = set()
        self._slipped: dict[int, float] = {}
        self._bad: dict[str, WorldFault] = {}
        self._shown: dict[str, int] = {}

    def lose(self, robot: int) -> bool:
        """A robot's hand opens, and nothing tells; whether it held anything."""
        if self._books.held()[robot] == NOPART or robot in self._gone:
            return False
        self._gone.add(robot)
        return True

    def slip(self, operation: Operation, metres: float) -> None:
        """The last input of an operation that has started slips in its hand."""
        self._slipped[operation.index] = metres

    @property
    def slipped(self) -> frozenset[int]:
        """The operations (index) under way whose inputs have slipped."""
        return frozenset(self._slipped)

    def fresh(self) -> Sequence[tuple[str, int]]:
        """The parts that feeders have begun to show since the last question: label and unit."""
        factory, fired = self._books.factory, self._books.supervisor.fired
        upcoming = self._books.supervisor.word.upcoming
        now = {o.label: upcoming(factory.unit(o, fired[o.end])) for o in factory.leaves}
        found = [part for part in now.items() if self._shown.get(part[0]) != part[1]]
        self._shown = now
        return found

    def spoil(self, label: str, fault: WorldFault) -> None:
        """What a feeder shows is askew or no good."""
        self._bad[label] = fault

    def supplied(self) -> None:
        """Some operation may have become prepared."""
        self._simulation.world.supplied = True

    def tick(self) -> None:
        """A tick is over."""

    def lost(self) -> Sequence[int]:
        """The robots that no longer feel what they carry."""
        if not self._gone:
            return ()
        holds = self._books.held()
        self._gone = {robot for robot in self._gone if holds[robot] != NOPART}
        return sorted(self._gone)

    def knocked(self, robot: int) -> bool:
        """Whether something that fell has touched what a robot holds."""
        return False

    def feels(self, robots: Sequence[int]) -> bool:
        """Whether robots feel all that they carry, now."""
        return self._gone.isdisjoint(robots)

    def offers(self, label: str) -> bool:
        """Whether a feeder shows a part that has been looked at and found good."""
        return label not in self._bad

    def refused(self) -> Sequence[tuple[str, int, str]]:
        """Parts that a feeder's camera finds askew or no good."""
        found = [
            (label, self._shown[label], "rejected" if fault.kind == "bad_part" else "misplaced")
            for label, fault in self._bad.items()
        ]
        for label in self._bad:
            del self._shown[label]
        self._bad.clear()
        return found

    def unseen(self) -> Sequence[str]:
        """What a feeder shows is looked at at once."""
        return ()

    def residual(self, operation: Operation) -> float:
        """How far inputs are from where they belong when they are about to be joined [m]."""
        return self._slipped.get(operation.index, 0.0)

    def rejects(self, robot: int) -> bool:
        """Nothing that is no good comes further than its feeder."""
        return False

    def undone(self, holds: Sequence[str], fired: Sequence[int], going: Set[int]) -> Sequence[int]:
        """The robots that hold something that is scrap now."""
        before, gone = self._books.held(), self._gone
        self._gone = set()
        operations = self._books.factory.operations
        under_way = {o.index for o in operations if fired[o.start] > fired[o.end]}
        self._slipped = {n: by for n, by in self._slipped.items() if n in under_way}
        changed = (r for r, label in enumerate(holds) if label == NOPART != before[r])
        return [robot for robot in changed if robot not in gone]

    def let_go(self, robot: int, seconds: float) -> None:
        """A robot lets scrap fall."""

    def throw_away(self, robot: int, label: str, seconds: float) -> None:
        """A robot lets scrap fall."""

    def in_the_way(self, away: Set[int]) -> Set[int]:
        """No robot is in the way of a part."""
        return frozenset()

    def takes_back(self, robot: int) -> bool:
        """Whether something goes back up in a robot's feeder."""
        return False

    def came_back(self, robot: int) -> None:
        """A robot is where it waits."""

    @property
    def lying(self) -> Sequence[float]:
        """Nothing lies about."""
        return ()

    @property
    def closed(self) -> frozenset[int]:
        """Nothing is in the way."""
        return frozenset()

    def clear_out(self, robot: int, layout: Layout) -> None:
        """A dead robot is taken away for good."""

    def exchange(self, robot: int, layout: Layout) -> None:
        """Feeders have no robots."""

    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        """A dead robot is taken away, and another is put in its place [m]."""
        world = self._simulation.world
        assert isinstance(world, IdealWorld)
        for axis, x in at.items():
            world.x[axis] = x
