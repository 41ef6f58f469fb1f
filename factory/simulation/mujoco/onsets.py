"""Onsets of contact that nothing intends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from factory.simulation.keeping import Keeper, is_text, maybe_size, up_to

MOST_ONSETS = 10**7
"""So many onsets of contact are taken up at most."""


class Onsets:
    """`pairs`: the names of the geoms of each, in the order of time; `begun`: when the first was
    [s]. `name` gives a geom's name."""

    def __init__(self, name: Callable[[int], str]) -> None:
        self.pairs: list[tuple[str, str]] = []
        self.begun: float | None = None
        self._name = name
        self._touching: frozenset[tuple[int, int]] = frozenset()

    def note(self, now: set[tuple[int, int]], t: float) -> None:
        """These pairs of geoms touch at a time [s], after a step of the engine."""
        fresh = sorted(now - self._touching)
        if fresh and self.begun is None:
            self.begun = t
        self.pairs += [(self._name(a), self._name(b)) for a, b in fresh]
        self._touching = frozenset(now)

    def apart(self) -> None:
        """Nothing touches."""
        self._touching = frozenset()

    def keep(self, keeper: Keeper, geoms: int) -> None:
        """What touches, and all onsets; of so many `geoms`."""
        a_geom = up_to(geoms)
        self.begun = keeper.value("contacts.begun", self.begun, maybe_size)
        touching = keeper.rows("touching", sorted(self._touching), a_geom, a_geom)
        onsets = [(*pair, count) for pair, count in Counter(self.pairs).items()]
        onsets = keeper.rows("onsets", onsets, is_text, is_text, up_to(MOST_ONSETS))
        self._touching = frozenset(touching)
        if sum(count for _, _, count in onsets) > MOST_ONSETS:
            raise ValueError(f"'onsets' are more than {MOST_ONSETS}")
        self.pairs = [(a, b) for a, b, count in onsets for _ in range(count)]
