"""The strongly connected components of a directed graph, in linear time (Kosaraju and Sharir).

SciPy has them too; to import its sparse matrices takes longer than this does for 10,000 nodes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.intp]

NONE = -1


def strong_components(size: int, before: Index, after: Index) -> Index:
    """The component of each node (size,) of a graph with edges (n,) from `before` to `after`, named
    by one of its nodes."""
    forward, backward = _neighbours(size, before, after), _neighbours(size, after, before)
    component = [NONE] * size
    for root in reversed(_finished(forward)):
        reached = [root] if component[root] == NONE else []
        for node in reached:
            if component[node] == NONE:
                component[node] = root
                reached += [other for other in backward[node] if component[other] == NONE]
    return np.array(component, np.intp)


def _neighbours(size: int, before: Index, after: Index) -> list[list[int]]:
    neighbours: list[list[int]] = [[] for _ in range(size)]
    for one, other in zip(before.tolist(), after.tolist(), strict=True):
        neighbours[one].append(other)
    return neighbours


def _finished(forward: list[list[int]]) -> list[int]:
    """The nodes in the order in which a search in depth has finished with them."""
    order, seen = list[int](), bytearray(len(forward))
    for root in range(len(forward)):
        path = [] if seen[root] else [(root, iter(forward[root]))]
        seen[root] = 1
        while path:
            node, ahead = path[-1]
            following = next((other for other in ahead if not seen[other]), NONE)
            if following == NONE:
                order.append(node)
                path.pop()
            else:
                seen[following] = 1
                path.append((following, iter(forward[following])))
    return order
