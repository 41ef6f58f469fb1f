"""Values that keep what is computed from them."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar

Kept = TypeVar("Kept")


class Keeping:
    """A frozen value whose derived values are computed once and live as long as it does. They are
    no part of it: a copy has none."""

    @cached_property
    def _kept(self) -> dict[object, Any]:
        return {}

    def kept(self, make: Callable[..., Kept], *values: object) -> Kept:
        """The result of `make` for this value and others, computed once for equal ones."""
        key = make, *values
        if key not in self._kept:
            self._kept[key] = make(self, *values)
        made: Kept = self._kept[key]
        return made
