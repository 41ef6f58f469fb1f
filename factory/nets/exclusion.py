"""Which places of a marked graph are never marked together, and order places that make them so.

Two safe places p and q of a live marked graph are never marked together where some circuit through
both carries one token, and only there: max m(p) + m(q) over the reachable markings is the least
number of tokens of circulations that cover p and q, and every circuit has a token. A sequence of
firings that fires each transition once and leads back to the marking orders p and q where they are
never marked together in it: with a place from the output of p to the input of q and one back, empty
where the one fires before the other in the sequence, the sequence can still fire, so the net stays
live and reversible; both new places lie on a circuit with one token, so they are safe.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from factory.nets.marked import MANY, NONE, MarkedNet
from factory.nets.petri import PetriNet, Place

ORDER = "order"
"""The mode of an order place."""

Pair = tuple[int, int]
"""Two places, by index."""

Circuit = tuple[int, ...]
"""Places, each of which leads from its producer to that of the next, cyclically."""


def excluding(net: MarkedNet, pairs: Iterable[Pair]) -> list[Circuit | None]:
    """For each pair of different places of a live marked graph a circuit through both that carries
    one token: the proof that they are never marked together. None where there is no such circuit.

    Linear in the net for each place that is in some pair. Raises ValueError where the net is no
    marked graph.
    """
    return _Paths(net).circuits([*pairs])


@dataclass(frozen=True, slots=True)
class Ordered:
    """A live marked graph `net` with order places, the last of its places, and what they are for.

    `places`: by each pair that they order the order places that it asked for, which may be none
    where all are implied by others. `overlapping`: the pairs that the sequence marks together, for
    which there is no order place.
    """

    net: MarkedNet
    places: Mapping[Pair, tuple[int, ...]]
    overlapping: tuple[Pair, ...] = field(default=())


def ordered(
    net: MarkedNet,
    sequence: Sequence[int],
    pairs: Iterable[Pair],
    earlier: Mapping[int, int] = MappingProxyType({}),
) -> Ordered:
    """The net with the order places by which none of the pairs is ever marked together, but for
    those that the sequence marks together itself. An order place that others imply is left out.

    `sequence`: each transition once, as they can fire one after the other from the initial marking.
    `earlier`: by transitions that cannot wait one before each, with no token in between, that can;
    order places lead to that where the sequence lets them. Raises ValueError where it is no such
    sequence, or the net no marked graph.
    """
    when = times(net, sequence)
    paths, added = _Paths(net), dict[Pair, list[_Arc]]()
    overlapping = []
    for p, q in dict.fromkeys(pairs):
        if overlap(net, when, (p, q)):
            overlapping.append((p, q))
            continue
        added[p, q] = []
        for both in ((p, q), (q, p)):
            arc = _arc(net, when, both)
            if not paths.implies(arc):
                arc = _brought_forward(arc, when, earlier)
                paths.add(arc)
                added[p, q].append(arc)
    kept = list[_Arc]()
    for arc in [arc for arcs in added.values() for arc in arcs]:
        paths.remove(arc)
        if not paths.implies(arc):
            paths.add(arc)
            kept.append(arc)
    number = {arc: len(net.net.places) + n for n, arc in enumerate(kept)}
    places = {
        pair: tuple(number[arc] for arc in arcs if arc in number) for pair, arcs in added.items()
    }
    return Ordered(_with_order(net, kept), places, tuple(overlapping))


@dataclass(frozen=True, slots=True)
class _Arc:
    """A way from one transition to another with so many tokens, along a place or an order place
    that is yet to be made for a pair."""

    before: int
    after: int
    tokens: int
    of: int | Pair


class _Paths:
    """The ways between the transitions of a marked graph, to which further ones can be added."""

    def __init__(self, net: MarkedNet) -> None:
        if not net.is_marked_graph:
            raise ValueError("only a marked graph has circuits that exclude places")
        self._net = net
        self._out: list[list[_Arc]] = [[] for _ in net.net.transitions]
        ends = zip(net.left, net.right, net.tokens, strict=True)
        for place, (before, after, tokens) in enumerate(ends):
            if before != NONE and after != NONE:
                self.add(_Arc(before, after, tokens, place))

    def add(self, arc: _Arc) -> None:
        self._out[arc.before].append(arc)

    def remove(self, arc: _Arc) -> None:
        self._out[arc.before].remove(arc)

    def implies(self, arc: _Arc) -> bool:
        """Whether some path between the same transitions has no more tokens."""
        return arc.after in self.least(arc.before, {arc.after}, arc.tokens)

    def circuits(self, pairs: Sequence[Pair]) -> list[Circuit | None]:
        """As `excluding`, a search for each transition that a place of some pair leads to."""
        net, goals = self._net, dict[int, set[int]]()
        for pair in pairs:
            for p, q in (pair, pair[::-1]):
                if net.right[p] != NONE and net.left[q] != NONE:
                    goals.setdefault(net.right[p], set()).add(net.left[q])
        paths = {source: self.least(source, wanted, 1) for source, wanted in goals.items()}
        return [self._circuit(pair, paths) for pair in pairs]

    def _circuit(
        self, pair: Pair, paths: Mapping[int, Mapping[int, tuple[int, Circuit]]]
    ) -> Circuit | None:
        net, circuit, total = self._net, list[int](), 0
        for p, q in (pair, pair[::-1]):
            tokens, path = paths.get(net.right[p], {}).get(net.left[q], (MANY, ()))
            if tokens == MANY:
                return None
            circuit += [p, *path]
            total += net.tokens[p] + tokens
        return tuple(circuit) if total == 1 else None

    def least(self, source: int, goals: set[int], most: int) -> dict[int, tuple[int, Circuit]]:
        """By those of the goals to which some path from a transition has no more than so many
        tokens: the least number of tokens, and the places of such a path. A 0-1 search."""
        tokens, arrived = {source: 0}, dict[int, _Arc]()
        queue, done, left = deque([source]), set[int](), set(goals)
        while queue and left:
            event = queue.popleft()
            if event in done:
                continue
            done.add(event)
            left.discard(event)
            for arc in self._out[event]:
                there = tokens[event] + arc.tokens
                if there <= most and there < tokens.get(arc.after, most + 1):
                    tokens[arc.after], arrived[arc.after] = there, arc
                    (queue.append if arc.tokens else queue.appendleft)(arc.after)
        return {goal: (tokens[goal], _back(arrived, source, goal)) for goal in goals & done}


def _back(arrived: Mapping[int, _Arc], source: int, goal: int) -> Circuit:
    """The places of the path by which a search has come to a goal; none for order places that are
    yet to be made."""
    path = list[int]()
    while goal != source:
        arc = arrived[goal]
        if isinstance(arc.of, int):
            path.append(arc.of)
        goal = arc.before
    return tuple(reversed(path))


def times(net: MarkedNet, sequence: Sequence[int]) -> list[int]:
    """When each transition fires in a sequence that fires each once, from the initial marking.
    Raises ValueError where it is no such sequence."""
    when = [-1] * len(net.net.transitions)
    for time, event in enumerate(sequence):
        when[event] = time
    fits = len(sequence) == len(when) and -1 not in when
    for before, after, tokens in zip(net.left, net.right, net.tokens, strict=True):
        joined = before != NONE and after != NONE
        fits = fits and (not joined or tokens >= 1 or when[before] < when[after])
    if not fits:
        raise ValueError("the sequence does not fire each transition once from the marking")
    return when


def overlap(net: MarkedNet, when: Sequence[int], pair: Pair) -> bool:
    """Whether two places are marked together at some time of a sequence that returns to the
    marking: one is where the other becomes marked."""
    p, q = pair
    return marked_after(net, when, p, net.left[q]) or marked_after(net, when, q, net.left[p])


def marked_after(net: MarkedNet, when: Sequence[int], place: int, event: int) -> bool:
    """Whether a place is marked directly after a transition in such a sequence: from its producer
    on to its consumer, which may be in the next round."""
    begin, end, now = when[net.left[place]], when[net.right[place]], when[event]
    return begin <= now < end if begin < end else now >= begin or now < end


def _arc(net: MarkedNet, when: Sequence[int], pair: Pair) -> _Arc:
    """The order place from the first place of a pair to the second."""
    before, after = net.right[pair[0]], net.left[pair[1]]
    return _Arc(before, after, int(when[before] > when[after]), pair)


def _brought_forward(arc: _Arc, when: Sequence[int], earlier: Mapping[int, int]) -> _Arc:
    """The same to a transition that can wait, where that is in the same order."""
    start = earlier.get(arc.after, arc.after)
    in_order = int(when[arc.before] > when[start]) == arc.tokens
    return replace(arc, after=start) if in_order else arc


def _with_order(net: MarkedNet, arcs: Sequence[_Arc]) -> MarkedNet:
    names = net.net.places
    new = tuple(
        Place(_named(names, arc), (arc.before,), (arc.after,), ORDER, size=0) for arc in arcs
    )
    return MarkedNet(
        PetriNet(net.net.transitions, (*names, *new)),
        (*net.tokens, *(arc.tokens for arc in arcs)),
        net.gears,
        (*net.slots, *((),) * len(new)) if net.slots else (),
    )


def _named(places: Sequence[Place], arc: _Arc) -> str:
    assert isinstance(arc.of, tuple)
    return ":".join([ORDER, *(places[p].name for p in arc.of)])
