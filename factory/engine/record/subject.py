"""The data that a monitor has before the run: the net and the goals of its operations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any

from factory.engine.record.history import firings
from factory.engine.record.state import Recordable
from factory.engine.timing.demand import Word
from factory.engine.timing.pool import with_wip
from factory.floor.geometry.fused_bodies import FusedBodies, bodies_of
from factory.floor.layout.chains import Chains, SoughtCurves
from factory.floor.layout.exclusions import goes_early
from factory.floor.layout.layout import Layout
from factory.floor.layout.way import BendRows, BentWay, Ways, kept_in, rows_of
from factory.support.settings import Settings
from factory.support.tables import table_of
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation

PATIENCE = 4.0
"""A run stalls when nothing happens for this many times the longest time of an operation."""


@dataclass(frozen=True)
class MonitorSubject:
    """The factory that a monitor observes: what it has before the run.

    Attributes:
        factory: the factory, with its net.
        goals: arc length of the goal of each robot, for each operation [m].
        radii: radius of the goal ball of each operation [m].
        places: by label, the centre of mass of a part, or of a sub-assembly that is one body, in
            the frame of the product [m].
        settings: the settings of the run.
        start: the marking in which the run begins.
        patience: time without an event until a run counts as stalled [s].
        wip: most units inside at once; None for any number.
        early: (operation, robot) where a robot goes ahead regardless of the settings, so that its
            hand is out of the way.
        ways: by robot (index), the bends of its guidepath and their rounding [m].
        chains: the robots whose first axes move several joints; None where there are none.
        word: the units that are made; None for all.
    """

    factory: Factory
    goals: tuple[tuple[float, ...], ...] = field(repr=False)
    radii: tuple[float, ...] = field(repr=False)
    places: Mapping[str, tuple[float, float, float]] = field(repr=False)
    settings: Settings
    start: Marking
    patience: float
    wip: int | None = None
    early: frozenset[tuple[int, int]] = frozenset()
    ways: Mapping[int, BentWay] = field(default_factory=dict, repr=False)
    word: Word | None = None
    chains: Chains | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("places", "ways"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @classmethod
    def of(
        cls,
        layout: Layout,
        settings: Settings,
        jitter: float = 0.0,
        start: Marking | None = None,
        wip: int | None = None,
        bodies: FusedBodies | None = None,
    ) -> MonitorSubject:
        """The subject of a layout, run with these settings from a marking (m_0 where None). Each
        part is one body unless other `bodies` are given."""
        factory, product = layout.factory, layout.product
        goals = tuple(
            tuple(layout.visits[o.index, robot].at for robot in o.robots)
            for o in factory.operations
        )
        radii = tuple(
            eps if isinstance(eps := o.template.law.eps, float) else settings.eps
            for o in factory.operations
        )
        centres = (bodies or bodies_of(factory, product)).centre
        places = {label: (float(c[0]), float(c[1]), float(c[2])) for label, c in centres.items()}
        slowest = settings.speed * (1 - jitter)
        longest = max(path.length for path in layout.guidepaths)
        travel = longest / slowest + slowest / settings.acceleration
        travel += (4 * longest / settings.acceleration) ** 0.5
        travel += layout.outfeed_way / settings.outfeed + max(o.dwell for o in factory.operations)
        marking = factory.net.initial_marking if start is None else start
        patience, early = round(PATIENCE * travel, 6), frozenset(goes_early(layout))
        subject = cls(factory, goals, radii, places, settings, marking, patience, wip, early)
        ways = {robot: path.way for robot, path in enumerate(layout.guidepaths) if path.way}
        return replace(subject, ways=ways, chains=layout.chains)

    @classmethod
    def of_run(cls, simulation: Recordable) -> MonitorSubject:
        """The subject of a simulation, in either world."""
        model, demanded = simulation.model, simulation.request.demand is not None
        subject = cls.of(
            simulation.layout,
            simulation.request.settings,
            simulation.request.jitter,
            simulation.start,
            None if demanded else simulation.request.wip,
            model.carried if model else None,
        )
        return replace(subject, word=simulation.word) if demanded else subject

    @cached_property
    def bent(self) -> tuple[tuple[int, ...], SoughtCurves]:
        """The robots (index) whose first axes move several joints, and the curves along which they
        do: of chains, or else of guidepaths with bends."""
        if self.chains is not None:
            return self.chains.robots, self.chains.sought
        return (*self.ways,), Ways.bent(self.ways.values())

    @property
    def net(self) -> MarkedNet:
        """The net with its initial tokens, which also bounds the units inside if they are
        bounded."""
        if self.wip is None:
            return MarkedNet.of(self.factory.net)
        return with_wip(self.factory, self.wip)

    @cached_property
    def counts(self) -> Mapping[int, int]:
        """Number of firings of each transition at the start of the run."""
        return MappingProxyType(firings(self.factory.net, self.start))

    def is_made(self, operation: Operation, period: int) -> bool:
        """Whether the unit of an operation is made in a period, counted from 0."""
        return self.word is None or self.word.is_made(self.factory.unit(operation, period))

    def nth(self, operation: Operation, count: int) -> int:
        """In which period an operation is for a unit that is made, after so many that are."""
        return count if self.word is None else self.word.nth(operation.turn, count)

    def before(self, operation: Operation) -> int:
        """How often an operation has ended for a unit that is made where the run starts."""
        ended = self.counts.get(operation.end, 0)
        return ended if self.word is None else self.word.before(operation.turn, ended)

    @cached_property
    def slots(self) -> Mapping[tuple[int, int], int]:
        """The slot of each robot in each of its operations, by (operation, robot)."""
        return MappingProxyType(
            {(o.index, r): slot for o in self.factory.operations for slot, r in enumerate(o.robots)}
        )

    @cached_property
    def moves_parts(self) -> tuple[bool, ...]:
        """Whether the end of each operation is visible as a switch of grips: it makes a part, a
        robot other than its carrier brings one, or it drops the product off."""
        return tuple(
            not o.inputs
            or self.factory.drops(o.index)
            or any(
                label in self.factory.contents and robot != o.carrier
                for robot, label in zip(o.robots, o.before, strict=True)
            )
            for o in self.factory.operations
        )

    @cached_property
    def gear_goals(self) -> tuple[tuple[float, ...], ...]:
        """Arc lengths [m] of the goals of each robot, in the order of its gear."""
        operations = self.factory.operations
        return tuple(
            tuple(self.goal(operations[o], robot.index) for o in robot.operations)
            for robot in self.factory.robots
        )

    def goal(self, operation: Operation, robot: int) -> float:
        """Arc length [m] at which a robot has its goal in an operation."""
        return self.goals[operation.index][self.slots[operation.index, robot]]

    def fed(self, part: str) -> float:
        """The angle about the vertical by which a part is presented turned [rad]."""
        angle = self.factory.pag[self.factory.by_label[part].written].parameter("fed", 0.0)
        assert isinstance(angle, float)
        return angle

    def goes_ahead(self, operation: Operation, robot: int) -> bool:
        """Whether a robot may go to its goal in an operation before that starts."""
        slot = self.slots[operation.index, robot]
        stays = self.settings.stage and operation.awaits_empty(slot)
        return bool(stays) or (operation.index, robot) in self.early

    def name(self, operation: Operation) -> str:
        """The name of an operation in messages: `mate(sub1)`."""
        return f"{operation.template.name}({operation.label})"

    def as_json(self) -> dict[str, Any]:
        """The data in a log, beside the PAG and the settings."""
        made: dict[str, Any] = table_of(MonitorTable.of(self))
        return made


@dataclass(frozen=True, slots=True)
class MonitorTable:
    """The fields of a `MonitorSubject` in a log.

    Attributes:
        goals: arc length of the goal of each robot, for each operation [m].
        radii: radius of the goal ball of each operation [m].
        places: by label, a centre of mass in the frame of the product [m].
        patience: time without an event until a run counts as stalled [s].
        early: (operation, robot) where a robot goes ahead regardless of the settings.
        bends: bends of guidepaths, row by row.
    """

    goals: tuple[tuple[float, ...], ...]
    radii: tuple[float, ...]
    places: Mapping[str, tuple[float, float, float]]
    patience: float
    early: tuple[tuple[int, int], ...]
    bends: BendRows = ()

    @classmethod
    def of(cls, subject: MonitorSubject) -> MonitorTable:
        """The fields of a subject."""
        same = subject.goals, subject.radii, subject.places, subject.patience
        return cls(*same, tuple(sorted(subject.early)), rows_of(subject.ways))

    def subject(
        self, factory: Factory, settings: Settings, start: Marking, wip: int | None
    ) -> MonitorSubject:
        """The subject of a factory. Raises ValueError where the goals are not those of it."""
        slots = [len(o.robots) for o in factory.operations]
        if [*map(len, self.goals)] != slots or len(self.radii) != len(slots):
            raise ValueError("its goals are not those of its PAG")
        same = factory, self.goals, self.radii, self.places, settings, start, self.patience, wip
        return MonitorSubject(*same, frozenset(self.early), kept_in(self))
