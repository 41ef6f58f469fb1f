"""How values show themselves in a notebook.

Values lie on lower floors than what draws them, so the drawings are put in here, by the names of
classes, when the package is imported.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

DRAWINGS: dict[str, Callable[[Any], str | None]] = {}
"""For a class the function from a value to its SVG (`Pictured`) or to its HTML (`Told`); None for a
value that is too large to be drawn."""


class Pictured:
    """A value that a notebook shows as a picture."""

    def _repr_svg_(self) -> str | None:
        return drawn(self)


class Told:
    """A value that a notebook shows in words and figures."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        return drawn(self)


def drawn(value: object) -> str | None:
    """The drawing of a value, None where there is none."""
    draw = DRAWINGS.get(type(value).__name__)
    return None if draw is None else draw(value)
