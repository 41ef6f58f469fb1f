"""Labels that no hand can hold, and the nearest miss of each kind of hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.surfaces import Way
from factory.support.arrays import Array
from factory.support.errors import Diagnostic, Position

THERE = {
    "joined": "joined to it",
    "brought": "brought to it",
    "lowered": "lowered onto it",
    "own": "its own",
    "hands": "a hand beside it",
    "feeder": "its feeder's pad",
    "tray": "the outfeed's tray",
    "weak": "its weight, for which it is too far from its middle",
}
"""Why something is in the way of a hand, in few words."""

NAMED = 3
"""The most parts in the way that a warning names."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A thing in the way of a hand, and `why` it is there: a `part`, "" for a hand. What the hand
    takes up on its way and the bodies that it meets there, as boxes (n, 2, 3) [m], which may be
    endless."""

    why: str
    part: str = ""
    ways: Array = field(default_factory=lambda: np.zeros((0, 2, 3)), compare=False, repr=False)
    bodies: Array = field(default_factory=lambda: np.zeros((0, 2, 3)), compare=False, repr=False)

    @property
    def named(self) -> str:
        """The obstacle in words."""
        if self.why == "own":
            return f"its own {self.part}"
        return f"{self.part} {THERE[self.why]}" if self.part else THERE[self.why]


@dataclass(frozen=True, slots=True)
class Miss:
    """How near a kind of hand is to holding: the places `tried` (n, 3), and of these the nearest
    miss `at`, None where no pad fits anywhere [m]; the pad's `radius` [m], the `share` of its
    strength that is used by a pin, the `box` (2, 3) of the hand there, which may be endless, the
    `heading` of its robot, and what is in its way; what is in the way of most places (`why`)."""

    kind: HandKind
    heading: Way
    tried: Array = field(compare=False, repr=False)
    at: Point3 | None = None
    radius: float = 0.0
    share: float = 0.0
    box: Array = field(default_factory=lambda: np.zeros((2, 3)), compare=False, repr=False)
    obstacles: tuple[Obstacle, ...] = ()
    why: str = ""

    @property
    def words(self) -> str:
        """The place and its obstacles, in words."""
        if self.at is None:
            return f"{self.kind} there is no place for a pad"
        at = ", ".join(f"{c * 1e3:.4g}" for c in self.at)
        weak = f" ({self.strength})" if self.share > 1 else ""
        return f"{self.kind}, {self.why}, at the nearest miss, ({at}) mm, {self.named}{weak}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts in the way."""
        return tuple(dict.fromkeys(obstacle.part for obstacle in self.obstacles if obstacle.part))

    @property
    def strength(self) -> str:
        """The strength of a hand there, in words."""
        if self.share > 1:
            return f"it would take {self.share:.3g} times its strength"
        return f"it would take {100 * self.share:.0f} % of its strength"

    @property
    def named(self) -> str:
        """The obstacles in words."""
        names = [obstacle.named for obstacle in self.obstacles]
        more = len(names) - NAMED
        return ", ".join(names[:NAMED]) + (f" and {more} more" if more > 0 else "")

    def as_json(self) -> dict[str, Any]:
        """The number of places tried, and the nearest miss."""
        document = {"kind": self.kind, "tried": len(self.tried)}
        if self.at is None:
            return {**document, "at_m": None, "in_the_way": []}
        return {
            **document,
            "most": self.why,
            "at_m": list(self.at),
            "heading": list(self.heading),
            "radius_mm": round(self.radius * 1e3, 4),
            "strength_used": round(self.share, 4),
            "in_the_way": [{"part": o.part or None, "why": THERE[o.why]} for o in self.obstacles],
        }


def _listed(labels: Sequence[str]) -> str:
    """Labels, in words."""
    *first, last = [f"'{label}'" for label in labels]
    return f"{', '.join(first)} and {last}" if first else last


@dataclass(frozen=True, slots=True)
class NoGrip:
    """A sub-assembly that no hand can hold.

    Attributes:
        label: of the sub-assembly.
        robot: that takes it (index).
        parts: its parts.
        beside: the parts beside them once it is delivered.
        misses: the nearest miss of each kind of hand that was tried.
        position: where it is written.
        line: all labels that the robot brings, where there are several.
        ways: which of these each kind of hand can hold, where hands can hold each, but no hand all.
    """

    label: str
    robot: str
    parts: tuple[str, ...]
    beside: tuple[str, ...]
    misses: tuple[Miss, ...]
    position: Position | None = field(default=None, compare=False)
    line: tuple[str, ...] = ()
    ways: tuple[tuple[HandKind, tuple[str, ...]], ...] = ()

    @property
    def shared(self) -> bool:
        """Whether its robot brings several labels."""
        return len(self.line) > 1

    def warning(self) -> Diagnostic:
        """The warning to the user."""
        if self.ways:
            ways = "; ".join(self._way(kind, labels) for kind, labels in self.ways)
            message = f"no one hand can hold all that {self.robot} brings, {_listed(self.line)}"
            hint = f"{ways}; they are attached without one; let other labels share a robot"
            return self._told(message, hint, ", ".join(self.line))
        words = "; ".join(miss.words for miss in self.misses)
        hint = "it is attached without one; change the assembly order, or add a relay from above"
        others = [label for label in self.line if label != self.label]
        if others:
            words += f"; so {self.robot} has no hand for {_listed(others)} either"
        hint = f"{words}; {hint} (--clashes DIR draws it)"
        return self._told(f"no hand can hold '{self.label}'", hint, self.label)

    def _told(self, message: str, hint: str, about: str) -> Diagnostic:
        return Diagnostic("NoGrip", message, self.position, hint, "parts have no grip", about)

    def _way(self, kind: HandKind, labels: tuple[str, ...]) -> str:
        """The labels of a line that a kind of hand can hold, in words."""
        if labels == self.line:
            return f"{kind} it can hold each, but not in one place of the hand"
        return f"{kind} it can hold {_listed(labels) if labels else 'none'}"

    def as_json(self) -> dict[str, Any]:
        """The nearest misses."""
        return {
            "label": self.label,
            "robot": self.robot,
            **({"line": list(self.line)} if self.line else {}),
            **({"ways": {kind: list(labels) for kind, labels in self.ways}} if self.ways else {}),
            "file": self.position.file if self.position else None,
            "line": self.position.line if self.position else None,
            "col": self.position.column if self.position else None,
            "nearest_misses": [miss.as_json() for miss in self.misses],
        }
