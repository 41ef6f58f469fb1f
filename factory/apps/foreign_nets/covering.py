"""Covers of a net by gears: what makes its places safe."""

from __future__ import annotations

from collections.abc import Iterable

from factory.api import NONE, MarkedNet


def cover(net: MarkedNet, closed: Iterable[bool]) -> list[int]:
    """For each place a gear through it that has at most one token and keeps it, or NONE."""
    covered: list[int] = [NONE] * len(net.tokens)
    for number, (gear, good) in enumerate(zip(net.gears, closed, strict=False)):
        if good and sum(net.tokens[p] for p in gear.places) <= 1:
            for place in gear.places:
                covered[place] = number
    return covered
