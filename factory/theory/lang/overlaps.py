"""Overlaps of parts that are accepted, as words: `a:b`, `a:b:0.5mm`, or `0.5mm` for all parts."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from factory.support.decimals import UNITS, number
from factory.support.errors import usage_error
from factory.theory.problem.pag import ANY_DEPTH, AllowedOverlap

HINT = "for example a:b, a:b:0.5mm, or 0.5mm everywhere"


def overlap_in(word: str) -> AllowedOverlap:
    """The overlap that a word accepts. Raises InputError (Usage)."""
    parts, depth = word.split(":"), ANY_DEPTH
    if len(parts) in (1, 3):
        length = length_of(parts.pop())
        if length is None or length < 0:
            units = ", ".join(UNITS)
            raise usage_error(f"'{word}' ends in no length in one of {units}.", HINT)
        depth = length
    if len(parts) not in (0, 2) or not all(parts) or len({*parts}) == 1:
        raise usage_error(f"'{word}' is neither part:part, part:part:depth nor depth.", HINT)
    return AllowedOverlap(depth, tuple(parts))


def overlaps_in(
    words: Sequence[str], labels: Collection[str]
) -> tuple[list[AllowedOverlap], tuple[str, ...]]:
    """The words in two groups: those with a depth, as overlaps to accept, and labels, or pairs of
    labels, of parts that may pass through others. Raises InputError (Usage)."""
    lengths = {
        word
        for word in words
        if word not in labels
        and word.count(":") != 1
        and length_of(word.split(":")[-1]) is not None
    }
    return [*map(overlap_in, lengths)], tuple(word for word in words if word not in lengths)


def length_of(word: str) -> float | None:
    """Length [m] of a word such as `0.5mm`, in metres without a unit; None if it is none."""
    match = re.fullmatch(r"(.*?)\s*([a-z]*)", word)
    unit = (match[2] or "m") if match else ""
    return number(match[1], unit) if match and unit in UNITS else None
