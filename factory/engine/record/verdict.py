"""The verdict on a run: conditions on its record and on its bodies.

A run succeeds if all its units were made, its record refines the net, and the bodies agree: the
model was that of the factory, the reconstruction of a monitor from the engine's state agrees with
the record, and no figure of the bodies exceeds its limit. Failures are in the order of time: the
first is the cause. What a run does not show, such as pairs of parts that were not tested against
each other, qualifies its success."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType
from typing import Any, ClassVar

from factory.engine.mjcf import names
from factory.engine.record.findings import Report
from factory.support.errors import Diagnostic

SHOWN = 4
"""Number of names that are listed in a failure."""


@dataclass(frozen=True, slots=True)
class FigureLimit:
    """Upper bound on a figure of the bodies in a run that succeeds.

    Attributes:
        code: code of the failure.
        figure: name of the figure.
        most: its bound, in the unit of the figure.
        words: the failure, with the figure in place of `{}`.
        names: the figure that lists the bodies concerned, "" for none.
        at: the figure with the time [s], "" for none.
    """

    code: str
    figure: str
    most: float
    words: str
    names: str = ""
    at: str = ""

    def exceeded(self, figures: Mapping[str, Any]) -> Diagnostic | None:
        """The failure where the figure exceeds the bound; an older log may lack the figure."""
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
    FigureLimit("HandOffGap", "handoff_gap_max_mm", 1, "a hand-off with a gap of {:.2f} mm"),
    FigureLimit("HandOffTurn", "handoff_angle_max_deg", 0.1, "a hand-off turned by {:.2f}°"),
    FigureLimit("GripGap", "grip_gap_max_mm", 0.5, "a pad {:.2f} mm from the part it takes"),
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
"""The bounds on the bodies, in addition to the findings of the monitor."""

NAMES = tuple(dict.fromkeys(limit.names for limit in LIMITS if limit.names))
"""The figures that list bodies in contact or out of place."""

STRENGTH = "grip_strength_share_max"
"""A figure without a bound here: a run in which it is too large has ended by that (Dropped)."""

DROPPED = "dropped_s"
"""The figure with the time at which a load was dropped, which ends a run a little later [s]."""

FIGURES = (
    *(limit.figure for limit in LIMITS),
    *(limit.at for limit in LIMITS if limit.at),
    *(STRENGTH, DROPPED),
)
"""The figures that are numbers or None."""

NOT_JUDGED = "NotJudged"
"""The code of a log that cannot be judged here."""

BLOCKED = "Blocked"
"""The code of an operation in which parts passed through each other."""


UNSEEN = "what follows may be its doing; a template says what is tested: failure = { ... }"


@dataclass(frozen=True, slots=True)
class RunVerdict:
    """The verdict on a run.

    Attributes:
        MOST: the bound on each figure of the bodies.
        MEASURED: the figures that say how near the bodies of a run came to a failure.
        FAULTS: the figure that lists the faults of the model, as pairs of code and message.
        RESERVATIONS: the figure that lists what a run does not show, in words.
        trouble: what ended it early; None for nothing.
        refines: whether its record refines the net.
        bodies: failures of the bodies, in the order of time.
        lenient: whether failures of the bodies do not count.
        before: number of failures of the bodies that precede the trouble.
        blocked: operations in which parts passed through each other: a failure of the order of
            assembly, and not of the run.
        reservations: what else qualifies its success, in words.
        strict: whether a qualified success is a failure.
    """

    MOST: ClassVar[Mapping[str, float]] = MappingProxyType({x.figure: x.most for x in LIMITS})
    MEASURED: ClassVar[tuple[str, ...]] = (*(limit.figure for limit in LIMITS), STRENGTH)
    FAULTS: ClassVar[str] = "faults"
    RESERVATIONS: ClassVar[str] = "reservations"

    trouble: Diagnostic | None = None
    refines: bool = True
    bodies: tuple[Diagnostic, ...] = ()
    lenient: bool = False
    before: int = 0
    blocked: tuple[Diagnostic, ...] = ()
    reservations: tuple[str, ...] = ()
    strict: bool = False

    @property
    def qualified(self) -> tuple[str, ...]:
        """What qualifies the success of the run, in words."""
        if not self.blocked:
            return self.reservations
        count = len(self.blocked)
        words = f"parts passed through each other in {count} operation{'s' * (count > 1)}"
        return (f"{words} (Blocked: {self.blocked[0].message})", *self.reservations)

    @property
    def judged(self) -> bool:
        """Whether it is a verdict at all."""
        return self.trouble is None or self.trouble.code != NOT_JUDGED

    def caused_by(self, unseen: Sequence[str]) -> RunVerdict:
        """The verdict on a run with faults that no sensor found: where it has failures, they are
        the cause."""
        if not unseen or not (self.bodies or self.trouble):
            return self
        words = ", ".join(unseen[:SHOWN])
        fault = Diagnostic("Unseen", f"no sensor found a fault: {words}", None, UNSEEN)
        return replace(self, bodies=(fault, *self.bodies), before=self.before + 1)

    @property
    def follows(self) -> bool:
        """Whether it has no failures up to its end."""
        return self.refines and not self.bodies

    @property
    def succeeded(self) -> bool:
        """Whether the run has no failure that counts."""
        sound = self.trouble is None and self.refines and (self.lenient or not self.bodies)
        return sound and not (self.strict and self.qualified)

    @property
    def failures(self) -> tuple[Diagnostic, ...]:
        """All failures, the cause first."""
        ending = [] if self.trouble is None else [self.trouble]
        if not self.refines:
            ending.append(Diagnostic("NotRefined", "the record does not refine the net"))
        strictly = self.qualified if self.strict else ()
        doubts = (Diagnostic("Qualified", words) for words in strictly)
        return (*self.bodies[: self.before], *ending, *self.bodies[self.before :], *doubts)

    @property
    def gathered(self) -> tuple[Diagnostic, ...]:
        """The first failure of each code, with the number of others; hints only for the cause."""
        by_code: dict[str, list[Diagnostic]] = {}
        for failure in self.failures:
            by_code.setdefault(failure.code, []).append(failure)
        lines = list[Diagnostic]()
        for code, (first, *more) in by_code.items():
            words = first.message + (f" (and {len(more)} more)" if more else "")
            lines.append(Diagnostic(code, words, first.position, "" if lines else first.hint))
        return tuple(lines)

    def as_json(self) -> dict[str, object]:
        """The key `verdict` of `--json` documents."""
        return {
            "succeeded": self.succeeded,
            "judged": self.judged,
            "lenient": self.lenient,
            "failures": [failure.as_json() for failure in self.failures],
            "blocked": [operation.as_json() for operation in self.blocked],
            "strict": self.strict,
            "qualified": [*self.qualified],
        }

    @classmethod
    def of(
        cls,
        trouble: Diagnostic | None,
        refines: bool,
        figures: Mapping[str, Any] | None,
        report: Report | None,
        lenient: bool = False,
        faults: Sequence[Diagnostic] = (),
    ) -> RunVerdict:
        """The verdict on a run: `trouble` ended it early, `refines`: whether its record refines
        the net; `figures` of its bodies, from `kept_figures`, and the `report` of a monitor, where
        there are any; `faults` of its model beside those in the figures."""
        figures = {**(figures or {})}
        every = [Diagnostic(code, words) for code, words in figures.get(RunVerdict.FAULTS, [])]
        every += faults
        timed = sorted(_failures(figures, every, report), key=lambda failure: failure[0])
        dropped = figures.get(DROPPED)
        ended = inf if dropped is None else dropped
        before = sum(t < ended for t, _ in timed)
        unjudged = [fault for fault in every if fault.code == NOT_JUDGED]
        if unjudged:
            return cls(unjudged[0], refines)
        blocked = tuple(fault for fault in every if fault.code == BLOCKED)
        bodies = tuple(failure for _, failure in timed)
        doubts = tuple(figures.get(RunVerdict.RESERVATIONS, ()))
        return cls(trouble, refines, bodies, lenient, before, blocked, doubts)

    @staticmethod
    def kept_figures(physics: Any) -> dict[str, Any]:
        """The figures of the bodies of a run that a verdict needs, or that a log lacks."""
        kept = {figure: getattr(physics, figure) for figure in (*FIGURES, *NAMES)}
        kept[RunVerdict.FAULTS] = [[fault.code, fault.message] for fault in physics.faults]
        kept[RunVerdict.RESERVATIONS] = [*physics.reservations]
        judged_figures = {limit.figure for limit in LIMITS}
        return {
            figure: value for figure, value in kept.items() if value or figure in judged_figures
        }

    @staticmethod
    def check_kept_figures(figures: Any) -> None:
        """Raises ValueError where figures do not have the form of `kept_figures`."""
        if not isinstance(figures, dict):
            raise ValueError("its figures are not a table")
        for figure in FIGURES:
            value = figures.get(figure)
            if value is not None and type(value) not in (int, float):
                raise ValueError(f"its figure '{figure}' is not a number")
        for figure in (*NAMES, RunVerdict.RESERVATIONS):
            if not _are_texts(figures.get(figure, [])):
                raise ValueError(f"its figure '{figure}' is not a list of texts")
        faults = figures.get(RunVerdict.FAULTS, [])
        if not isinstance(faults, list) or not all(_are_texts(f) and len(f) == 2 for f in faults):
            raise ValueError(f"its figure '{RunVerdict.FAULTS}' is not a list of pairs of texts")


def _failures(
    figures: Mapping[str, Any], faults: Iterable[Diagnostic], report: Report | None
) -> Iterator[tuple[float, Diagnostic]]:
    """The failures of the bodies of a run, each with its time [s]: those of the model first, those
    of figures without a time and of overlapping parts last."""
    for fault in faults:
        if fault.code != BLOCKED:
            yield inf if fault.code == "Overlap" else -inf, fault
    for limit in LIMITS:
        failure = limit.exceeded(figures)
        if failure is not None:
            t = figures.get(limit.at)
            yield inf if t is None else t, failure
    for violation in report.violations if report else ():
        yield violation.t, violation.diagnostic()


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(text, str) for text in value)


def _of(geom: str) -> str:
    """The name of the body of a geom: the label of a part, or else its own name."""
    return names.label_of(geom) if names.kind(geom) == "part" else geom
