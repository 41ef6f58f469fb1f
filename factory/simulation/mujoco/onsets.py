"""Onsets of contact that nothing intends."""

from __future__ import annotations

from collections.abc import Callable


class Onsets:
    """`pairs`: the pairs of geoms, by name, in the order of time; `begun`: time of the first onset
    [s]. `name` gives a geom's name."""

    def __init__(self, name: Callable[[int], str]) -> None:
        self.pairs: list[tuple[str, str]] = []
        self.begun: float | None = None
        self._name = name
        self._touching: frozenset[tuple[int, int]] = frozenset()

    def note(self, now: set[tuple[int, int]], t: float) -> None:
        """Record the touching pairs of geoms at a time [s], after a step of the engine."""
        fresh = sorted(now - self._touching)
        if fresh and self.begun is None:
            self.begun = t
        self.pairs += [(self._name(a), self._name(b)) for a, b in fresh]
        self._touching = frozenset(now)

    def apart(self) -> None:
        """Forget which geoms touch."""
        self._touching = frozenset()
