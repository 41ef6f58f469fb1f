"""The gain of optimising: a layout compared with the first feasible one and with a lower bound."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from factory.layout.bounds import cycle_time_bound
from factory.layout.dimensions import Clearance
from factory.layout.durations import Pace, cycle_of, slowest
from factory.layout.layout import Layout
from factory.layout.optimising import first_feasible, floor_of


@dataclass(frozen=True, slots=True)
class Figures:
    """The objectives: cycle time [s] of the net from rest to rest, total length of the guidepaths
    [m], floor [m²]."""

    predicted_cycle_time_s: float
    guidepath_length_m: float
    area_m2: float


@dataclass(frozen=True, slots=True)
class LayoutGain:
    """The figures of a layout and of the first feasible one; the robot that allows no shorter cycle
    and the least cycle time that any layout without relays could have [s]. Where there are relays:
    the figures without them, and how many robots they add."""

    chosen: Figures
    first: Figures
    bottleneck: str
    bound: float
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
            "cycle_time_bound_s": round(self.bound, 6),
            "first_feasible": asdict(self.first),
        }

    def __str__(self) -> str:
        first, plain, relays, other = self.first, self.plain, "", ""
        if plain:
            words = f"{self.added} robot{'' if self.added == 1 else 's'} more to relay"
            relays = f"; {words}, {plain.predicted_cycle_time_s:.2f} s without"
            other = " without relays"
        return (
            f"cycle {self.chosen.predicted_cycle_time_s:.2f} s ({self.bottleneck}){relays};"
            f" first feasible"
            f" layout {first.predicted_cycle_time_s:.2f} s, {first.area_m2:.2f} m²,"
            f" {first.guidepath_length_m:.2f} m; no layout{other} below"
            f" {self.bound:.2f} s"
        )


def gain(layout: Layout, pace: Pace) -> LayoutGain:
    """Compare a layout for robots of a pace."""
    plain = layout.plain or layout
    factory, product, c = plain.factory, layout.product, layout.clearance
    _, (bottleneck, *_) = slowest(layout, pace)
    return LayoutGain(
        _figures(layout, pace),
        _figures(first_feasible(factory, product, Clearance(c, factory.carriage)), pace),
        layout.factory.robots[bottleneck].name,
        cycle_time_bound(factory, product, c, pace),
        _figures(plain, pace) if layout.plain else None,
        len(layout.factory.robots) - len(factory.robots),
    )


def _figures(layout: Layout, pace: Pace) -> Figures:
    xlo, xhi, ylo, yhi = floor_of(layout)
    cycle = cycle_of(layout, pace)
    area = (xhi - xlo) * (yhi - ylo)
    return Figures(round(cycle, 6), round(layout.guidepath_length, 6), round(area, 6))
