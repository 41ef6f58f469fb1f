"""Convergence of the figures over timestep and weld stiffness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from factory.mjcf.timestep import timed
from factory.mjcf.weld_frames import soften
from factory.study.fidelity.comparing import Case, over_cases
from factory.study.fidelity.quantities import QUANTITIES
from factory.study.fidelity.record import Figures, SeedRecord

TIMESTEPS = (2.0, 1.0, 0.5, 0.25)
"""Factors on the timestep, the finest last."""

STIFFNESSES = (2.0, 1.0, 0.5)
"""Factors on the time constant of the welds, the stiffest last. All at half the timestep: a time
constant below two timesteps is raised to those by the engine."""

RELATIVE = 0.05
"""A figure has converged if its last change is at most this share of its last value..."""

ABSOLUTE = {
    "%": 0.1,
    "s": 0.002,
    "mm": 0.002,
    "mm/s": 0.2,
    "mN s": 0.05,
    "mJ/kg": 0.002,
    "deg": 0.002,
    "m/s^2": 0.05,
    "m/s^3": 5.0,
    "J": 1e-3,
    "kg": 1e-9,
}
"""... or at most this, by its unit. Counts must not change."""


@dataclass(frozen=True)
class Series:
    """Runs of one seed with several values of one setting, the finest last."""

    setting: str
    factors: tuple[float, ...]
    figures: tuple[Figures, ...]
    troubled: tuple[bool, ...]

    def change(self, key: str) -> float | None:
        """Change of a figure between the two finest settings."""
        one, other = (figures.get(key) for figures in self.figures[-2:])
        return None if one is None or other is None else other - one

    def converged(self, key: str) -> bool:
        """Whether the last change of a figure is small; a figure without values has converged."""
        change = self.change(key)
        if change is None:
            values = [figures.get(key) for figures in self.figures[-2:]]
            return values[0] is values[1] is None
        last = self.figures[-1][key] or 0.0
        return abs(change) <= max(RELATIVE * abs(last), ABSOLUTE.get(QUANTITIES[key].unit, 0.0))

    def shrinking(self, key: str) -> bool | None:
        """Whether the last change of a figure is smaller than the one before; None without two
        changes."""
        values = [figures.get(key) for figures in self.figures[-3:]]
        numbers = [value for value in values if value is not None]
        if len(numbers) < 3:
            return None
        return abs(numbers[2] - numbers[1]) < abs(numbers[1] - numbers[0])

    def noticeable(self, key: str) -> bool:
        """Whether a figure exceeds its absolute tolerance at any setting."""
        least = ABSOLUTE.get(QUANTITIES[key].unit, 0.0)
        return any(abs(figures.get(key) or 0.0) > least for figures in self.figures)

    def as_json(self) -> dict[str, Any]:
        """The series as the report lists it."""
        return {
            "setting": self.setting,
            "factors": list(self.factors),
            "troubled": list(self.troubled),
            "figures": {
                key: {
                    "values": [figures.get(key) for figures in self.figures],
                    "change": self.change(key),
                    "shrinking": self.shrinking(key),
                    "converged": self.converged(key),
                }
                for key in QUANTITIES
            },
        }


@dataclass(frozen=True)
class Study:
    """The convergence study of one seed: a series over the timestep and one over the stiffness."""

    seed: int
    series: tuple[Series, ...]

    def unsettled(self) -> list[str]:
        """The figures that do not converge in some series."""
        return [k for k in QUANTITIES if not all(s.converged(k) for s in self.series)]

    def as_json(self) -> dict[str, Any]:
        """The study as the report lists it."""
        return {
            "seed": self.seed,
            "relative_tolerance": RELATIVE,
            "absolute_tolerance": dict(ABSOLUTE),
            "not_converged": self.unsettled(),
            "series": [series.as_json() for series in self.series],
        }


def study(
    case: Case,
    seed: int = 0,
    jobs: int = 1,
    done: Callable[[int], None] | None = None,
    timesteps: Sequence[float] = TIMESTEPS,
    stiffnesses: Sequence[float] = STIFFNESSES,
) -> Study:
    """The same seed with other timesteps, then with other stiffnesses."""
    finer = [_with_timestep(case, factor) for factor in timesteps]
    half = _with_timestep(case, 0.5)
    stiffer = [replace(half, alter=partial(soften, factor=f)) for f in stiffnesses]
    records = over_cases([(c, seed) for c in (*finer, *stiffer)], jobs, done)
    first, second = records[: len(finer)], records[len(finer) :]
    series = _series("timestep", timesteps, first)
    return Study(seed, (series, _series("weld time constant", stiffnesses, second)))


def runs() -> int:
    """Number of runs of a study."""
    return len(TIMESTEPS) + len(STIFFNESSES)


def _series(setting: str, factors: Sequence[float], records: Sequence[SeedRecord]) -> Series:
    figures = tuple(record.figures for record in records)
    return Series(setting, tuple(factors), figures, tuple(not r.passed for r in records))


def _with_timestep(case: Case, factor: float) -> Case:
    """A case with another timestep; its tick stays as near as whole steps allow."""
    settings = timed(case.settings, case.layout, jitter=case.jitter)
    substeps = max(1, round(settings.steps / factor))
    return replace(
        case, settings=replace(settings, timestep=settings.step * factor, substeps=substeps)
    )
