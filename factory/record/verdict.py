"""Whether a run succeeded: what its record must show, and what its bodies must.

A run succeeds if all its units were made, its record refines the net, and the bodies agree: the
model was that of the factory, what a monitor reconstructs from the engine's state is what the
record says, and no figure of the bodies exceeds its limit. What failed is told in the order of
time: what comes first is the cause."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from factory.mjcf import names
from factory.record.monitor.report import Report
from factory.support.errors import Diagnostic

SHOWN = 4
"""So many names are listed in a verdict."""


@dataclass(frozen=True, slots=True)
class FigureLimit:
    """The most that a figure of the bodies may be in a run that succeeds; `code` and `words` say
    that it is more, with the figure in place of `{}`. `names`: the figure, a list of texts, that
    says what of; `at`: the figure that says when [s]."""

    code: str
    figure: str
    most: float
    words: str
    names: str = ""
    at: str = ""

    def exceeded(self, figures: Mapping[str, Any]) -> Diagnostic | None:
        """What is said where the figure is more; a log of an older version may lack it."""
        value = figures.get(self.figure)
        if value is None or value <= self.most:
            return None
        words, of = self.words.format(value), figures.get(self.names, [])[:SHOWN]
        words += f": {', '.join(of)}" if of else ""
        t = figures.get(self.at)
        if t is not None and of:
            words = f"{' hit '.join(map(_of, of[0].split(' - ')))} at {t:.2f} s; {words}"
        return Diagnostic(self.code, words)


LIMITS = (
    FigureLimit(
        "Contact",
        "unintended_contacts",
        0,
        "{:g} unintended contacts",
        names="contacts",
        at="contact_first_s",
    ),
    FigureLimit("EngineWarning", "engine_warnings", 0, "{:g} engine warnings"),
    FigureLimit("HandOffGap", "handoff_gap_max_mm", 1.0, "a hand-off with a gap of {:.2f} mm"),
    FigureLimit("HandOffTurn", "handoff_angle_max_deg", 0.1, "a hand-off turned by {:.2f}°"),
    FigureLimit("GripGap", "grip_gap_max_mm", 0.5, "a pad {:.2f} mm from what it takes"),
    FigureLimit(
        "ProductError",
        "product_error_max_mm",
        0.1,
        "a part {:.2f} mm out of place in a product",
        names="misplaced",
    ),
    FigureLimit(
        "ProductTurn",
        "product_angle_max_deg",
        0.1,
        "a part turned by {:.2f}° in a product",
        names="misplaced",
    ),
)
"""What is judged of the bodies, beside what the monitor finds."""

NAMES = tuple(dict.fromkeys(limit.names for limit in LIMITS if limit.names))
"""The figures that name what was in contact or out of place."""

STRENGTH = "grip_strength_share_max"
"""A figure that is kept to be shown: where it is too large the run has ended by that (Dropped)."""

DROPPED = "dropped_s"
"""The figure that says when a load was dropped, which ends a run a little later [s]."""

FIGURES = (
    *(limit.figure for limit in LIMITS),
    *(limit.at for limit in LIMITS if limit.at),
    *(STRENGTH, DROPPED),
)
"""The figures that are numbers, or none."""

FAULTS = "faults"
"""The figure that lists what was wrong with the model of a run, code and message of each."""


BLOCKED = "Blocked"


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """The verdict on a run: what ended it early, whether its record refines the net, and what is
    wrong with its `bodies`, in the order of time, so many of which came `before` what ended it.
    `lenient`: the bodies do not count. `blocked`: operations in which parts passed through each
    other on their way, which is no failure of the run, but of the order of assembly."""

    trouble: Diagnostic | None = None
    refines: bool = True
    bodies: tuple[Diagnostic, ...] = ()
    lenient: bool = False
    before: int = 0
    blocked: tuple[Diagnostic, ...] = ()

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
        """All that is wrong, the cause first."""
        found = [] if self.trouble is None else [self.trouble]
        if not self.refines:
            found.append(Diagnostic("NotRefined", "the record does not refine the net"))
        return (*self.bodies[: self.before], *found, *self.bodies[self.before :])

    @property
    def gathered(self) -> tuple[Diagnostic, ...]:
        """The first failure of each code, with how many more there are. What would mend a
        consequence is not said."""
        found: dict[str, list[Diagnostic]] = {}
        for failure in self.failures:
            found.setdefault(failure.code, []).append(failure)
        lines = list[Diagnostic]()
        for code, (first, *more) in found.items():
            words = first.message + (f" (and {len(more)} more)" if more else "")
            lines.append(Diagnostic(code, words, first.position, "" if lines else first.hint))
        return tuple(lines)

    def as_json(self) -> dict[str, object]:
        """The key `verdict` of `--json` documents."""
        return {
            "succeeded": self.succeeded,
            "lenient": self.lenient,
            "failures": [failure.as_json() for failure in self.failures],
            "blocked": [operation.as_json() for operation in self.blocked],
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
    found = sorted(_failures(figures or {}, report), key=lambda failure: failure[0])
    dropped = (figures or {}).get(DROPPED)
    ended = inf if dropped is None else dropped
    before = sum(t < ended for t, _ in found)
    faults = [Diagnostic(code, words) for code, words in (figures or {}).get(FAULTS, [])]
    blocked = tuple(fault for fault in faults if fault.code == BLOCKED)
    bodies = tuple(failure for _, failure in found)
    return RunVerdict(trouble, refines, bodies, lenient, before, blocked)


def _failures(
    figures: Mapping[str, Any], report: Report | None
) -> Iterator[tuple[float, Diagnostic]]:
    """What is wrong with the bodies of a run, each with its time [s]: that of the model is before
    all, that of figures without a time and of the product's drawing after all."""
    for code, words in figures.get(FAULTS, []):
        if code != BLOCKED:
            yield inf if code == "Overlap" else -inf, Diagnostic(code, words)
    for limit in LIMITS:
        failure = limit.exceeded(figures)
        if failure is not None:
            t = figures.get(limit.at)
            yield inf if t is None else t, failure
    for violation in report.violations if report else ():
        yield violation.t, violation.diagnostic()


def kept_figures(physics: Any) -> dict[str, Any]:
    """What a verdict rests on, of the figures of a run's bodies, and what no log shows else."""
    found = {figure: getattr(physics, figure) for figure in (*FIGURES, *NAMES)}
    found[FAULTS] = [[fault.code, fault.message] for fault in physics.faults]
    asked = {limit.figure for limit in LIMITS}
    return {figure: value for figure, value in found.items() if value or figure in asked}


def check_figures(figures: Any) -> None:
    """Raises ValueError where these are not as `kept_figures` gives them."""
    if not isinstance(figures, dict):
        raise ValueError("its figures are no table")
    for figure in FIGURES:
        value = figures.get(figure)
        if value is not None and type(value) not in (int, float):
            raise ValueError(f"its figure '{figure}' is no number")
    for figure in NAMES:
        if not _are_texts(figures.get(figure, [])):
            raise ValueError(f"its figure '{figure}' is no list of texts")
    faults = figures.get(FAULTS, [])
    if not isinstance(faults, list) or not all(_are_texts(f) and len(f) == 2 for f in faults):
        raise ValueError(f"its figure '{FAULTS}' is no list of pairs of texts")


def _of(geom: str) -> str:
    """What a geom is of: a part by its label, anything else by its own name."""
    return names.label_of(geom) if names.kind(geom) == "part" else geom


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)
