"""The interface by which recovery observes and acts on a world: the same for both worlds."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence, Set

from factory.api import Operation
from factory.apps.deviations.condition import Breakable


class Plant(Breakable):
    """The bodies of a factory in which faults occur: the faults, sensors, responses.

    Robots are given by index. A world subclasses it and overrides what it can do; the defaults are
    those of a world in which nothing falls, leans or blocks.
    """

    @property
    @abstractmethod
    def slipped(self) -> frozenset[int]:
        """Operations (index) under way one of whose inputs has slipped."""

    @abstractmethod
    def fresh(self) -> Sequence[tuple[str, int]]:
        """Parts (label, unit) that feeders have begun to present since the last call."""

    @abstractmethod
    def supplied(self) -> None:
        """Note that an operation may have become prepared."""

    def tick(self) -> None:
        """Act at the end of a tick."""

    @abstractmethod
    def lost(self) -> Sequence[int]:
        """Robots whose grip sensors no longer report their payload."""

    def knocked(self, robot: int) -> bool:
        """Whether a robot's hand is closed and something that had fallen or slipped has touched its
        payload."""
        return False

    @abstractmethod
    def feels(self, robots: Sequence[int]) -> bool:
        """Whether the grip sensors of all these robots report their payloads."""

    @abstractmethod
    def offers(self, label: str) -> bool:
        """Whether a feeder presents a part that its camera has accepted."""

    @abstractmethod
    def refused(self) -> Sequence[tuple[str, int, str]]:
        """Parts (label, unit, failed test) that a feeder's camera rejects. Each is withdrawn, and
        the next one is presented."""

    def unseen(self) -> Sequence[str]:
        """Kinds of faults of parts that were withdrawn, since the last call, before a camera had
        examined them."""
        return ()

    @abstractmethod
    def residual(self, operation: Operation) -> float:
        """Measured distance of inputs from their places in a joint about to be made [m]."""

    def rejects(self, robot: int) -> bool:
        """Whether an inspection rejects a robot's payload."""
        return False

    @abstractmethod
    def undone(self, holds: Sequence[str], fired: Sequence[int], going: Set[int]) -> Sequence[int]:
        """Adopt the state after an undo: the label that each robot holds (NOPART for none), the
        firing counts of the transitions, and the robots that are `going` back. Returns the robots
        whose payload has become scrap."""

    def let_go(self, robot: int, seconds: float) -> None:
        """Drop a robot's scrap, which lies there for some time [s]."""

    def throw_away(self, robot: int, label: str, seconds: float) -> None:
        """Drop scrap with a label at the robot's B end, into its bin if that is wide enough; it
        lies there for some time [s]."""

    def in_the_way(self, away: Set[int]) -> Set[int]:
        """Robots that block the late part that they wait for, except those with an axis in
        `away`."""
        return frozenset()

    def takes_back(self, robot: int) -> bool:
        """Whether a part is being withdrawn into a robot's feeder, with the robot out of its
        way."""
        return False

    def came_back(self, robot: int) -> None:
        """Note that a robot has returned to where it waits."""

    @property
    def lying(self) -> Sequence[float]:
        """Times [s] at which the things that lie about are removed."""
        return ()

    @property
    def closed(self) -> frozenset[int]:
        """Robots that could touch something that lies about."""
        return frozenset()

    @abstractmethod
    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        """Replace a dead robot, payload removed, by another with its axes at these places [m]."""

    @property
    def binned(self) -> int:
        """Number of times scrap has fallen into a bin."""
        return 0

    @property
    def spilled(self) -> Sequence[str]:
        """Names of the robots that dropped scrap where there is no bin for it."""
        return ()

    @property
    def contacts(self) -> int:
        """Pairs of bodies that touched of which one had fallen or lay askew."""
        return 0
