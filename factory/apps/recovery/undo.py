"""Failures: the marking of how often each transition still has fired.

The state of a live gear train is n, how often each transition has fired; its marking is
m = m_0 + C n. To undo a set D of transitions is to go on from the greatest n' <= n with
n'(t) <= n(t) - 1 on D, m_0 + C n' >= 0, and the *material* rule: nothing is taken apart, so where
an end is undone, what made the things that it joined is undone at least as often.

Each condition bounds one count by another plus a constant that is not negative, so the greatest n'
is unique, and one search finds it, least counts first.

Theorem 5 (return). m_0 + C n' >= 0 is reachable from m_0, as it is in any live marked graph (Murata
1989, Theorem 21), so the net is as live, safe and reversible as before.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from heapq import heapify, heappop, heappush

from factory.api import GearNet, MarkedNet, Marking


def undo(
    net: GearNet | MarkedNet,
    fired: Sequence[int],
    asked: Iterable[int],
    joins: Mapping[int, tuple[int, ...]],
) -> tuple[int, ...]:
    """n': how often each transition still has fired, where each that is `asked` for is undone as
    often as it stands there, or oftener.

    `fired` is n, counted from m_0: from another marking on, those of `history.firings` are to be
    added. Linear in what is undone, but for the order. Raises ValueError where a transition has not
    fired so often as is asked, or no transition is asked for.
    """
    least = Counter(asked)
    if not least:
        raise ValueError("no transition is asked to be undone")
    return _greatest(MarkedNet.of(net), fired, least, joins)


def tokens_after(net: GearNet | MarkedNet, fired: Sequence[int]) -> tuple[int, ...]:
    """m_0 + C n: the number of tokens of each place, negative where the counts lead nowhere."""
    subject = MarkedNet.of(net)
    pairs = zip(subject.tokens, subject.net.places, strict=True)
    return tuple(
        tokens + sum(fired[e] for e in place.left) - sum(fired[e] for e in place.right)
        for tokens, place in pairs
    )


def marking_after(net: GearNet, fired: Sequence[int]) -> Marking:
    """m_0 + C n, for counts that lead to a marking."""
    return frozenset(place for place, count in enumerate(tokens_after(net, fired)) if count)


def _greatest(
    net: MarkedNet, fired: Sequence[int], asked: Counter[int], joins: Mapping[int, tuple[int, ...]]
) -> tuple[int, ...]:
    """The greatest counts that meet the conditions. Each is settled when it comes off the heap,
    since no condition bounds a count by less than another."""
    counts = list(fired)
    for event, times in asked.items():
        counts[event] -= times
        if counts[event] < 0:
            name = net.net.transitions[event].name
            raise ValueError(f"{name} is to be undone {times} times, and has fired {fired[event]}")
    heap = [(counts[event], event) for event in asked]
    heapify(heap)
    right, postset = net.right, net.net.postset
    while heap:
        count, event = heappop(heap)
        if count > counts[event]:
            continue
        bounds: list[tuple[int, int]] = [(right[p], count + net.tokens[p]) for p in postset[event]]
        undone = fired[event] - count
        bounds += [(made, fired[made] - undone) for made in joins.get(event, ())]
        for other, bound in bounds:
            if other >= 0 and counts[other] > bound:
                counts[other] = bound
                heappush(heap, (bound, other))
    return tuple(counts)
