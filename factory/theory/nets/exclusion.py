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
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from operator import itemgetter
from types import MappingProxyType

from factory.theory.nets.marked import NONE, MarkedNet
from factory.theory.nets.petri import PetriNet, Place
from factory.theory.problem.ids import TransitionId

ORDER = "order"
"""The mode of an order place."""

BLOCK = 4096
"""Number of transitions whose predecessors are found in one pass over a net."""

Pair = tuple[int, int]
"""Two places, or two transitions, by index."""

Circuit = tuple[int, ...]
"""Places, each of which leads from its producer to that of the next, cyclically."""


def excluding(net: MarkedNet, pairs: Iterable[Pair]) -> list[Circuit | None]:
    """For each pair of different places of a live marked graph a circuit through both that carries
    one token: the proof that they are never marked together. None where there is no such circuit.

    Linear in the net for each BLOCK places that are in some pair, and in the lengths of the
    circuits. Raises ValueError where the net is no marked graph.
    """
    return _Paths(net).circuits([*pairs])


@dataclass(frozen=True, slots=True)
class Ordered:
    """A live marked graph `net` with order places, the last of its places, and what they are for.

    `places`: by each pair that they order the order places that it asked for, which may be none
    where all are implied by others.
    """

    net: MarkedNet
    places: Mapping[Pair, tuple[int, ...]]


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
    for p, q in dict.fromkeys(pairs):
        if overlap(net, when, (p, q)):
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
    return Ordered(_with_order(net, kept), places)


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
        """Whether some path between the same transitions has no more tokens. A 0-1 search."""
        tokens, done, queue = {arc.before: 0}, set[int](), deque([arc.before])
        while queue:
            event = queue.popleft()
            if event == arc.after:
                return True
            if event in done:
                continue
            done.add(event)
            for way in self._out[event]:
                there = tokens[event] + way.tokens
                if there <= arc.tokens and there < tokens.get(way.after, arc.tokens + 1):
                    tokens[way.after] = there
                    (queue.append if way.tokens else queue.appendleft)(way.after)
        return False

    def circuits(self, pairs: Sequence[Pair]) -> list[Circuit | None]:
        """As `excluding`: first the tokens of the shortest circuit of each pair, then the places of
        those that carry one."""
        net, ways = self._net, dict[Pair, tuple[Pair, Pair]]()
        for p, q in pairs:
            ways[p, q] = (net.right[p], net.left[q]), (net.right[q], net.left[p])
        asked = (way for both in ways.values() for way in both)
        least = {way: reach.least(way) for reach, some in self._reaches(asked) for way in some}
        tight = {
            (p, q): both
            for (p, q), both in ways.items()
            if net.tokens[p] + net.tokens[q] + least[both[0]] + least[both[1]] == 1
        }
        asked = (way for both in tight.values() for way in both)
        paths = dict[Pair, Circuit]()
        for reach, some in self._reaches(asked):
            for _, to_end in groupby(some, itemgetter(1)):
                steps = dict[Pair, _Arc]()
                paths |= {way: tuple(self._path(way, least[way], reach, steps)) for way in to_end}
        made = {(p, q): (p, *paths[on], q, *paths[back]) for (p, q), (on, back) in tight.items()}
        return [made.get(pair) for pair in pairs]

    def _reaches(self, ways: Iterable[Pair]) -> Iterator[tuple[_Reach, list[Pair]]]:
        """The transitions from which the ends of ways are reached, for BLOCK ends at a time, each
        time with the ways that end there."""
        to_end, order = dict[int, list[Pair]](), self._net.token_free.order[::-1]
        for way in dict.fromkeys(ways):
            to_end.setdefault(way[1], []).append(way)
        ends = [*to_end]
        for first in range(0, len(ends), BLOCK):
            bits = {end: n for n, end in enumerate(ends[first : first + BLOCK])}
            free = [0] * len(self._out)
            for end, n in bits.items():
                free[end] |= (end != NONE) << n
            for event in order:
                for arc in self._out[event]:
                    if not arc.tokens:
                        free[event] |= free[arc.after]
            single = [*free]
            for event in order:
                for arc in self._out[event]:
                    if arc.tokens <= 1:
                        single[event] |= (free if arc.tokens else single)[arc.after]
            yield _Reach(bits, (free, single)), [way for end in bits for way in to_end[end]]

    def _path(
        self, way: Pair, tokens: int, reach: _Reach, steps: dict[Pair, _Arc]
    ) -> Iterator[int]:
        """The places of a path with the least number of tokens; `steps`: the arcs taken so far to
        its end, by the transition and the tokens left there."""
        event, end = way
        while event != end:
            if (arc := steps.get((event, tokens))) is None:
                arc = steps[event, tokens] = next(
                    arc
                    for arc in self._out[event]
                    if arc.tokens <= tokens and reach.leads((arc.after, end), tokens - arc.tokens)
                )
            assert isinstance(arc.of, int), "order places that are yet to be made have no number"
            yield arc.of
            event, tokens = arc.after, tokens - arc.tokens


@dataclass(frozen=True, slots=True)
class _Reach:
    """From which transitions the ends of ways, numbered by `bits`, are reached: for each transition
    the set of these ends, as an integer, along paths without tokens, and along paths with at most
    one."""

    bits: Mapping[int, int]
    sets: tuple[Sequence[int], Sequence[int]]

    def leads(self, way: Pair, tokens: int) -> bool:
        """Whether some path between two transitions has no more than so many tokens."""
        return bool(self.sets[tokens][way[0]] >> self.bits[way[1]] & 1)

    def least(self, way: Pair) -> int:
        """The least number of tokens on a path between two transitions; 2 for two or more, or where
        there is no path."""
        return 2 if way[0] == NONE else next((k for k in (0, 1) if self.leads(way, k)), 2)


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
        Place(
            _named(names, arc),
            (TransitionId(arc.before),),
            (TransitionId(arc.after),),
            ORDER,
            size=0,
        )
        for arc in arcs
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
