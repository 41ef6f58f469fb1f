"""What a simulation asks of whatever supervises its robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from factory.engine.record.state import Event
from factory.engine.simulation.ordering import Ordering
from factory.engine.timing.distributed import Scan
from factory.theory.control.mode import Limits
from factory.theory.nets.undone import Undone
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation


class RunSupervisor(Protocol):
    """What decides in a run when operations start and end: one supervisor, the robots' own
    programs, or a controller outside.

    Attributes:
        factory: the factory as it is now.
        events: the record so far.
        marked: 1 for each place that the record marks, 0 for the others.
        under_way: the operations (index) under way.
        ordering: the order places that it keeps.
        scans: when each robot ticks, where each does so by itself.
    """

    @property
    def factory(self) -> Factory: ...
    @property
    def events(self) -> list[Event] | list[Event | Undone]: ...
    @property
    def marked(self) -> bytearray: ...
    @property
    def under_way(self) -> tuple[int, ...]: ...
    @property
    def ordering(self) -> Ordering: ...
    @property
    def scans(self) -> Sequence[Scan]: ...

    def awaited(self) -> list[Operation]:
        """The operations all of whose robots wait for them."""

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""

    def step(self, ticks: int = 1) -> None:
        """Advance the world by a tick, or by up to `ticks` if nothing can fire in between."""

    def coast(self, ticks: int = 1) -> None:
        """Advance the world without firing anything."""
