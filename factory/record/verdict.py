"""Whether a run succeeded: what its record must show, and what its bodies must.

A run succeeds if all its units were made, its record refines the net, and the bodies agree: what a
monitor reconstructs from the engine's state is what the record says, and no figure of the bodies
exceeds its limit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from factory.record.monitor.report import Report
from factory.support.errors import Diagnostic


@dataclass(frozen=True, slots=True)
class FigureLimit:
    """The most that a figure of the bodies may be in a run that succeeds; `code` and `words` say
    that it is more, with the figure in place of `{}`."""

    code: str
    figure: str
    most: float
    words: str


LIMITS = (
    FigureLimit("Contact", "unintended_contacts", 0, "{:g} unintended contacts"),
    FigureLimit("EngineWarning", "engine_warnings", 0, "{:g} engine warnings"),
    FigureLimit("HandOffGap", "handoff_gap_max_mm", 1.0, "a hand-off with a gap of {:.2f} mm"),
    FigureLimit("GripGap", "grip_gap_max_mm", 0.5, "a pad {:.2f} mm from what it takes"),
)
"""What is judged of the bodies, beside what the monitor finds."""

TOUCHED = "contacts"
"""The figure that names what touched."""

STRENGTH = "grip_strength_share_max"
"""A figure that is kept to be shown: where it is too large the run has ended by that (Dropped)."""

FIGURES = (*(limit.figure for limit in LIMITS), STRENGTH)
"""The figures that are numbers, or none."""

SHOWN = 4
"""So many pairs of these are named in a verdict."""


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """The verdict on a run: what ended it early, whether its record refines the net, and what is
    wrong with its `bodies`. `lenient`: that does not count."""

    trouble: Diagnostic | None = None
    refines: bool = True
    bodies: tuple[Diagnostic, ...] = ()
    lenient: bool = False

    @property
    def follows(self) -> bool:
        """Whether nothing is wrong with it, as far as it goes."""
        return self.refines and not self.bodies

    @property
    def succeeded(self) -> bool:
        """Whether nothing is wrong that counts."""
        return self.trouble is None and self.refines and (self.lenient or not self.bodies)

    @property
    def failures(self) -> tuple[Diagnostic, ...]:
        """All that is wrong."""
        found = [] if self.trouble is None else [self.trouble]
        if not self.refines:
            found.append(Diagnostic("NotRefined", "the record does not refine the net"))
        return (*found, *self.bodies)

    def as_json(self) -> dict[str, object]:
        """The key `verdict` of `--json` documents."""
        return {
            "succeeded": self.succeeded,
            "lenient": self.lenient,
            "failures": [failure.as_json() for failure in self.failures],
        }


def judged(
    trouble: Diagnostic | None,
    refines: bool,
    figures: Mapping[str, Any] | None,
    report: Report | None,
    lenient: bool = False,
) -> RunVerdict:
    """The verdict on a run: `trouble` is what ended it early, `refines` whether its record refines
    the net; `figures` of its bodies, as `kept_figures` gives them, and a monitor's `report`, where
    there are any."""
    bodies = [violation.diagnostic() for violation in report.violations] if report else []
    for limit in LIMITS if figures else ():
        assert figures is not None
        value = figures.get(limit.figure)  # a log of an older version may lack it
        if value is not None and value > limit.most:
            words = limit.words.format(value)
            if limit.code == "Contact" and figures.get(TOUCHED):
                words += f": {', '.join(figures[TOUCHED][:SHOWN])}"
            bodies.append(Diagnostic(limit.code, words))
    return RunVerdict(trouble, refines, tuple(bodies), lenient)


def kept_figures(physics: Any) -> dict[str, Any]:
    """What a verdict rests on, of the figures of a run's bodies, and what no log shows else."""
    found = {figure: getattr(physics, figure) for figure in FIGURES}
    return {**found, TOUCHED: list(physics.contacts)}


def check_figures(figures: Any) -> None:
    """Raises ValueError where these are not as `kept_figures` gives them."""
    if not isinstance(figures, dict):
        raise ValueError("its figures are no table")
    for figure in FIGURES:
        value = figures.get(figure)
        if value is not None and type(value) not in (int, float):
            raise ValueError(f"its figure '{figure}' is no number")
    touched = figures.get(TOUCHED, [])
    if not isinstance(touched, list) or not all(isinstance(name, str) for name in touched):
        raise ValueError(f"its figure '{TOUCHED}' is no list of texts")
