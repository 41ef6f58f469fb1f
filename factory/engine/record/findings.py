"""What an observer of a run finds: the firings, observed or inferred, and the violations of the
net."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from factory.support.errors import Diagnostic, Position


@dataclass(frozen=True, slots=True)
class Violation:
    """An observation that is inconsistent with the net: its time [s], the robot at fault ("" for
    none), the label concerned, and the line of the PAG."""

    t: float
    robot: str
    label: str
    code: str
    message: str
    position: Position | None = None

    def as_json(self) -> dict[str, object]:
        """The violation as `--json` lists it."""
        at = self.position
        return {
            "t": round(self.t, 6),
            "robot": self.robot,
            "label": self.label,
            "file": at.file if at else None,
            "line": at.line if at else None,
            "message": self.message,
            "code": self.code,
        }

    def diagnostic(self) -> Diagnostic:
        """The violation as a diagnostic."""
        where = f"{self.robot}: " if self.robot else ""
        return Diagnostic(self.code, f"at {self.t:.3f} s, {where}{self.message}", self.position)


@dataclass(frozen=True, slots=True)
class Firing:
    """A transition that fired for the `unit`-th time (from 0) between `earliest` and `latest` [s].

    `seen`: time of its observation, to a tick; None where it is inferred."""

    transition: str
    unit: int
    earliest: float
    latest: float
    seen: float | None = None

    def as_json(self) -> dict[str, object]:
        """The firing as `--json` lists it."""
        seen = {} if self.seen is None else {"t": round(self.seen, 6)}
        bounds = {"earliest": round(self.earliest, 6), "latest": round(self.latest, 6)}
        return {**seen, "transition": self.transition, "unit": self.unit, **bounds}


@dataclass(frozen=True, slots=True)
class Report:
    """The findings of a monitor.

    Attributes:
        seen: firings that it observed.
        inferred: firings that it concluded from others.
        violations: what the net does not allow.
        time_s: time that the monitor took [s].
        calm_s: total duration of the judged spells of the run [s]; None where all of it is judged.
        figures: figures of the bodies, computed again from the states in a log; None where they
            were not.
    """

    seen: tuple[Firing, ...] = field(repr=False)
    inferred: tuple[Firing, ...] = field(repr=False)
    violations: tuple[Violation, ...]
    time_s: float = 0.0
    calm_s: float | None = None
    figures: Mapping[str, Any] | None = field(default=None, repr=False)

    @property
    def refines_net(self) -> bool:
        """Whether some legal firing sequence is consistent with the observations, and every part
        was in its place."""
        return not self.violations

    def as_json(self) -> dict[str, object]:
        """The key `monitor` of `run --json`, and what `monitor --json` prints."""
        return {
            "refines_net": self.refines_net,
            "firings_seen": [f.as_json() for f in self.seen],
            "firings_inferred": [f.as_json() for f in self.inferred],
            "violations": [v.as_json() for v in self.violations],
            **({} if self.calm_s is None else {"judged_s": round(self.calm_s, 6)}),
        }
