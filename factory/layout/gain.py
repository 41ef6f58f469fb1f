"""What optimising gained: a layout against the first feasible one and a lower bound."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from factory.layout.bounds import cycle_time_bound
from factory.layout.dimensions import Clearance
from factory.layout.durations import Pace, gear_times
from factory.layout.optimising import bounds, first_feasible
from factory.layout.plan import Layout
from factory.layout.sweeps import piles, regions


@dataclass(frozen=True, slots=True)
class Figures:
    """What users pay: cycle time [s] of the net from rest to rest, total length of the guidepaths
    [m], floor [m²]."""

    predicted_cycle_time_s: float
    guidepath_length_m: float
    area_m2: float


@dataclass(frozen=True, slots=True)
class Gain:
    """The figures of a layout and of the first feasible one; the robot that allows no shorter cycle
    and the least cycle time that any layout could have [s]."""

    chosen: Figures
    first: Figures
    bottleneck: str
    bound: float

    def as_json(self) -> dict[str, object]:
        """As a part of a document."""
        return {
            **asdict(self.chosen),
            "bottleneck": self.bottleneck,
            "cycle_time_bound_s": round(self.bound, 6),
            "first_feasible": asdict(self.first),
        }

    def __str__(self) -> str:
        first = self.first
        return (
            f"cycle {self.chosen.predicted_cycle_time_s:.2f} s ({self.bottleneck}); first feasible"
            f" layout {first.predicted_cycle_time_s:.2f} s, {first.area_m2:.2f} m²,"
            f" {first.guidepath_length_m:.2f} m; no layout below {self.bound:.2f} s"
        )


def gain(layout: Layout, pace: Pace) -> Gain:
    """Compare a layout for robots of a pace."""
    factory, product, c = layout.factory, layout.product, layout.clearance
    times = gear_times(layout, pace)
    slowest = max(range(len(times)), key=times.__getitem__)
    return Gain(
        _figures(layout, pace),
        _figures(first_feasible(factory, product, Clearance(c)), pace),
        factory.robots[slowest].name,
        cycle_time_bound(factory, product, c, pace),
    )


def _figures(layout: Layout, pace: Pace) -> Figures:
    swept = regions(layout, piles(layout.factory, layout.product))
    xlo, xhi, ylo, yhi = bounds(swept, layout.clearance)
    cycle = max(gear_times(layout, pace))
    area = (xhi - xlo) * (yhi - ylo)
    return Figures(round(cycle, 6), round(layout.guidepath_length, 6), round(area, 6))
