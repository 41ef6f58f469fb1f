"""What a factory runs in: the interface of the ideal world and of MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Collection, Container, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Protocol

from factory.control.mode import Array, Index
from factory.control.navigation import Bundle
from factory.nets.coordinated import Past
from factory.plant.demand import Word
from factory.plant.factory import Operation
from factory.record.failures import Account
from factory.record.figures import PhysicsFigures
from factory.record.state import Observation, Observer, State
from factory.support.errors import Diagnostic

Job = tuple[Operation, int]
"""An operation with the number of the unit that it works on."""


@dataclass(slots=True)
class Hooks:
    """Where others take part in a world.

    `before_step`: called before every timestep. `sensors`: from positions [m] and speeds [m/s] of
    all axes to what is sensed. `gates`: an operation may start only where all say so; `judges`: it
    may end only where all do. `ticks`: called after every tick. `ended`: shown the `state` in
    which operations have ended and parts have changed hands, before the world goes on;
    `ended_time` [s]: what that took. `trouble`: what ends the run, if anything does; `busy` [s]:
    until when it is no stall that nothing fires. `account`: what a run that goes on after failures
    tells of them.
    """

    before_step: list[Callable[[], None]] = field(default_factory=list)
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

    def sensed(self, x: Array, v: Array) -> tuple[Array, Array]:
        """What sensors make of positions and speeds."""
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
        """Operations have ended."""
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


class World(Protocol):
    """Where a factory runs: the ideal one or MuJoCo.

    A supervisor calls `step`; robots that run their own programs are driven by `move`, `advance`
    and `settle`. `supplied`: an operation may have become prepared since the last question; the
    questioner resets it. `dropoffs`: when each product left the factory [s].
    """

    supplied: bool

    @property
    def time(self) -> float:
        """[s]"""

    @property
    def lacking(self) -> Container[str]:
        """The labels of operations that cannot become prepared before this changes."""

    @property
    def hooks(self) -> Hooks:
        """Where others take part."""

    @property
    def word(self) -> Word:
        """Which units are made."""

    @property
    def dropoffs(self) -> list[float]:
        """When each product left the factory [s]."""

    @property
    def physics_time(self) -> float:
        """Wall time spent in the engine [s]."""

    def sense(self) -> tuple[Array, Array]:
        """Positions x [m] and speeds [m/s] of all axes: in arc length of all carriages, then the
        heights of all lifts."""

    def observe(self, at_end: bool = False) -> Observation:
        """What can be measured of it now; `at_end`: as operations have ended."""

    def prepared(self, operation: Operation, unit: int) -> bool:
        """Whether the world is in the domain of an operation's mode as far as parts go: a feeder
        has a part to give, the outfeed is free."""

    def apply(self, started: Sequence[Job], ended: Sequence[Job]) -> None:
        """Operations start and end now."""

    def step(
        self, bundle: Bundle | None, axes: Index, ticks: int = 1, until: Collection[Past] = ()
    ) -> bool:
        """A tick, or as many as `ticks` where nothing in between asks for the supervisor, as a pass
        that it waits `until` does: the axes of the active modes follow their field, all others
        stand. Whether any mode may have come to its goal."""

    def move(self, axes: Index, x: Array, v: Array, a: Array) -> None:
        """From now on `axes` run from x [m] at speed v [m/s] under acceleration a [m/s²]."""

    def advance(self, steps: int) -> None:
        """Some timesteps, the axes as `move` has set them going."""

    def settle(self) -> None:
        """A tick's timesteps are over."""

    def delivered(self) -> int:
        """Products that have left the factory, since the beginning of time."""

    def unstable(self) -> str:
        """Why the world cannot go on, "" while it can."""

    @property
    def dropped(self) -> Drop | None:
        """The first payload that a robot has dropped, None while there is none. From then on
        nothing may fire."""

    def figures(self) -> PhysicsFigures | None:
        """What only bodies can tell, None where there are none."""
