"""Earliest firing dates of the transitions of a timed marked graph (max-plus dates)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from factory.nets.marked import MarkedNet, dead_ends, token_free

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Firings:
    """`dates` (n, T): date of the k-th firing of each transition [s], from the initial marking at
    time 0. From the k-th to the (k + `period`)-th firing it takes `advance` [s], for all k from
    `settled` on; None if that does not hold within n firings."""

    dates: Floats = field(repr=False)
    settled: int | None
    period: int
    advance: float


def earliest_firings(
    net: MarkedNet,
    seconds: Sequence[float],
    count: int,
    first: Mapping[int, float] = MappingProxyType({}),
    ready: Mapping[int, float] = MappingProxyType({}),
) -> Floats:
    """(count, T): dates of the first `count` firings of every transition [s].

    The k-th firing takes the k-th token of each place before it: an initial token, available at
    time 0 or at `ready[p]`, or the token of the producer's firing k - tokens, available
    `seconds[p]` later; `first[p]` is the delay of the first such token if it differs. Raises
    ValueError if the net is not a live marked graph."""
    free = token_free(net)
    if not net.is_marked_graph or free.stuck or dead_ends(net):
        raise ValueError("only a live marked graph fires for ever")
    needs = [
        (
            event,
            [
                (
                    net.left[p],
                    net.tokens[p],
                    float(seconds[p]),
                    float(first.get(p, seconds[p])),
                    float(ready.get(p, 0.0)),
                )
                for p in net.net.preset[event]
            ],
        )
        for event in free.order
    ]
    dates = [[0.0] * len(net.net.transitions) for _ in range(count)]
    for k, row in enumerate(dates):
        for event, places in needs:
            latest = 0.0
            for before, tokens, delay, start, begun in places:
                if k >= tokens:
                    latest = max(
                        latest, dates[k - tokens][before] + (start if k == tokens else delay)
                    )
                else:
                    latest = max(latest, begun)
            row[event] = latest
    return np.array(dates).reshape(count, len(net.net.transitions))


def settled_firings(
    net: MarkedNet,
    seconds: Sequence[float],
    ratio: float,
    period: int,
    least: int,
    first: Mapping[int, float] = MappingProxyType({}),
    ready: Mapping[int, float] = MappingProxyType({}),
    work: int = 4_000_000,
) -> Firings:
    """At least `least` firings, until all repeat every `period` firings with `ratio` seconds for
    each; their number is doubled until then, as far as `work` steps allow."""
    count = max(least, 8 * period, 16)
    most = max(count, work // max(1, len(net.tokens)))
    while True:
        dates = earliest_firings(net, seconds, count, first, ready)
        apart = dates[period:] - dates[:-period] - ratio * period
        restless = np.flatnonzero(np.abs(apart).max(axis=1) > 1e-9 * (1.0 + dates.max()))
        settled = int(restless[-1]) + 1 if len(restless) else 0
        if settled <= count - 4 * period:
            return Firings(dates, settled, period, ratio * period)
        if count >= most:
            return Firings(dates, None, period, ratio * period)
        count = min(2 * count, most)
