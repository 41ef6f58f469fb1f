"""Stub until the real one is merged."""
from __future__ import annotations
from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True)
class Undone:
    t: float
    operation: str
    reason: str
    asked: tuple[str, ...]
    transitions: tuple[str, ...]

    @classmethod
    def of(cls, net, t, operation, reason, asked, fired, after):
        names = [x.name for x in net.threaded.transitions]
        back = tuple(n for i, n in enumerate(names) for _ in range(fired[i] - after[i]))
        return cls(t, operation, reason, tuple(names[a] for a in asked), back)


def undo(net, fired, asked, joins):
    n = list(fired)
    places = net.threaded.net.places
    init = net.initial_marking
    out = net.threaded.net.postset
    queue = deque()
    for a in asked:
        n[a] -= 1
        queue.append(a)
    while queue:
        a = queue.popleft()
        for p in out[a]:
            for b in places[p].right:
                most = n[a] + (p in init)
                if n[b] > most:
                    n[b] = most
                    queue.append(b)
        for z in joins.get(a, ()):
            most = fired[z] + n[a] - fired[a]
            if n[z] > most:
                n[z] = most
                queue.append(z)
    assert min(n) >= 0
    return tuple(n)


def marking_after(net, fired):
    init = net.initial_marking
    return frozenset(
        p for p, place in enumerate(net.threaded.net.places)
        if (p in init) + fired[place.left[0]] - fired[place.right[0]] > 0
    )
