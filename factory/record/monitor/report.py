"""What a monitor finds: the firings that explain a run, and the violations, which none explain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from factory.support.errors import Diagnostic, Position


@dataclass(frozen=True, slots=True)
class Violation:
    """An observation that no run of the net gives: the time [s], the robot at fault ("" for none),
    the label it is about, and the line of the PAG that this comes from."""

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
        """The violation as a message."""
        where = f"{self.robot}: " if self.robot else ""
        return Diagnostic(self.code, f"at {self.t:.3f} s, {where}{self.message}", self.position)


@dataclass(frozen=True, slots=True)
class Firing:
    """A transition that fired for the `unit`-th time (from 0) between `earliest` and `latest` [s].

    `seen`: the time at which it showed, to a tick; None where it is inferred."""

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
    """The verdict of a monitor. `time_s`: what the monitor itself took [s]; `calm_s`: how long the
    spells of the run were that it has judged [s], None where it has judged all of it; `figures` of
    the bodies, counted from the states in a log, None where they were not."""

    seen: tuple[Firing, ...] = field(repr=False)
    inferred: tuple[Firing, ...] = field(repr=False)
    violations: tuple[Violation, ...]
    time_s: float = 0.0
    calm_s: float | None = None
    figures: Mapping[str, Any] | None = field(default=None, repr=False)

    @property
    def refines_net(self) -> bool:
        """Whether some legal firing sequence explains the run, and every part was where it had to
        be."""
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
