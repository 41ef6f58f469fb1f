"""Nets with tokens on their places, and marked graphs.

A marked graph is a net in which every place has at most one producer and at most one consumer
(Commoner, Holt, Even and Pnueli, 1971; here a place may lack either). Tokens move by the
place/transition rule; on a safe net that is Definition 3.4, except that a transition with a place
in both its preset and its postset never fires (a 1-gear is dead by Definition 3.4, condition 1).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, MutableSequence, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

from factory.support.errors import listing
from factory.support.showing import Pictured
from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.petri import PetriNet
from factory.theory.problem.ids import TransitionId

NONE = TransitionId(-1)
"""The producer or consumer of a place that has none."""
MANY = TransitionId(-2)
"""The producer or consumer of a place that has several."""

FEW = 8
"""The gears through a place are collected in a list from so many on."""


@dataclass(frozen=True)
class MarkedNet(Pictured):
    """A Petri net (T, P) with an initial marking m_0, which may have choice (Definitions 3.1 and
    3.2).

    Attributes:
        net: the net.
        tokens: number of tokens of each place.
        gears: gears that are claimed; () where none are known.
        slots: as in `GearNet`, or ().

    Raises ValueError where tokens and places differ in number, or a number is negative.
    """

    NONE: ClassVar[TransitionId] = NONE
    MANY: ClassVar[TransitionId] = MANY

    net: PetriNet
    tokens: tuple[int, ...]
    gears: tuple[Gear, ...] = ()
    slots: tuple[tuple[int, ...], ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if len(self.tokens) != len(self.net.places) or min(self.tokens, default=0) < 0:
            raise ValueError("one number of tokens, not negative, is needed for each place")

    def __repr__(self) -> str:
        counts = f"{len(self.tokens)} places, {len(self.net.transitions)} transitions"
        return f"<MarkedNet: {counts}, {sum(self.tokens)} tokens>"

    @cached_property
    def left(self) -> tuple[TransitionId, ...]:
        """For each place its producer, NONE or MANY."""
        return tuple(_only(place.left) for place in self.net.places)

    @cached_property
    def right(self) -> tuple[TransitionId, ...]:
        """For each place its consumer, NONE or MANY."""
        return tuple(_only(place.right) for place in self.net.places)

    @classmethod
    def of(cls, net: GearNet | MarkedNet) -> MarkedNet:
        """A net with its initial tokens. A place that `initial` names for each robot in its slots
        has one token; for each further time that it is named, one more."""
        if isinstance(net, MarkedNet):
            return net
        tokens = [0] * len(net.threaded.places)
        for place, named in Counter(net.initial).items():
            owners = max(1, len(net.slots[place]))
            tokens[place] = max(1, named - owners + 1)
        return cls(net.threaded.net, tuple(tokens), net.gears, net.slots)

    @cached_property
    def token_free(self) -> TokenFree:
        """The topological order of a marked graph along its places without tokens. Linear."""
        waits = [0] * len(self.net.transitions)
        free = [not tokens for tokens in self.tokens]
        for event in self.blocked:
            waits[event] = 1
        for place, event in enumerate(self.right):
            if free[place] and event != NONE:
                waits[event] += 1
        order = [TransitionId(event) for event, count in enumerate(waits) if not count]
        right, postset = self.right, self.net.postset
        for event in order:
            for place in postset[event]:
                after = right[place]
                if free[place] and after != NONE:
                    waits[after] -= 1
                    if not waits[after]:
                        order.append(after)
        return TokenFree(tuple(order), tuple(e for e, count in enumerate(waits) if count))

    def stuck_circuit(self, stuck: Iterable[int]) -> tuple[int, ...]:
        """The places of a circuit that never carries a token, where transitions are stuck: free of
        tokens, or one place that its transition both needs and gives back, or alone one that has
        neither token nor producer."""
        import networkx as nx  # only a net that is stuck pays for it

        never, waits = frozenset(stuck), nx.DiGraph()
        for event in sorted(never):
            for place in self.net.preset[event]:
                before = self.left[place]
                if before == event or (before == NONE and not self.tokens[place]):
                    return (place,)
                if before in never and not self.tokens[place]:
                    waits.add_edge(before, event, place=place)
        return tuple(waits.edges[edge]["place"] for edge in nx.find_cycle(waits))

    def notation(self, place: int) -> str:
        """A place as the paper writes it: [a, b; c]."""
        at, events = self.net.places[place], self.net.transitions
        before, after = (listing(events[e].name for e in side) for side in (at.left, at.right))
        return f"[{before}; {after}]"

    @property
    def is_marked_graph(self) -> bool:
        """Whether no place has several producers or several consumers."""
        return MANY not in self.left and MANY not in self.right

    @cached_property
    def blocked(self) -> frozenset[TransitionId]:
        """The transitions with a place in both preset and postset: they never fire."""
        both = (set(p.left) & set(p.right) for p in self.net.places if p.left and p.right)
        return frozenset(event for events in both for event in events)

    @cached_property
    def owners(self) -> tuple[tuple[int, ...], ...]:
        """For each place the gears through it, as indices."""
        owners: list[tuple[int, ...]] = [()] * len(self.net.places)
        shared: dict[int, list[int]] = {}
        for number, gear in enumerate(self.gears):
            alone = (number,)
            for place in gear.places:
                on = owners[place]
                if len(on) < FEW:
                    owners[place] = on + alone
                else:
                    shared.setdefault(place, [*on]).append(number)
        for several, gears in shared.items():
            owners[several] = tuple(gears)
        return tuple(owners)

    def fire(self, tokens: MutableSequence[int], event: int) -> None:
        """Move the tokens of a transition, whether or not it is enabled."""
        for p in self.net.preset[event]:
            tokens[p] -= 1
        for p in self.net.postset[event]:
            tokens[p] += 1

    def after(self, firing: Iterable[int]) -> list[int]:
        """The tokens after a firing sequence from m_0."""
        tokens = list(self.tokens)
        for event in firing:
            self.fire(tokens, event)
        return tokens

    def enabled(self, tokens: Sequence[int]) -> Iterator[int]:
        """The transitions that tokens enable."""
        for event, needs in enumerate(self.net.preset):
            if event not in self.blocked and all(tokens[p] for p in needs):
                yield event

    def with_gears(self, gears: tuple[Gear, ...]) -> MarkedNet:
        """The net with gears, and sizes and slots of its places that fit them."""
        slots = replace(self, gears=gears).owners
        pairs = zip(self.net.places, slots, strict=True)
        places = tuple(replace(place, size=len(on)) for place, on in pairs)
        return MarkedNet(replace(self.net, places=places), self.tokens, gears, slots)

    def cover(self, closed: Iterable[bool]) -> list[int]:
        """For each place a gear through it that has at most one token and keeps it, or NONE;
        `closed`: whether each gear is a cycle of the net."""
        covered: list[int] = [NONE] * len(self.tokens)
        for number, (gear, good) in enumerate(zip(self.gears, closed, strict=False)):
            if good and sum(self.tokens[p] for p in gear.places) <= 1:
                for place in gear.places:
                    covered[place] = number
        return covered


def _only(events: tuple[TransitionId, ...]) -> TransitionId:
    if len(events) == 1:
        return events[0]
    return MANY if events else NONE


@dataclass(frozen=True, slots=True)
class TokenFree:
    """The transitions of a marked graph, ordered along its token-free places.

    `order` holds the transitions that token-free places lead to in no circuit, each after those it
    waits for; `stuck` those that never fire.
    """

    order: tuple[int, ...]
    stuck: tuple[int, ...]


def breadth_first(beside: Sequence[Sequence[int]], onward: Sequence[int]) -> dict[int, int]:
    """By which place each transition but the first is reached from that, in breadth-first order.
    `beside`: the places after (or before) each transition; `onward`: the consumer (or producer) of
    each place."""
    tree, reached, queue = dict[int, int](), {0, NONE}, [0]
    for event in queue:
        for place in beside[event]:
            if onward[place] not in reached:
                reached.add(onward[place])
                tree[onward[place]] = place
                queue.append(onward[place])
    return tree


def least_tokens(net: MarkedNet, source: int) -> list[int | None]:
    """For each transition the least number of tokens on a path to it from `source`, None where
    there is no path (marked graphs). One search by levels: a 0-1 BFS where m_0 is safe."""
    least: list[int | None] = [None] * len(net.net.transitions)
    levels = {0: [source]}
    right, tokens, postset = net.right, net.tokens, net.net.postset
    while levels:
        level = min(levels)
        for event in levels[level]:
            if least[event] is not None:
                continue
            least[event] = level
            for p in postset[event]:
                if right[p] != NONE and least[right[p]] is None:
                    levels.setdefault(level + tokens[p], []).append(right[p])
        del levels[level]
    return least
