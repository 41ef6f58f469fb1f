"""What a record of a run says of a failure, or of robots that were exchanged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

Joins = Mapping[int, tuple[int, ...]]
"""For each end the transitions that are undone at least as often as it is: its start, and the ends
that made what it joined. `factory.plant.material.joins` makes it."""


@dataclass(frozen=True, slots=True)
class Undone:
    """Transitions that were undone at time t [s], before the `after`-th firing of the run.

    `operation`: the label of the operation that failed; `reason`: why, in words; `asked`: the
    transitions that had to be undone for that, `transitions` all that were, in the order of their
    numbers; each name stands there as often as it is undone. `exchanged`: the run went on in the
    next of its nets; then nothing need be undone. `factory.nets.undo` has the definition.
    """

    t: float
    after: int
    operation: str
    reason: str
    asked: tuple[str, ...]
    transitions: tuple[str, ...]
    exchanged: bool = False


Entry = str | Undone
"""A transition that fired, by its name, or what was undone."""


def woven(names: Sequence[str], undone: Iterable[Undone]) -> Iterator[Entry]:
    """The transitions that fired, with what was undone in between where it was."""
    begin = 0
    for entry in undone:
        yield from names[begin : entry.after]
        yield entry
        begin = max(begin, entry.after)
    yield from names[begin:]


def lasting(names: Sequence[str], undone: Iterable[Undone]) -> tuple[int, ...]:
    """Which of the firings (index) last: an undo takes the latest ones of its transitions back.

    They too are a firing sequence of the net, to the same marking: counts that are allowed by
    m_0 + C n >= 0 are closed under the lesser of two.
    """
    taken = set[int]()
    for entry in undone:
        left = Counter(entry.transitions)
        at = entry.after
        while left and at > 0:
            at -= 1
            name = names[at]
            if left[name] and at not in taken:
                taken.add(at)
                left[name] -= 1
                left += Counter()
    return tuple(at for at in range(len(names)) if at not in taken)
