"""Takeovers during a run (few-robots.md, section 45): the net is exchanged while it runs."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

from factory.compiler.taking_over import Takeover
from factory.layout.layout import Layout
from factory.layout.scrapping import not_carried_back
from factory.layout.standby import deputies_in, part_of
from factory.modes.modes import operation_modes
from factory.modes.staging import stages_of
from factory.nets.undone import Undone
from factory.record.failures import Exchange
from factory.simulation.ordering import Ordering
from factory.simulation.recovery.books import Books
from factory.simulation.simulation import Simulation
from factory.timing.timed import timed
from factory.timing.timing import Timing


@dataclass(frozen=True, slots=True)
class Successors:
    """A takeover, and the `layout` of the remaining robots, which keep their numbers."""

    takeover: Takeover
    layout: Layout

    @property
    def barred(self) -> frozenset[tuple[int, str]]:
        """Pairs (robot index, label) that the robot cannot carry back to B."""
        return not_carried_back(self.layout)


class Deputising:
    """`by_robot`: for each dead robot (index) the deputy that will take over; `exchanges`: the
    takeovers made."""

    def __init__(self, simulation: Simulation, books: Books) -> None:
        self._simulation, self._books = simulation, books
        self.by_robot: dict[int, int] = {}
        self.exchanges: list[Exchange] = []

    def appoint(self, robot: int, dead: Container[int]) -> str:
        """Appoint the deputy of a robot (index). Returns its name, "" if there is none or it is
        among the `dead`."""
        deputy = deputies_in(self._simulation.layout).get(robot, -1)
        if deputy < 0 or self._change(robot, deputy, dead) is None:
            return ""
        self.by_robot[robot] = deputy
        return self._books.factory.robots[deputy].name

    def take_over(self, robot: int, dead: Container[int]) -> Successors | None:
        """The changes by which the deputy of a robot takes over; None if it no longer can."""
        return self._change(robot, self.by_robot.pop(robot), dead)

    def _change(self, robot: int, deputy: int, dead: Container[int]) -> Successors | None:
        books, factory = self._books, self._books.factory
        if deputy in dead or not factory.robots[deputy].operations:
            return None
        takeover = Takeover(factory, robot, deputy)
        layout = part_of(books.layout, takeover.crew)
        return Successors(takeover, layout) if layout else None

    def exchange(self, change: Successors, fired: tuple[int, ...], undone: Undone) -> None:
        """Continue the run in another net, from the firing counts `fired`."""
        simulation, layout, takeover = self._simulation, change.layout, change.takeover
        request, settings = simulation.request, simulation.request.settings
        modes = operation_modes(layout, settings.eps)
        stages = stages_of(layout, modes, settings)
        drawn = request.seed, request.jitter, request.wip, modes
        timing = Timing(layout, settings, request.world, *drawn)
        predicted = timed(timing, wip=request.wip).cycle.seconds
        simulation.modes, simulation.delays = modes, timing.delays
        self._books.layout = layout
        ordering = Ordering(order for order in timing.coordinated.orders if order.past is not None)
        self._books.supervisor.exchange(takeover.crew, modes, stages, undone, fired, ordering)
        names, net = takeover.names, takeover.after.net
        fields = undone.t, *names, fired, net, takeover.crew, predicted
        self.exchanges.append(Exchange(*fields))
