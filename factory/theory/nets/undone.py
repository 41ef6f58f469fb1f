"""Entries of a run's record: firings, and transitions that were undone after a failure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

from factory.theory.nets.gears import GearNet
from factory.theory.problem.ids import TransitionId

Joins = Mapping[int, tuple[TransitionId, ...]]
"""For each end the transitions that are undone at least as often as it is: its start, and the ends
that made what it joined (`Factory.joins`)."""


@dataclass(frozen=True, slots=True)
class Undone:
    """Transitions that were undone.

    Attributes:
        t: time [s].
        operation: label of the operation that failed.
        reason: the cause, in words.
        asked: transitions that had to be undone.
        transitions: all that were undone, in their order.

    A name is repeated for each time that it is undone. Defined by `factory.apps.recovery.undo`.
    """

    t: float
    operation: str
    reason: str
    asked: tuple[str, ...]
    transitions: tuple[str, ...]

    @classmethod
    def between(
        cls,
        net: GearNet,
        what: tuple[float, str, str],
        asked: Iterable[int],
        before: Sequence[int],
        after: Sequence[int],
    ) -> Undone:
        """The difference between two counts of firings; `what`: time, operation and reason."""
        names = [transition.name for transition in net.threaded.transitions]
        triples = zip(names, before, after, strict=True)
        undone = (name for name, was, now in triples for _ in range(was - now))
        return cls(*what, tuple(names[event] for event in asked), tuple(undone))

    @staticmethod
    def lasting(entries: Iterable[Entry]) -> list[int]:
        """Indices of the firings that are not undone: an undo takes back the latest of its
        transitions.

        They too are a firing sequence of the net, to the same marking: counts with m_0 + C n >= 0
        are closed under the lesser of two.
        """
        left: dict[str, list[int]] = {}
        for number, entry in enumerate(entries):
            if isinstance(entry, str):
                left.setdefault(entry, []).append(number)
                continue
            for name in entry.transitions:
                if left.get(name):  # others fired before the run began
                    left[name].pop()
        return sorted(chain.from_iterable(left.values()))

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "t": round(self.t, 6),
            "undone": list(self.transitions),
            "asked": list(self.asked),
            "operation": self.operation,
            "reason": self.reason,
        }


Entry = str | Undone
"""A transition that fired, by its name, or what was undone."""
