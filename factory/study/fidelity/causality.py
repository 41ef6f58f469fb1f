"""Comparison of two records of one net: causes, order and times of their firings.

The n-th firing of a transition in one record corresponds to the n-th in the other. The immediate
causes of a firing are the firings that made the tokens it takes. Firings that are neither before
nor after it in the closure of this relation are causally unrelated to it: their order is free.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Array, Truth
from factory.nets.gears import GearNet
from factory.record.state import Event

Firing = tuple[str, int]
"""A transition's name and the number of the firing, from 1."""

MOST = 6000
"""Number of firings that are compared pair by pair, the first of longer records."""


@dataclass(frozen=True, slots=True)
class CausalRecord:
    """A record as a partial order: the times [s] and the immediate causes of its firings."""

    times: dict[Firing, float]
    causes: dict[Firing, frozenset[Firing]]


@dataclass(frozen=True, slots=True)
class Orders:
    """Differences of two records: the number of `unrelated` pairs, which are causally unrelated and
    at different times in both, and how many of these are `swapped`; the number of firings whose
    `causes` differ."""

    swapped: int
    unrelated: int
    causes: int

    @property
    def percent(self) -> float:
        """Share of the unrelated pairs that are swapped [%]."""
        return 100.0 * self.swapped / self.unrelated if self.unrelated else 0.0


def causal_record(net: GearNet, events: Iterable[Event]) -> CausalRecord:
    """The partial order of a legal record from the initial marking: the token game, with the firing
    that made each token."""
    threaded = net.threaded.net
    number = {t.name: i for i, t in enumerate(net.threaded.transitions)}
    made: dict[int, Firing | None] = dict.fromkeys(net.initial_marking)
    count: dict[str, int] = {}
    times: dict[Firing, float] = {}
    causes: dict[Firing, frozenset[Firing]] = {}
    for event in events:
        name = event.transition
        count[name] = count.get(name, 0) + 1
        firing, index = (name, count[name]), number[name]
        taken = [made.pop(place, None) for place in threaded.preset[index]]
        causes[firing] = frozenset(cause for cause in taken if cause is not None)
        times[firing] = event.t
        made.update(dict.fromkeys(threaded.postset[index], firing))
    return CausalRecord(times, causes)


def compare(one: CausalRecord, other: CausalRecord) -> Orders:
    """Order and causes of two records, on the firings that both have."""
    shared = [firing for firing in one.times if firing in other.times]
    differing = sum(one.causes[f] != other.causes[f] for f in shared)
    chosen = shared[:MOST]
    related: Truth = _related(chosen, one)
    first, second = _signs(chosen, one), _signs(chosen, other)
    apart = (first != 0) & (second != 0) & ~related
    upper = np.triu(apart, 1)
    return Orders(int((upper & (first != second)).sum()), int(upper.sum()), differing)


def differences(one: CausalRecord, other: CausalRecord) -> Array:
    """Time in `other` less time in `one` of every firing that both have [s]."""
    shared = [firing for firing in one.times if firing in other.times]
    return np.array([other.times[f] - one.times[f] for f in shared])


def durations(record: CausalRecord) -> dict[Firing, float]:
    """X_e - X_s [s] of each operation, by the firing of its end, where both are in the record."""
    spent = {}
    for (name, n), time in record.times.items():
        begun = record.times.get((f"{name[:-2]}_s", n)) if name.endswith("_e") else None
        if begun is not None:
            spent[name, n] = time - begun
    return spent


def duration_differences(one: CausalRecord, other: CausalRecord) -> Array:
    """Duration in `other` less that in `one`, of every operation that both have [s]."""
    first, second = durations(one), durations(other)
    return np.array([second[f] - first[f] for f in first if f in second])


def _related(firings: Sequence[Firing], record: CausalRecord) -> Truth:
    """Whether two firings are causally related (n, n)."""
    place = {firing: i for i, firing in enumerate(firings)}
    before = np.zeros((len(firings), len(firings)), bool)
    for i, firing in enumerate(firings):
        causes = [place[cause] for cause in record.causes[firing] if cause in place]
        before[i, causes] = True
        before[i] |= before[causes].any(axis=0)
    return np.logical_or(before, before.T)


def _signs(firings: Sequence[Firing], record: CausalRecord) -> Array:
    times = np.array([record.times[firing] for firing in firings])
    return np.asarray(np.sign(times[:, None] - times[None, :]))
