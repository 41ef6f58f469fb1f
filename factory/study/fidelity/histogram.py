"""A distribution of positive values in fixed memory: its maximum exactly, its quantiles within
1 %."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array

PER_DECADE = 240
LOWEST, HIGHEST = -12, 6
"""Powers of ten; smaller and larger values count to the first and last bin."""


class Histogram:
    """Counts values [any unit] in bins of equal ratio.

    >>> h = Histogram()
    >>> h.add(np.linspace(0.001, 1, 1000))
    >>> h.largest, round(h.quantile(0.99), 2)
    (1.0, 0.99)
    """

    def __init__(self) -> None:
        self.counts = np.zeros((HIGHEST - LOWEST) * PER_DECADE + 1, np.int64)
        self.squares = 0.0
        self.total = 0
        self._largest = 0.0
        self._waiting: list[Array] = []
        self._room = 0

    def add(self, values: Array) -> None:
        """Count values; those below the lowest bin as zero. Many are counted at once, for speed."""
        self._waiting.append(np.ravel(values))
        self._room += values.size
        if len(self._waiting) >= 100 or self._room >= 10_000:
            self._count()

    def _count(self) -> None:
        flat = np.concatenate([np.empty(0), *self._waiting])
        self._waiting, self._room = [], 0
        if not flat.size:
            return
        self.total += flat.size
        self.squares += float(flat @ flat)
        self._largest = max(self._largest, float(flat.max()))
        with np.errstate(divide="ignore"):
            bins = (np.log10(flat) - LOWEST) * PER_DECADE
        np.clip(bins, -1, len(self.counts) - 2, out=bins)
        self.counts += np.bincount(bins.astype(np.intp) + 1, minlength=len(self.counts))

    @property
    def largest(self) -> float:
        """The largest value, 0 where there is none."""
        self._count()
        return self._largest

    def quantile(self, share: float) -> float:
        """The value that `share` of all do not exceed: the upper edge of its bin, at most the
        largest; 0 where there are none."""
        self._count()
        if not self.total:
            return 0.0
        found = int(np.searchsorted(np.cumsum(self.counts), share * self.total))
        edge = 0.0 if found == 0 else 10.0 ** (LOWEST + found / PER_DECADE)
        return float(min(edge, self._largest))

    @property
    def rms(self) -> float:
        """Root mean square."""
        self._count()
        return float(np.sqrt(self.squares / self.total)) if self.total else 0.0
