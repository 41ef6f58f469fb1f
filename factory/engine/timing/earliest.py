"""The earliest firings of a timed marked graph: dates by max-plus recursion, period by period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from factory.support.arrays import Array
from factory.theory.nets.marked import NONE, MarkedNet


def earliest_firings(
    net: MarkedNet,
    seconds: Sequence[float],
    count: int,
    first: Mapping[int, float] = MappingProxyType({}),
    ready: Mapping[int, float] = MappingProxyType({}),
) -> Array:
    """(count, T): dates of the first `count` firings of every transition [s].

    The k-th firing takes the k-th token of each place before it: an initial token, available at
    time 0 or at `ready[p]`, or the token of the producer's firing k - tokens, available
    `seconds[p]` later; `first[p]` is the delay of the first such token if it differs. Raises
    ValueError if the net is not a live marked graph."""
    free = net.token_free
    fed = all(b != NONE or a == NONE for b, a in zip(net.left, net.right, strict=True))
    if not (fed and net.is_marked_graph) or free.stuck:
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
