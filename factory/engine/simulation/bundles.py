"""Bundles of modes that are active together, cached."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from factory.support.arrays import Index
from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle
from factory.theory.control.obstacles import ranges

KEPT = 500
"""So many bundles are kept: in steady production the same modes come together again."""


class Bundles:
    """Bundles of `modes`, each on its axes in `axes_of`, under the limits of the axes."""

    def __init__(
        self, modes: Sequence[Mode], axes_of: Sequence[tuple[int, ...]], limits: Limits
    ) -> None:
        self.modes, self.axes_of = tuple(modes), tuple(axes_of)
        self._axes = np.array([axis for axes in axes_of for axis in axes], np.intp)
        self._kept: dict[tuple[tuple[int, ...], frozenset[int]], tuple[Bundle, Index]] = {}
        self.limit(limits)

    def with_more(self, modes: Sequence[Mode], axes_of: Sequence[tuple[int, ...]]) -> Bundles:
        """The bundles with additional modes."""
        return Bundles((*self.modes, *modes), (*self.axes_of, *axes_of), self.limits)

    def limit(self, limits: Limits) -> None:
        """Set the limits of the axes."""
        self.limits = limits
        self._all = Bundle.of(self.modes, [limits.of(axes) for axes in self.axes_of])
        self._kept.clear()

    def of(
        self, numbers: tuple[int, ...], clocked: frozenset[int] = frozenset()
    ) -> tuple[Bundle, Index]:
        """The bundle of modes, by number, some of them clocked, and their axes, mode by mode."""
        key = numbers, clocked
        if key not in self._kept:
            if len(self._kept) >= KEPT:
                self._kept.clear()
            self._kept[key] = self._selected(numbers, clocked)
        return self._kept[key]

    def _selected(self, numbers: tuple[int, ...], clocked: Collection[int]) -> tuple[Bundle, Index]:
        if clocked:
            bundle, axes = self.of(numbers)
            return replace(bundle, clocked=np.array([n in clocked for n in numbers])), axes
        chosen = np.array(numbers, np.intp)
        slots = ranges(self._all.starts[chosen], self._all.sizes[chosen])
        return self._all.select(numbers), self._axes[slots]
