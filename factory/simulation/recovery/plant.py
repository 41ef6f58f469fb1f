"""What recovery asks of a world, and does to it: the interface of both worlds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Protocol

from factory.layout.layout import Layout
from factory.plant.factory import Operation
from factory.simulation.recovery.faults import WorldFault


class Plant(Protocol):
    """The bodies of a factory in which things go wrong.

    The first methods let faults strike, the next are what sensors tell, the last what is done about
    it. Robots are given by index.
    """

    def lose(self, robot: int) -> bool:
        """A robot's hand opens, and nothing tells; whether it held anything."""

    def slip(self, operation: Operation, metres: float) -> None:
        """The last input of an operation that has started slips in its hand."""

    @property
    def slipped(self) -> frozenset[int]:
        """The operations (index) under way whose inputs have slipped."""

    def fresh(self) -> Sequence[tuple[str, int]]:
        """The parts that feeders have begun to show since the last question: label and unit."""

    def spoil(self, label: str, fault: WorldFault) -> None:
        """What a feeder shows is askew or no good."""

    def supplied(self) -> None:
        """Some operation may have become prepared."""

    def tick(self) -> None:
        """A tick is over."""

    def lost(self) -> Sequence[int]:
        """The robots that no longer feel what they carry."""

    def knocked(self, robot: int) -> bool:
        """Whether something that fell has touched what a robot holds."""

    def feels(self, robots: Sequence[int]) -> bool:
        """Whether robots feel all that they carry, now."""

    def offers(self, label: str) -> bool:
        """Whether a feeder shows a part that has been looked at and found good."""

    def refused(self) -> Sequence[tuple[str, int, str]]:
        """Parts that a feeder's camera finds askew or no good: label, unit, the test that says so.
        They are taken back, and the next come."""

    def unseen(self) -> Sequence[str]:
        """The kinds of faults of parts that have been taken back, since the last question, for
        another reason, before any camera looked at them."""

    def residual(self, operation: Operation) -> float:
        """How far inputs are from where they belong when they are about to be joined, as measured
        [m]."""

    def rejects(self, robot: int) -> bool:
        """Whether an inspection rejects what a robot holds."""

    def undone(self, holds: Sequence[str], fired: Sequence[int], going: Set[int]) -> Sequence[int]:
        """From now on robots hold these labels by the books, NOPART for nothing, transitions have
        fired so often, and some robots are `going` back. Gives those that hold something that is
        scrap now."""

    def let_go(self, robot: int, seconds: float) -> None:
        """A robot lets scrap fall, which lies for so long [s]."""

    def throw_away(self, robot: int, label: str, seconds: float) -> None:
        """A robot at its B end lets go of a label that is scrap, over its bin, where that is wide
        enough; it lies for so long [s]."""

    def in_the_way(self, away: Set[int]) -> Set[int]:
        """The robots that stand where a part comes late that they wait for, but for those one of
        whose axes is to stay `away`."""

    def takes_back(self, robot: int) -> bool:
        """Whether something goes back up in a robot's feeder, and the robot is out of its way."""

    def came_back(self, robot: int) -> None:
        """A robot is where it waits."""

    @property
    def lying(self) -> Sequence[float]:
        """Until when [s] things lie about."""

    @property
    def closed(self) -> frozenset[int]:
        """The robots that could touch what lies about."""

    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        """A dead robot and what it holds are taken away, and another is put in its place, with its
        axes at these places [m]."""

    def clear_out(self, robot: int, layout: Layout) -> None:
        """A dead robot is taken away for good: what it holds is too, and what is shown where nobody
        takes it in a `layout` goes back."""

    def exchange(self, robot: int, layout: Layout) -> None:
        """A dead robot is gone, and the others go on as in a `layout`, where all have their
        numbers."""

    @property
    def binned(self) -> int:
        """How often scrap has fallen into a bin."""

    @property
    def spilled(self) -> Sequence[str]:
        """The robots, by name, that have let scrap fall where there is no bin for it."""

    @property
    def contacts(self) -> int:
        """Pairs of things that touched of which one had fallen, or lay askew."""
