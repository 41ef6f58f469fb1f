"""Deputies that take over in a run (few-robots.md, section 45): the net is exchanged under it."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, replace

from factory.compiler.taking_over import Takeover, present, with_moved
from factory.layout.layout import Layout
from factory.layout.scrapping import not_carried_back
from factory.layout.standby import deputies_in, part_of
from factory.modes.modes import operation_modes, robot_limits
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
    """A takeover, the `layout` of the crew that stays, in which robots keep their numbers, and that
    of these robots `alone`."""

    takeover: Takeover
    layout: Layout
    alone: Layout

    @property
    def stay(self) -> list[int]:
        """The robots that stay (index)."""
        return present(self.takeover.crew)

    @property
    def barred(self) -> frozenset[tuple[int, str]]:
        """The robots (index) with the labels that they cannot carry back to B."""
        return frozenset((self.stay[r], label) for r, label in not_carried_back(self.alone))


class Deputising:
    """`by_robot`: the deputies that are to take over, by the robots that are dead (indices);
    `exchanges`: those that have."""

    def __init__(self, simulation: Simulation, books: Books) -> None:
        self._simulation, self._books = simulation, books
        self.by_robot: dict[int, int] = {}
        self.exchanges: list[Exchange] = []

    def appoint(self, robot: int, dead: Container[int]) -> str:
        """A deputy is to take over for a robot (index): its name, "" where there is none, or it is
        among the `dead`."""
        deputy = deputies_in(self._simulation.layout).get(robot, -1)
        if deputy < 0 or self._change(robot, deputy, dead) is None:
            return ""
        self.by_robot[robot] = deputy
        return self._books.factory.robots[deputy].name

    def take_over(self, robot: int, dead: Container[int]) -> Successors | None:
        """What changes as the deputy of a robot takes over; None where it cannot any more."""
        return self._change(robot, self.by_robot.pop(robot), dead)

    def _change(self, robot: int, deputy: int, dead: Container[int]) -> Successors | None:
        books, factory = self._books, self._books.factory
        if deputy in dead or not factory.robots[deputy].operations:
            return None
        moved = {robot: deputy}
        takeover = Takeover(factory, with_moved(factory, moved), robot, moved)
        crew, every = takeover.crew, range(len(factory.robots))
        layout = part_of(books.layout, crew, every)
        alone = part_of(books.layout, takeover.after, present(crew))
        return Successors(takeover, layout, alone) if layout and alone else None

    def exchange(self, change: Successors, fired: tuple[int, ...], undone: Undone) -> None:
        """The run goes on in another net from the counts `fired`. The modes are those of the robots
        that stay."""
        simulation, alone, takeover = self._simulation, change.alone, change.takeover
        request, first = simulation.request, simulation.layout
        settings, stay = request.settings, change.stay
        lifts = (first.lifts.index(stay[robot]) for robot in alone.lifts)
        axes = [*stay, *(len(first.guidepaths) + lift for lift in lifts)]
        limits = robot_limits(first, settings, request.seed, request.jitter)[0].of(axes)
        modes = operation_modes(alone, settings.eps)
        stages = stages_of(alone, modes, settings)
        drawn = request.seed, request.jitter, request.wip, modes, limits
        timing = Timing(alone, settings, request.world, *drawn)
        predicted = timed(timing, wip=request.wip).cycle.seconds
        simulation.modes, simulation.delays = modes, timing.delays
        self._books.layout = change.layout
        own = [replace(s, robot=stay[s.robot], axis=axes[s.axis]) for s in stages]
        ordering = Ordering(
            replace(order, past=replace(order.past, axis=axes[order.past.axis]))
            for order in timing.coordinated.orders
            if order.past is not None
        )
        self._books.supervisor.exchange(takeover.crew, modes, own, undone, fired, ordering)
        names, net = takeover.names, takeover.after.net
        told = undone.t, *names, fired, net, takeover.crew, predicted
        self.exchanges.append(Exchange(*told))
