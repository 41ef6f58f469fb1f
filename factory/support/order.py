"""The order in which people expect names."""

from __future__ import annotations

import re


def natural(name: str) -> tuple[tuple[int, str], ...]:
    """The key by which `part2` comes before `part10`."""
    words = re.split(r"(\d+)", name.lower())
    return tuple((int(word), "") if word.isdigit() else (-1, word) for word in words)
