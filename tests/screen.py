"""A stream that is a terminal."""

from __future__ import annotations

from io import StringIO


class Screen(StringIO):
    """A stream that is a terminal."""

    def isatty(self) -> bool:
        return True
