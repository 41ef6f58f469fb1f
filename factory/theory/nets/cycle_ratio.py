"""The maximum cycle ratio of a live marked graph, by Howard's policy iteration.

Each transition follows one of the places it waits for (its policy). The best circuit that the
policies run into gives a ratio r and a date v(e) for every transition, the longest way to it from
that circuit in seconds less r per token. Where some other place would give a later date, its
transition follows that one instead. When none does,

    v(after) >= v(before) + seconds - r * tokens    for every place,

which proves that no circuit has more than r seconds per token: sum it around one (Cochet-Terrasson,
Cohen, Gaubert, McGettrick and Quadrat, 1998). In practice a few dozen linear passes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from factory.support.arrays import Array, Index
from factory.theory.nets.components import strong_components
from factory.theory.nets.marked import NONE, MarkedNet

ROUNDING = 1e-12
"""Relative tolerance of dates."""


@dataclass(frozen=True)
class CycleRatio:
    """The greatest quotient of seconds and tokens over all circuits, with its proof.

    Attributes:
        seconds: the ratio r [s].
        circuit: the places of a circuit that attains it, in order.
        dates: v, a date of each transition (transitions,) [s]; 0 in parts of the net without
            circuits.
        edges: the places that lie on circuits (E,).
        before, after: their transitions (E,).
        reduced: by how much each of them could take longer until v is no proof any more (E,)
            [s].
    """

    seconds: float
    circuit: tuple[int, ...]
    dates: Array = field(repr=False)
    edges: Index = field(repr=False)
    before: Index = field(repr=False)
    after: Index = field(repr=False)
    reduced: Array = field(repr=False)

    @cached_property
    def tolerance(self) -> float:
        """Greatest duration that counts as zero [s]."""
        return 1e-9 * (1.0 + float(np.abs(self.dates).max(initial=0.0)))


def max_cycle_ratio(net: MarkedNet, seconds: Sequence[float]) -> CycleRatio:
    """The maximum cycle ratio of a live marked graph whose place p keeps a token for `seconds[p]`.

    Raises ValueError where the net is no marked graph, has no circuit or is not live.
    """
    if not net.is_marked_graph or net.token_free.stuck:
        raise ValueError("only a live marked graph has a cycle time")
    graph = _Graph(net, seconds)
    if not len(graph.places):
        raise ValueError("the net has no circuit")
    graph.evaluate()
    while graph.improve():
        graph.evaluate()
    ratio, circuit = max(graph.circuits, key=lambda pair: pair[0])
    dates = graph.dates - graph.dates.min()
    slack = dates[graph.after] - dates[graph.before] - graph.seconds + ratio * graph.tokens
    places = tuple(int(graph.places[e]) for e in circuit)
    return CycleRatio(
        ratio, places, dates, graph.places, graph.before, graph.after, np.maximum(slack, 0.0)
    )


class _Graph:
    """The places on circuits as edges between transitions, and the state of the iteration."""

    def __init__(self, net: MarkedNet, seconds: Sequence[float]) -> None:
        before, after = np.array(net.left, np.intp), np.array(net.right, np.intp)
        size = len(net.net.transitions)
        joined = (before != NONE) & (after != NONE)
        self.part = strong_components(size, before[joined], after[joined])
        inside = np.flatnonzero(joined)
        self.places: Index = inside[self.part[before[inside]] == self.part[after[inside]]]
        self.before, self.after = before[self.places], after[self.places]
        self.seconds = np.asarray(seconds, float)[self.places]
        self.tokens = np.array(net.tokens, float)[self.places]
        self.dates = np.zeros(size)
        self.ratio = np.full(size, -1.0)
        self.policy = np.full(size, NONE, np.intp)
        longest = np.argsort(self.seconds, kind="stable")
        self.policy[self.after[longest]] = longest
        self.nodes: list[int] = np.unique(self.after).tolist()
        self.circuits: list[tuple[float, list[int]]] = []
        self.outward: list[list[int]] = [[] for _ in range(size)]
        for edge, event in enumerate(self.before.tolist()):
            self.outward[event].append(edge)

    def evaluate(self) -> None:
        """The best circuit of each part, and dates along the ways from it; a transition that
        follows another circuit is made to follow this one."""
        best: dict[int, tuple[float, list[int]]] = {}
        for circuit in self._followed():
            ratio = float(self.seconds[circuit].sum() / self.tokens[circuit].sum())
            part = int(self.part[self.after[circuit[0]]])
            if part not in best or ratio > best[part][0]:
                best[part] = ratio, circuit
        self.circuits = list(best.values())
        for ratio, circuit in self.circuits:
            self._date(ratio, int(self.after[circuit[-1]]))

    def _followed(self) -> list[list[int]]:
        """The circuits that the policies run into, as edges in order."""
        policy, before = self.policy.tolist(), self.before.tolist()
        seen: dict[int, int] = {}
        circuits = []
        for start in self.nodes:
            event = start
            while event not in seen:
                seen[event] = start
                event = before[policy[event]]
            if seen[event] == start:
                edges = [policy[event]]
                while before[edges[-1]] != event:
                    edges.append(policy[before[edges[-1]]])
                circuits.append(edges[::-1])
        return circuits

    def _date(self, ratio: float, root: int) -> None:
        """Dates from the root on: along the policies first, and along any place to what they do not
        reach. The root keeps its own, so that dates only ever grow while the ratio stays."""
        weight = (self.seconds - ratio * self.tokens).tolist()
        policy, after = self.policy.tolist(), self.after.tolist()
        dates, reached, queue = {root: float(self.dates[root])}, {root}, [root]
        for follow in (True, False):
            for event in queue:
                for edge in self.outward[event]:
                    there = after[edge]
                    if there not in reached and (policy[there] == edge or not follow):
                        reached.add(there)
                        queue.append(there)
                        self.policy[there] = edge
                        dates[there] = dates[event] + weight[edge]
        events = list(dates)
        self.dates[events] = list(dates.values())
        self.ratio[events] = ratio

    def improve(self) -> bool:
        """Let each transition follow the place with the latest date; whether any policy has
        changed."""
        ratio = self.ratio[self.after]
        dates = self.dates[self.before] + self.seconds - ratio * self.tokens
        gain = dates - self.dates[self.after]
        least = ROUNDING * (1.0 + float(np.abs(self.dates).max()) + float(self.seconds.max()))
        better = np.flatnonzero(gain > least)
        better = better[np.argsort(gain[better], kind="stable")]
        self.policy[self.after[better]] = better
        return bool(len(better))
