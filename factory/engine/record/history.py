"""Legal markings of a factory's net other than the initial one, and the firings to them.

A legal marking m of a live marked graph is reached from m_0 if and only if m - m_0 = C n has a
solution n, which says how often each transition fires: no circuit gains or loses tokens (Murata
1989, Theorem 21). In a gear net every legal marking is, since its simple circuits are its gears; in
a gear train some are not, and may be dead.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import breadth_first
from factory.theory.nets.petri import Marking


def firings(net: GearNet, marking: Marking) -> dict[int, int]:
    """The least number of firings of each transition that lead from m_0 to a legal marking.

    Along each gear a place has as many tokens more as its producer fires oftener than its consumer,
    which fixes all counts up to a constant; the least is 0. Such counts can be fired, since no
    circuit is free of tokens. Linear. Raises ValueError where the marking does not mark each gear
    exactly once, where no counts lead to it, or where the gears do not hang together.
    """
    through: dict[int, list[int]] = {}
    for number, gear in enumerate(net.gears):
        if sum(p in marking for p in gear.places) != 1:
            raise ValueError(f"the marking does not mark the gear of {gear.robot} exactly once")
        for event in gear.transitions:
            through.setdefault(event, []).append(number)
    potential: dict[int, int] = {net.gears[0].transitions[0]: 0}
    queue, seen = [0], {0}
    for number in queue:
        _climb(net, number, marking, potential)
        for event in net.gears[number].transitions:
            fresh = [other for other in through[event] if other not in seen]
            queue += fresh
            seen.update(fresh)
    if len(seen) < len(net.gears) or len(potential) < len(net.threaded.transitions):
        raise ValueError("some gear or transition is not connected to the rest")
    least = min(potential.values())
    return {event: potential[event] - least for event in sorted(potential)}


def _climb(net: GearNet, number: int, marking: Marking, potential: dict[int, int]) -> None:
    """Extend the counts along one gear, from a transition that has one."""
    gear, initial = net.gears[number], net.initial_marking
    start = next(i for i, event in enumerate(gear.transitions) if event in potential)
    count = potential[gear.transitions[start]]
    size = len(gear.places)
    for step in range(size):
        place = gear.places[(start + step) % size]
        count += (place in initial) - (place in marking)
        event = gear.transitions[(start + step + 1) % size]
        if potential.setdefault(event, count) != count:
            raise ValueError(f"the gear of {gear.robot} contradicts the others")


def unreached(net: GearNet, marking: Marking) -> tuple[int, ...]:
    """The places of a circuit, in order, whose number of tokens in a marking is not that in m_0; ()
    where there is none. Linear."""
    places, initial = net.threaded.places, net.initial_marking
    left, right = [place.left[0] for place in places], [place.right[0] for place in places]
    gain = [(p in marking) - (p in initial) for p in range(len(places))]
    there = breadth_first(net.threaded.net.postset, right)
    back = breadth_first(net.threaded.net.preset, left)
    level = {0: 0}
    for event, place in there.items():
        level[event] = level[left[place]] + gain[place]
    for place, (a, b) in enumerate(zip(left, right, strict=True)):
        if level[a] + gain[place] != level[b]:
            home = [*_walk(back, b, right)]
            way = [*reversed([*_walk(there, a, left)]), place, *home]
            other = [*reversed([*_walk(there, b, left)]), *home]
            circuits = (c for walk in (way, other) for c in _circuits(walk, left, right))
            return next(circuit for circuit in circuits if sum(gain[p] for p in circuit))
    return ()


def _walk(tree: Mapping[int, int], event: int, toward: Sequence[int]) -> Iterator[int]:
    """The places of a tree between a transition and the first one."""
    while event:
        yield tree[event]
        event = toward[tree[event]]


def _circuits(
    walk: Iterable[int], left: Sequence[int], right: Sequence[int]
) -> Iterator[tuple[int, ...]]:
    """The simple circuits of which a closed walk along places consists."""
    way: list[int] = []
    for place in walk:
        way.append(place)
        starts = [step for step, p in enumerate(way) if left[p] == right[place]]
        if starts:
            yield tuple(way[starts[0] :])
            del way[starts[0] :]
