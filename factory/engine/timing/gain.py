"""The gain of optimising: a layout compared with the first feasible one and with a lower bound."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from math import floor, sqrt

from factory.engine.timing.cycle_time import CycleTime
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import Timing
from factory.floor.layout.bounds import cycle_time_bound
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.durations import Pace
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import first_feasible, floor_of
from factory.support.settings import Settings

MANY = 400
"""A factory of so many robots is not laid out again to be compared."""


@dataclass(frozen=True, slots=True)
class Figures:
    """The objectives: the cycle time that a run is predicted to have [s], total length of the
    guidepaths [m], floor [m²]."""

    predicted_cycle_time_s: float
    guidepath_length_m: float
    area_m2: float


@dataclass(frozen=True, slots=True)
class LayoutGain:
    """The figures of a layout and of the first feasible one; the robot that allows no shorter cycle
    and the least cycle time that any layout without relays could have [s]. A layout with chains is
    compared with none: `first` and `bound` are None; one of MANY robots with the bound alone. Where
    there are relays: the figures without them, and how many robots they add."""

    chosen: Figures
    bottleneck: str
    first: Figures | None = None
    bound: float | None = None
    plain: Figures | None = None
    added: int = 0

    def as_json(self) -> dict[str, object]:
        """As a part of a document."""
        document: dict[str, object] = asdict(self.chosen)
        if self.plain:
            document["relays"] = {"robots_added": self.added, "without": asdict(self.plain)}
        return {
            **document,
            "bottleneck": self.bottleneck,
            "cycle_time_bound_s": None if self.bound is None else round(self.bound, 6),
            "first_feasible": None if self.first is None else asdict(self.first),
        }

    def __str__(self) -> str:
        first, plain, relays, other = self.first, self.plain, "", ""
        if plain:
            words = f"{self.added} robot{'' if self.added == 1 else 's'} more to relay"
            relays = f"; {words}, {plain.predicted_cycle_time_s:.2f} s without"
            other = " without relays"
        cycle = f"cycle {self.chosen.predicted_cycle_time_s:.2f} s ({self.bottleneck}){relays}"
        if first is not None:
            cycle += (
                f"; first feasible layout {first.predicted_cycle_time_s:.2f} s,"
                f" {first.area_m2:.2f} m², {first.guidepath_length_m:.2f} m"
            )
        return (
            cycle if self.bound is None else f"{cycle}; no layout{other} below {self.bound:.2f} s"
        )


def gain(layout: Layout, settings: Settings, hands: Hands, wip: int | None = None) -> LayoutGain:
    """Compare a layout with others for the same settings, `hands` to choose from, and bound on
    units inside; where robots are on tees, with a first one of robots that have no hands."""
    cycle = _cycle(layout, settings, wip)
    if layout.chains is not None:
        return LayoutGain(_rounded(layout, cycle, layout.area), cycle.bottleneck)
    plain = layout.plain or layout
    factory, product, c = plain.factory, layout.product, layout.clearance
    size, chosen = Clearance(c, factory.carriage), None if layout.stems else hands
    first = None
    if len(factory.robots) < MANY:
        laid = first_feasible(factory, product, size, (), chosen)
        first = _figures(laid, _cycle(laid, settings, wip))
    return LayoutGain(
        _figures(layout, cycle),
        cycle.bottleneck,
        first,
        cycle_time_bound(factory, product, c, soonest(settings)),
        _figures(plain, _cycle(plain, settings, wip)) if layout.plain else None,
        len(layout.factory.robots) - len(factory.robots),
    )


def soonest(settings: Settings) -> Pace:
    """The pace of a run whose operations all end as soon as they can: in the tick in which its
    robots come into their goal balls, less the tick that a dwell begins before.

    A robot whose reference brakes by a·dt a tick, over c·n(n + 1) in n ticks, c = a·dt²/2, rests
    n + 1 ticks after it is nearer to its goal than c·(n + 1)(n + 2).
    """
    pace, tick = Pace.of(settings), settings.tick
    balls = 2 * settings.eps / (settings.acceleration * tick * tick)
    early = tick * (2 + floor(sqrt(balls + 0.25) - 0.5 - 1e-9))
    ahead = None if pace.ahead is None else pace.ahead - early
    return replace(pace, lost=pace.lost - early, ahead=ahead)


def _cycle(layout: Layout, settings: Settings, wip: int | None) -> CycleTime:
    return Timed.of(Timing(layout, settings), wip=wip).cycle


def _figures(layout: Layout, cycle: CycleTime) -> Figures:
    xlo, xhi, ylo, yhi = floor_of(layout)
    return _rounded(layout, cycle, (xhi - xlo) * (yhi - ylo))


def _rounded(layout: Layout, cycle: CycleTime, area: float) -> Figures:
    return Figures(round(cycle.seconds, 6), round(layout.guidepath_length, 6), round(area, 6))
