"""The state space of a small net, marking by marking: what no proof is used for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from factory.theory.nets.marked import MarkedNet

Marking = tuple[int, ...]
"""The tokens of each place."""


@dataclass(frozen=True)
class Truth:
    """What exploring every marking says."""

    markings: tuple[Marking, ...]
    live: bool
    safe: bool
    reversible: bool

    @property
    def behaviour(self) -> tuple[bool, bool, bool]:
        """Live, safe and reversible."""
        return self.live, self.safe, self.reversible


def explored(net: MarkedNet, limit: int = 3_000, most: int = 6) -> Truth | None:
    """Every marking that is reached by the place/transition rule; None beyond `limit` markings, or
    more than `most` tokens on a place.

    A net is live where every transition fires in every component of markings that nothing leaves,
    reversible where there is just one component."""
    events = range(len(net.net.transitions))
    preset, postset = net.net.preset, net.net.postset
    fires = [event for event in events if not set(preset[event]) & set(postset[event])]
    number = {tuple(net.tokens): 0}
    markings = [*number]
    edges: list[tuple[int, int, int]] = []
    for here, marking in enumerate(markings):
        for event in fires:
            if not all(marking[p] for p in preset[event]):
                continue
            tokens = list(marking)
            for p in preset[event]:
                tokens[p] -= 1
            for p in postset[event]:
                tokens[p] += 1
            there = tuple(tokens)
            if there not in number:
                if max(there) > most or len(markings) >= limit:
                    return None
                number[there] = len(markings)
                markings.append(there)
            edges.append((here, event, number[there]))
    before, fired, after = np.array(edges, np.intp).reshape(-1, 3).T
    graph = csr_array((np.ones(len(before), bool), (before, after)), (len(markings),) * 2)
    count, part = connected_components(graph, connection="strong")
    bottoms = {*range(count)} - {*part[before[part[before] != part[after]]].tolist()}
    live = all(len({*fired[part[before] == bottom].tolist()}) == len(events) for bottom in bottoms)
    safe = all(max(marking, default=0) <= 1 for marking in markings)
    return Truth(tuple(markings), live, safe, count == 1)
