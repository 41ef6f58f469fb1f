"""The record of a run: events and figures, for either world."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from factory.engine.record.ending import CutOff
from factory.engine.record.failures import Failures
from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.findings import Report
from factory.engine.record.replay import replay
from factory.engine.record.state import Event
from factory.engine.record.verdict import RunVerdict
from factory.support.errors import Diagnostic, RunError
from factory.support.showing import drawn
from factory.theory.nets.petri import Marking
from factory.theory.nets.undone import Entry, Undone
from factory.theory.plant.factory import Factory
from factory.theory.problem.ids import is_end, operation_of


def entries_of(events: Iterable[Event | Undone]) -> Iterator[Entry]:
    """The events for a replay: firings by name."""
    return (event.transition if isinstance(event, Event) else event for event in events)


STEADY = 4
"""Number of products from which on a cycle time is measured: the last half has two intervals."""


@dataclass(frozen=True)
class Run:
    """The record of a run.

    Attributes:
        world: ideal or mujoco.
        units: number of units asked for.
        products: number of units made.
        robots: number of robots.
        sim_time_s: simulated time [s].
        wall_time_s: time that the run loop took [s].
        physics_time_s: share of that in the engine [s].
        supervisor_time_s: share of that in the supervisor [s].
        predicted_cycle_time_s: cycle time of the timed net [s]; None where there is none.
        bottleneck: what bounds it, in words.
        replays: whether an independent replay of the events is a run of the net.
        events: all firings, and transitions that were undone.
        dropoffs: time at which each product left [s].
        busy: time that each robot spent in operations [s].
        physics: figures of the bodies; None in the ideal world.
        seed: of its request.
        jitter: of its request.
        trouble: what ended it early; None for a run that reached its end.
        monitor: the report of the monitor that watched it; None for none.
        lenient: whether failures of the bodies do not count.
        strict: whether a qualified success is a failure.
        period: number of units in a cycle of the net.
        by_product: number of units of each product.
        word: on demand, the products in the order in which they left.
        failures: what went wrong, in a run that recovers.
        log: the file of its log.
        settling: whether the timed net, too, has these products leave at another pace than that of
            the long run: robots before the bottleneck fill first.
    """

    world: str
    units: int
    products: int
    robots: int
    sim_time_s: float
    wall_time_s: float
    physics_time_s: float
    supervisor_time_s: float
    predicted_cycle_time_s: float | None
    bottleneck: str
    replays: bool
    events: tuple[Event | Undone, ...] = field(repr=False)
    dropoffs: tuple[float, ...] = field(repr=False)
    busy: tuple[float, ...] = field(repr=False)
    physics: PhysicsFigures | None = None
    seed: int = 0
    jitter: float = 0.0
    trouble: Diagnostic | None = None
    monitor: Report | None = None
    lenient: bool = False
    strict: bool = False
    period: int = 1
    by_product: Mapping[str, int] = field(default_factory=dict)
    word: tuple[str, ...] = field(default=(), repr=False)
    failures: Failures | None = None
    log: Path | None = field(default=None, repr=False, compare=False)
    settling: bool = False

    def __repr__(self) -> str:
        made = f"{self.products} of {self.units} products in {self.sim_time_s:.2f} s"
        doubts = "; ".join(self.verdict.qualified)
        how = "succeeded" + (f", but {doubts}" if doubts else "") if self.succeeded else "FAILED"
        return f"<Run in {self.world}: {how}, {made}>"

    def _repr_html_(self) -> str | None:
        return drawn(self)

    @staticmethod
    def is_refined(factory: Factory, entries: Sequence[str | Undone], start: Marking) -> bool:
        """Whether a record of a factory, firings and what was undone from a marking on, is one of
        its net."""
        return replay(factory.net, entries, start, factory.joins).refines

    @staticmethod
    def steady_from(period: int = 1) -> int:
        """The number of products from which on a cycle time is measured, so that the last half of
        them has a whole period (a number of units)."""
        return max(STEADY, 2 * period if period > 1 else 0)

    @staticmethod
    def mean_interval(left: Sequence[float], period: int = 1) -> float | None:
        """Mean interval [s] between these times of departure over the whole periods of units in
        their last half; None for fewer than `steady_from`."""
        if len(left) < Run.steady_from(period):
            return None
        tail = left[len(left) // 2 - 1 :]
        count = len(tail) - 1
        count -= count % period
        return (tail[-1] - tail[-1 - count]) / count

    @staticmethod
    def busy_times(factory: Factory, events: Iterable[Event | Undone]) -> tuple[float, ...]:
        """Time that each robot spent in completed operations [s]. An operation without a start
        event was under way at time 0."""
        numbers = {t.name: number for number, t in enumerate(factory.net.threaded.transitions)}
        begun, spent = dict[int, float](), [0.0] * len(factory.robots)
        for t, transition in (event for event in events if isinstance(event, Event)):
            operation, ends = operation_of(numbers[transition]), is_end(numbers[transition])
            if not ends:
                begun[operation] = t
                continue
            lasted = t - begun.pop(operation, 0.0)
            for robot in factory.operations[operation].robots:
                spent[robot] += lasted
        return tuple(spent)

    @property
    def fired(self) -> int:
        """Number of firings, including those undone."""
        return sum(isinstance(event, Event) for event in self.events)

    @cached_property
    def lasting(self) -> tuple[Event, ...]:
        """The firings that were not undone; they too are a run of the net."""
        kept = Undone.lasting(entries_of(self.events))
        return tuple(e for e in (self.events[at] for at in kept) if isinstance(e, Event))

    @property
    def refines_net(self) -> bool:
        """Whether the events are a run of the net and agree with the monitor, if there was one."""
        return self.replays and (self.monitor is None or self.monitor.refines_net)

    @cached_property
    def verdict(self) -> RunVerdict:
        """Whether the run made its units, is a run of the net, and its bodies agree."""
        figures = None if self.physics is None else RunVerdict.kept_figures(self.physics)
        verdict = RunVerdict.of(self.trouble, self.replays, figures, self.monitor, self.lenient)
        verdict = verdict.caused_by(self.failures.unseen if self.failures else ())
        return replace(verdict, strict=self.strict)

    @property
    def succeeded(self) -> bool:
        """Whether the run has no fault that counts."""
        return self.verdict.succeeded

    @property
    def cut_off(self) -> CutOff | None:
        """How far an incomplete run came."""
        if self.trouble is None:
            return None
        why = self.trouble.code, self.trouble.message
        return CutOff(self.sim_time_s, self.products, self.units, *why)

    @property
    def realtime_factor(self) -> float:
        """Simulated seconds per second of the run loop."""
        return self.sim_time_s / self.wall_time_s if self.wall_time_s else 0.0

    @property
    def cycle_time_s(self) -> float | None:
        """Mean interval between dropoffs over the whole periods in the last half of the units; None
        for fewer than `steady_from`, and while the pace is settling."""
        return None if self.settling else Run.mean_interval(self.dropoffs, self.period)

    @property
    def cycle_time_missing(self) -> str | None:
        """Why no cycle time is measured; None where one is."""
        if self.cycle_time_s is not None:
            return None
        if self.settling:
            return f"{len(self.dropoffs)} products; by the timed net their pace is not yet steady"
        least = Run.steady_from(self.period)
        periods = f", two periods of {self.period}" if least > STEADY else ""
        return f"{len(self.dropoffs)} products; a cycle time is measured from {least} on{periods}"

    @property
    def utilisation(self) -> tuple[float, ...]:
        """Share of the time that each robot spent in operations."""
        total = self.sim_time_s or 1.0
        return tuple(b / total for b in self.busy)

    def as_json(self) -> dict[str, object]:
        """The document printed by `run --json`."""
        physics, monitor, cut = self.physics, self.monitor, self.cut_off
        watched = {"monitor_time_s": monitor.time_s} if monitor else {}
        keys = (
            "handoffs",
            "handoff_gap_max_mm",
            "handoff_angle_max_deg",
            "grip_gap_max_mm",
            "grip_strength_share_max",
            "grip_strength_robot",
            "grip_strength_label",
            "weld_residual_max_mm",
            "product_error_max_mm",
            "product_angle_max_deg",
            "joining_error_max_mm",
            "unintended_contacts",
            "pairs_tested",
            "pairs_excluded",
            "engine_warnings",
            "mating_force_max_n",
            "timestep_s",
            "timestep_chosen",
            "wip_chosen",
        )
        return {
            "schema": 1,
            "world": self.world,
            "units": self.units,
            "products": self.products,
            "units_by_product": dict(self.by_product),
            **({"word": list(self.word)} if self.word else {}),
            "cut_off": cut and cut.as_json(),
            "robots": self.robots,
            "seed": self.seed,
            "jitter": self.jitter,
            "sim_time_s": round(self.sim_time_s, 6),
            "wall_time_s": self.wall_time_s,
            "physics_time_s": self.physics_time_s if physics else None,
            "supervisor_time_s": self.supervisor_time_s,
            "realtime_factor": self.realtime_factor,
            "cycle_time_s": self.cycle_time_s,
            "cycle_time_missing": self.cycle_time_missing,
            "predicted_cycle_time_s": self.predicted_cycle_time_s,
            "bottleneck": self.bottleneck,
            "transitions_fired": self.fired,
            "refines_net": self.refines_net,
            **{key: getattr(physics, key) if physics else None for key in keys},
            "contacts": list(physics.contacts) if physics else None,
            "mating_forces_n": dict(physics.mating_forces) if physics else None,
            "fused": physics.fused if physics else None,
            "excluded": [list(pair) for pair in physics.excluded] if physics else None,
            **watched,
            **({"failures": self.failures.as_json()} if self.failures else {}),
            "verdict": self.verdict.as_json(),
            "qualified": [*self.verdict.qualified],
            "events": [event.as_json() for event in self.events],
        }


def require(run: Run) -> Run:
    """The run, or RunError with its trouble."""
    if run.trouble is not None:
        raise RunError(run.trouble)
    return run
