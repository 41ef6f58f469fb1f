"""Runs a laid-out factory in one of the two worlds until its products are dropped off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING

from factory.engine.mjcf.timestep import timed
from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.history import firings
from factory.engine.record.replay import replay
from factory.engine.record.state import Observer, State
from factory.engine.simulation.compiled import Compiled
from factory.engine.simulation.distributed import DistributedSupervisor
from factory.engine.simulation.ideal import IdealWorld
from factory.engine.simulation.modelling import modelled
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run, entries_of
from factory.engine.simulation.run_supervisor import RunSupervisor
from factory.engine.simulation.supervisor import Supervisor
from factory.engine.simulation.world import World
from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.demand import Word
from factory.engine.timing.on_demand import cycle_of
from factory.engine.timing.timed import Timed, duration
from factory.engine.timing.timing import Timing
from factory.floor.layout.layout import Layout
from factory.floor.layout.resting import on_demand, start_at_rest
from factory.floor.layout.starting import start_positions
from factory.floor.modes.modes import operation_modes, robot_limits
from factory.floor.modes.staging import HeadStart, stages_of
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import AUTO, MOST, Settings
from factory.theory.control.mode import Limits
from factory.theory.nets.petri import Marking

if TYPE_CHECKING:
    from factory.engine.mjcf.loading import EngineModel
    from factory.engine.mjcf.model import Model
    from factory.engine.simulation.mujoco.world import MujocoWorld

AGREES, SETTLED = 0.01, 100
"""A mean interval is that of the long run if it differs by less than this share of it; after so
many products it is."""

PATIENCE = 10.0
"""A run has stalled when nothing fires for this many times the longest predicted delay."""

LOOK = "look at these robots in `factory render`, or give --max-time more"

SMALLER = "take smaller speeds, a smaller --timestep, or check that the parts are in metres"


class Simulation:
    """One run, ready to go: `run()` does it.

    Args:
        layout: the laid-out factory.
        request: the request for the run.
        compiled: what `compiled` made for an earlier run of the layout.

    Attributes:
        asked: the request as given; `request` has a timestep, and a `wip` where one was chosen.
        model: the MJCF that the engine is given; None in the ideal world.
        world, supervisor: the world, and what fires the net over it.
        modes, limits: the mode of each operation, and the limits of all axes.
        timing: the delays of operations.
        counts: how often each transition had fired before.
        before: number of products that had left before.

    Raises InputError where the engine refuses the model, or a mode starts outside its domain.
    """

    def __init__(
        self,
        layout: Layout,
        request: RunRequest = RunRequest(),  # noqa: B008 (frozen)
        compiled: Compiled | None = None,
    ) -> None:
        if request.demand and request.world == "mujoco":
            layout = on_demand(layout)
        self.layout, self.asked, self._shared = layout, request, compiled
        self.request = request = replace(request, settings=_timed(layout, request, compiled))
        settings, world, net = request.settings, request.world, layout.factory.net
        self.modes = compiled.modes if compiled else operation_modes(layout, settings.eps)
        self.limits, gains = robot_limits(layout, settings, request.seed, request.jitter)
        stages = stages_of(layout, self.modes, settings)
        drawn = request.seed, request.jitter, request.wip, self.modes
        self.timing = Timing(layout, settings, world, *drawn)
        self.delays = self.timing.delays
        self.counts = firings(net, self.start)
        self.model: Model | None = None
        self.world: World
        at = (start_at_rest if request.demand else start_positions)(layout, self.start)
        if world == "ideal":
            self.world = IdealWorld(layout, request, at, self.counts)
        else:
            from factory.engine.simulation.mujoco.world import MujocoWorld

            made = compiled and compiled.model
            self.model = made or modelled(layout, request, self.under_way())
            self.request = request = replace(request, wip=self.model.wip)
            loaded = compiled.loaded if compiled else None
            self.world = MujocoWorld(self.model, request, at, gains, self.counts, loaded)
        self.world.hooks.state = self.state
        self.before = self.world.delivered()
        supervised = self._distributed if request.distributed else self._central
        supervisor = supervised(stages)
        supervisor.ordering = Ordering(self.timing.coordinated.orders)
        if self.start != net.initial_marking:
            supervisor.ordering.keep_passes()
        self.supervisor: RunSupervisor = supervisor

    def again(self, seed: int) -> Simulation:
        """Another run of the same with another seed; what both share is compiled once."""
        self._shared = self._shared or Compiled.of(self.layout, self.asked)
        return Simulation(self.layout, replace(self.asked, seed=seed), self._shared)

    @cached_property
    def patience(self) -> float:
        """A run has stalled if nothing fires for this time [s]."""
        return PATIENCE * max(self.delays)

    @property
    def silent(self) -> float:
        """Time since the last event, or since the start [s]."""
        events = self.supervisor.events
        return self.world.time - (events[-1].t if events else 0.0)

    @cached_property
    def cycle(self) -> CycleTime:
        """The predicted cycle time, and what bounds it."""
        return cycle_of(self.timing, self.word, self.request.wip, self.supervisor.scans)

    @property
    def duration(self) -> float:
        """Upper estimate of the length of the run [s]."""
        return duration(self.timing, self.cycle.seconds, self.request.units)

    @property
    def start(self) -> Marking:
        """The initial marking."""
        start = self.request.start
        return self.layout.factory.net.initial_marking if start is None else start

    def _central(self, stages: Sequence[HeadStart]) -> Supervisor:
        return Supervisor(
            self.layout.factory,
            self.modes,
            self.limits,
            self.world,
            self.request.settings.tick,
            self.start,
            self.counts,
            stages,
        )

    def _distributed(self, stages: Sequence[HeadStart]) -> DistributedSupervisor:
        settings, factory = self.request.settings, self.layout.factory
        if self.start != factory.net.initial_marking:
            message = "a distributed run starts where every robot waits with no part"
            raise InputError(Diagnostic("BadMarking", message, None, "leave out --from"))
        return DistributedSupervisor(
            factory,
            self.modes,
            self.limits,
            self.world,
            settings.step,
            settings.steps,
            self.request.seed,
            stages,
        )

    @property
    def physical(self) -> MujocoWorld:
        """The MuJoCo world. Raises AssertionError in the ideal world."""
        from factory.engine.simulation.mujoco.world import MujocoWorld

        assert isinstance(self.world, MujocoWorld), "the ideal world has no bodies"
        return self.world

    @property
    def word(self) -> Word:
        """Which units are made."""
        return self.world.word

    @property
    def engine(self) -> EngineModel | None:
        """The engine's model; None in the ideal world."""
        return None if self.model is None else self.physical.m

    @property
    def at_ends(self) -> list[Observer]:
        """Observers of the state at ends of operations."""
        return self.world.hooks.ended

    def state(self, at_end: bool = False) -> State:
        """The current state; `at_end`: at ends of operations."""
        world, supervisor = self.world, self.supervisor
        made, seen = world.delivered() - self.before, world.observe(at_end)
        return State(seen, supervisor.marked, made, supervisor.events, world.hooks.account)

    def figures(self) -> PhysicsFigures | None:
        """The figures of the bodies so far; None in the ideal world."""
        return self.world.figures()

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.limits = limits
        self.supervisor.limit(limits)

    def under_way(self) -> dict[str, int]:
        """Number of copies of each part in the factory in the initial marking, including those
        being taken."""
        factory, counts = self.layout.factory, self.counts
        gone = [counts.get(dropoff.end, 0) for dropoff in factory.dropoffs]
        return {o.label: counts.get(o.start, 0) - gone[o.turn] for o in factory.leaves}

    def run(
        self,
        observers: Sequence[Observer] = (),
        max_time: float | None = None,
        glances: Sequence[Observer] = (),
        since: float = 0.0,
    ) -> Run:
        """Tick until `units` products have been dropped off, the run stalls, `max_time` [s] passes
        or a robot drops what it holds. Observers are called after every tick; `glances` are, but
        where there are no observers several ticks may go by between them, and up to the time
        `since` [s] observers are called no more often. Where the engine gives up it begins anew by
        itself, at time 0: nobody is shown that, and the run has lasted until then."""
        supervisor, world, goal = self.supervisor, self.world, self.before + self.request.units
        begin, watched, trouble = perf_counter(), -world.hooks.ended_time, None
        while trouble is None and (world.dropped or world.delivered() < goal):
            before, ticks = world.time, self._unseen(max_time)
            if observers:
                ticks = self._unseen(since) if before < since else 1
            (supervisor.coast if world.dropped else supervisor.step)(ticks)
            if reason := world.unstable():
                watched += world.hooks.ended_time
                trouble = self._trouble("Unstable", f"{reason}, after {before:.2f} s", SMALLER)
                return self._record(perf_counter() - begin - watched, before, trouble)
            for act in world.hooks.ticks:
                act()
            if observers or glances:
                pause = perf_counter()
                state = self.state()
                for observe in (*observers, *glances):
                    observe(state)
                watched += perf_counter() - pause
            trouble = self.ends(max_time)
        watched += world.hooks.ended_time
        return self._record(perf_counter() - begin - watched, world.time, trouble)

    def ends(self, max_time: float | None = None) -> Diagnostic | None:
        """The reason why the run ends now, whether or not its units are made."""
        world, patience = self.world, self.patience
        if world.hooks.trouble is not None:
            return world.hooks.trouble
        if world.dropped is not None:
            return world.dropped.diagnostic if world.dropped.is_seen(world.time) else None
        if self.silent > patience and world.time > world.hooks.busy + patience:
            what = f"nothing fired for {patience:.2f} s of simulated time"
            return self._trouble("Stalled", what, LOOK)
        if max_time is not None and world.time >= max_time:
            what = f"not finished after {max_time:.2f} s of simulated time"
            return self._trouble("Timeout", what, LOOK)
        return None

    def _unseen(self, max_time: float | None) -> int:
        """Number of ticks that may pass unobserved in one call."""
        if self.world.hooks.each_step or self.world.hooks.ticks:
            return 1
        if max_time is None:
            return MOST
        left = (max_time - float(self.world.time)) / self.request.settings.tick
        return max(1, min(MOST, round(left)))

    def _record(self, wall: float, time: float, trouble: Diagnostic | None) -> Run:
        supervisor, world, factory = self.supervisor, self.world, self.layout.factory
        request, physics, figures = self.request, world.physics_time, self.figures()
        entries = entries_of(supervisor.events)
        verdict = replay(factory.net, entries, self.start, factory.joins)
        return Run(
            request.world,
            request.units,
            world.delivered() - self.before,
            len(factory.robots),
            time,
            wall,
            physics,
            wall - physics,
            self.cycle.seconds,
            self.cycle.bottleneck,
            verdict.refines,
            tuple(supervisor.events),
            tuple(world.dropoffs),
            Run.busy_times(factory, supervisor.events),
            figures
            and replace(
                figures,
                timestep_chosen=self.asked.settings.timestep == AUTO,
                wip_chosen=request.wip if self.asked.wip is None else None,
            ),
            request.seed,
            request.jitter,
            trouble,
            period=1 if request.demand else factory.period,
            by_product=self.word.counts(self.before, world.delivered()),
            word=tuple(self.word.products(0, world.delivered())) if request.demand else (),
            settling=self._is_settling(world.dropoffs),
        )

    def _is_settling(self, left: Sequence[float]) -> bool:
        """Whether products that `left` at other intervals than those of the long run were to do so
        by the timed net."""
        wip, period, pace = self.request.wip, self.layout.factory.period, self.cycle.seconds
        measured = Run.mean_interval(left, period)
        if measured is None or self.request.demand or self.supervisor.scans:
            return False
        if len(left) > SETTLED or abs(measured / pace - 1) < AGREES:
            return False
        net = Timed.of(self.timing, wip=wip)
        foretold = Run.mean_interval(net.departures(len(left)), period)
        return foretold is not None and abs(foretold / pace - 1) >= AGREES

    def _trouble(self, code: str, what: str, hint: str) -> Diagnostic:
        """Names the order that has not been placed, the robots that are in an operation, or else
        those that wait for one that cannot start."""
        factory, supervisor = self.supervisor.factory, self.supervisor
        numbers = supervisor.under_way or tuple(o.index for o in supervisor.awaited())
        places = [factory.operations[n] for n in numbers[:3]]
        pairs = ((factory.robots[r].name, o) for o in places for r in o.robots)
        robots = ", ".join(f"{name} in {o.template.name}({o.label})" for name, o in pairs)
        message = f"{what}; {self.word.late_order or robots or 'no robot can start'}"
        return Diagnostic(code, message, places[0].position if places else None, hint)


def _timed(layout: Layout, request: RunRequest, compiled: Compiled | None) -> Settings:
    """The settings with a numeric timestep."""
    if compiled is not None and compiled.model is not None:
        return compiled.model.settings
    return timed(request.settings, layout, request.world, request.jitter)
