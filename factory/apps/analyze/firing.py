"""The slack of the places of a timed marked graph: the increase of a delay from which a place sets
the pace."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf

from factory.theory.nets.cycle_ratio import CycleRatio


@dataclass(frozen=True, slots=True)
class Slack:
    """Slack of a place: the seconds by which the tightest circuit through it is shorter than r per
    token, and the places of this circuit in order; infinite, without places, for a place on no
    circuit."""

    seconds: float
    circuit: tuple[int, ...]


def slacks(ratio: CycleRatio, places: Iterable[int]) -> dict[int, Slack]:
    """The slack of each of some places.

    With the reduced times of the proof, which are not negative, the length of a circuit is its
    slack. Dijkstra's shortest path from a place's end back to its beginning gives the tightest
    circuit; one search serves all places that begin at one transition.
    """
    number = {int(place): edge for edge, place in enumerate(ratio.edges)}
    wanted: dict[int, list[int]] = {}
    result: dict[int, Slack] = {}
    for place in places:
        if place in number:
            wanted.setdefault(int(ratio.before[number[place]]), []).append(place)
        else:
            result[place] = Slack(inf, ())
    inward: dict[int, list[int]] = {}
    for edge, event in enumerate(ratio.after.tolist()):
        inward.setdefault(event, []).append(edge)
    for target, chosen in wanted.items():
        distance, onward = _ways_to(ratio, inward, target)
        for place in chosen:
            edge = number[place]
            event = int(ratio.after[edge])
            circuit = [place]
            seconds = distance[event] + float(ratio.reduced[edge])
            while event != target:
                circuit.append(int(ratio.edges[onward[event]]))
                event = int(ratio.after[onward[event]])
            result[place] = Slack(seconds if seconds > ratio.tolerance else 0.0, tuple(circuit))
    return result


def _ways_to(
    ratio: CycleRatio, inward: dict[int, list[int]], target: int
) -> tuple[dict[int, float], dict[int, int]]:
    """Length of the shortest reduced path from every transition to `target`, and its first edge."""
    before, reduced = ratio.before, ratio.reduced
    distance: dict[int, float] = {}
    onward: dict[int, int] = {}
    heap: list[tuple[float, int, int]] = [(0.0, target, -1)]
    while heap:
        way, event, edge = heappop(heap)
        if event in distance:
            continue
        distance[event], onward[event] = way, edge
        for back in inward[event]:
            if int(before[back]) not in distance:
                heappush(heap, (way + float(reduced[back]), int(before[back]), back))
    return distance, onward


def circuits(ratio: CycleRatio, places: Iterable[int]) -> tuple[Slack, ...]:
    """The tightest circuits through some places, each once, the critical ones first."""
    kept: dict[frozenset[int], Slack] = {}
    for slack in slacks(ratio, places).values():
        if slack.circuit:
            kept.setdefault(frozenset(slack.circuit), slack)
    return tuple(sorted(kept.values(), key=lambda slack: (slack.seconds, min(slack.circuit))))
