"""Undo: a failure is firing backwards (few-robots.md, sections d and 45).

The state of a marked graph is how often each transition has fired, n; its marking is m = m_0 + C n.
Undo of transitions D is the greatest n' <= n with

    n'(t) <= n(t) - 1             for t in D                               (what has failed)
    m_0 + C n' >= 0                                                       (it is a marking)
    n(z) - n'(z) >= n(t) - n'(t)  for z that was made into what t made    (material)

All of these bound an n' by a sum of another n' and a number that is not negative, and the least of
bounds is a bound: so n' is unique, and one search from D finds it.

Theorem 5 (return). In a live marked graph m' = m_0 + C n' can be reached, since it is not negative
(Murata 1989, Theorem 21). So any number of undos leaves a live, safe and reversible net so.

Theorem 8 (exchange). With D empty and another net N' over the same transitions the same search
gives the marking of N' from which it goes on: the robots may be others.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from factory.nets.gears import GearNet
from factory.nets.petri import Marking

Joins = Mapping[int, tuple[int, ...]]
"""For the end of an operation the transitions that made what it has joined: they are undone as
often, for nothing is taken apart."""

NOTHING: Joins = {}


@dataclass(frozen=True, slots=True)
class Undone:
    """That transitions were fired backwards at time `t` [s]: those that were `asked` for, since an
    `operation` failed for a `reason`, and all that went with them, in the order of the net, each as
    often as it was undone."""

    t: float
    operation: str
    reason: str
    asked: tuple[str, ...]
    transitions: tuple[str, ...]

    def as_json(self) -> dict[str, object]:
        """As `run --json` prints it."""
        return {
            "t": round(self.t, 6),
            "undone": list(self.transitions),
            "asked": list(self.asked),
            "operation": self.operation,
            "reason": self.reason,
        }

    @classmethod
    def between(
        cls,
        net: GearNet,
        what: tuple[float, str, str],
        asked: Iterable[int],
        before: Sequence[int],
        after: Sequence[int],
    ) -> Undone:
        """That between two counts of firings; `what`: time, operation and reason."""
        names = [transition.name for transition in net.threaded.transitions]
        undone = (
            name for name, n, m in zip(names, before, after, strict=True) for _ in range(n - m)
        )
        return cls(*what, tuple(names[event] for event in asked), tuple(undone))


def undo(
    net: GearNet, fired: Sequence[int], asked: Iterable[int] = (), joins: Joins = NOTHING
) -> tuple[int, ...]:
    """n', given how often each transition has `fired` and which are `asked` to be undone once; with
    none asked, of a net that these counts need not fit. Linear in what changes, and in the places
    that do not fit.

    Raises ValueError where some transition would have to be undone oftener than it fired.
    """
    least, places = list(fired), net.threaded.net.places
    initial, postset = net.initial_marking, net.threaded.net.postset
    queue = deque(dict.fromkeys(asked))
    for event in queue:
        least[event] -= 1
    for number, place in enumerate(places):
        (before,), (after,) = place.left, place.right
        if least[before] + (number in initial) < least[after]:
            queue.append(before)
    while queue:
        event = queue.popleft()
        bounds = [(places[p].right[0], least[event] + (p in initial)) for p in postset[event]] + [
            (z, fired[z] + least[event] - fired[event]) for z in joins.get(event, ())
        ]
        for other, most in bounds:
            if least[other] > most:
                least[other] = most
                queue.append(other)
    if min(least, default=0) < 0:
        worst = min(range(len(least)), key=least.__getitem__)
        name = net.threaded.transitions[worst].name
        raise ValueError(f"{name} would be undone oftener than it has fired")
    return tuple(least)


def marking_after(net: GearNet, fired: Sequence[int]) -> Marking:
    """m_0 + C n, for counts that lead to a marking."""
    initial = net.initial_marking
    return frozenset(
        number
        for number, place in enumerate(net.threaded.net.places)
        if (number in initial) + fired[place.left[0]] - fired[place.right[0]] > 0
    )
