"""The interface of the two worlds in which a factory runs."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from factory.engine.record.failures import Account
from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.state import Observation, Observer, State
from factory.engine.timing.demand import Word
from factory.support.arrays import Array, Index
from factory.support.errors import Diagnostic
from factory.theory.control.navigation import Bundle
from factory.theory.nets.coordinated import Past
from factory.theory.plant.operation import Operation

Job = tuple[Operation, int]
"""An operation with the number of the unit that it works on."""

FALL = 0.5
"""So long after something was dropped a run goes on, for it to be seen [s]; nothing fires then."""


@dataclass(slots=True)
class Hooks:
    """Callbacks of a world, by which others observe a run and take part in it.

    Attributes:
        before_step: called before every timestep.
        step_singly: whether every timestep is inspected, since bodies may be anywhere.
        sensors: map positions [m] and speeds [m/s] of all axes to measured ones, one after
            another.
        gates: an operation may start for a unit only if all allow it.
        judges: an operation may end for a unit only if all allow it.
        ticks: called after every tick.
        ended: observers of the state in which operations have ended and parts have changed
            hands.
        state: gives that state.
        ended_time: wall time that observers in `ended` took [s].
        trouble: ends the run with this diagnostic.
        busy: until this time a standstill is no stall [s].
        account: the failures of a run with recovery.
    """

    before_step: list[Callable[[], None]] = field(default_factory=list)
    step_singly: bool = False
    sensors: list[Callable[[Array, Array], tuple[Array, Array]]] = field(default_factory=list)
    gates: list[Callable[[Operation, int], bool]] = field(default_factory=list)
    judges: list[Callable[[Operation, int], bool]] = field(default_factory=list)
    ticks: list[Callable[[], None]] = field(default_factory=list)
    ended: list[Observer] = field(default_factory=list)
    state: Callable[[bool], State] | None = None
    ended_time: float = 0.0
    trouble: Diagnostic | None = None
    busy: float = 0.0
    account: Account | None = None

    @property
    def each_step(self) -> bool:
        """Whether every timestep must be taken singly."""
        return self.step_singly or bool(self.before_step)

    def sensed(self, x: Array, v: Array) -> tuple[Array, Array]:
        """Positions and speeds as measured."""
        for sensor in self.sensors:
            x, v = sensor(x, v)
        return x, v

    def admit(self, operation: Operation, unit: int) -> bool:
        """Whether all gates are open for an operation."""
        return not self.gates or all(gate(operation, unit) for gate in self.gates)

    def pass_on(self, operation: Operation, unit: int) -> bool:
        """Whether all judges let an operation end."""
        return all(judge(operation, unit) for judge in self.judges)

    def tell_ended(self) -> None:
        """Notify the observers of ended operations."""
        begin = perf_counter()
        if self.ended and self.state is not None:
            state = self.state(True)
            for look in self.ended:
                look(state)
        self.ended_time += perf_counter() - begin


@dataclass(frozen=True, slots=True)
class Drop:
    """A grip whose load has exceeded its strength: the time [s], and the diagnosis."""

    time: float
    diagnostic: Diagnostic

    def is_seen(self, now: float) -> bool:
        """Whether a run has gone on for long enough to show it."""
        return now >= self.time + FALL


class World(Protocol):
    """The surroundings of a run: the ideal world or MuJoCo.

    Attributes:
        supplied: whether an operation may have become prepared; reset by the reader.
        instant: whether robots have any speed at once, so that none is governed (ẋ = F_p(x)).

    A supervisor calls `step`; robots with programs of their own are driven by `move`, `advance` and
    `settle`.
    """

    supplied: bool
    instant: bool

    @property
    def time(self) -> float:
        """Simulated time [s]."""

    @property
    def lacking(self) -> Container[str]:
        """Labels of operations that cannot become prepared until this changes."""

    @property
    def hooks(self) -> Hooks:
        """The callbacks."""

    @property
    def word(self) -> Word:
        """Which units are made."""

    @property
    def dropoffs(self) -> list[float]:
        """Time at which each product left the factory [s]."""

    @property
    def physics_time(self) -> float:
        """Wall time spent in the engine [s]."""

    def sense(self) -> tuple[Array, Array]:
        """Positions x [m] and speeds [m/s] of all axes: arc lengths of all carriages, then heights
        of all lifts."""

    def observe(self, at_end: bool = False) -> Observation:
        """The measurable state; `at_end`: at ends of operations."""

    def prepared(self, operation: Operation, unit: int) -> bool:
        """Whether the parts that an operation needs are there: a feeder presents one, the outfeed
        is free."""

    def arrive(self, operations: Sequence[Operation]) -> None:
        """Robots have come to the goals of operations, where they dwell."""

    def apply(self, started: Sequence[Job], ended: Sequence[Job]) -> None:
        """Start and end operations now."""

    def step(
        self, bundle: Bundle | None, axes: Index, ticks: int = 1, until: Collection[Past] = ()
    ) -> bool:
        """Advance by a tick, or by up to `ticks` if the supervisor is not needed in between, for
        instance by a pass in `until`. The axes of active modes follow their field, all others
        stand. Returns whether a mode may have reached its goal."""

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """Let `axes` run from x [m] at speed v [m/s] under acceleration a [m/s²]."""

    def advance(self, steps: int) -> None:
        """Advance by timesteps, with the axes moving as set by `move`."""

    def settle(self) -> None:
        """Act at the end of a tick of such timesteps."""

    def delivered(self) -> int:
        """Number of products that have left the factory, including those before the run."""

    def unstable(self) -> str:
        """Why the engine gave up; "" if it has not."""

    @property
    def dropped(self) -> Drop | None:
        """The first dropped payload, if any; nothing may fire after it."""

    @property
    def collision(self) -> str:
        """The two geoms that were first to touch without being meant to; "" for none."""

    def figures(self) -> PhysicsFigures | None:
        """Measurements of bodies; None if there are none."""
