"""The option by which overlaps of parts are allowed."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any

import click

from factory.problem.pag import ANY_DEPTH, AllowedOverlap


class OverlapOption(click.ParamType[AllowedOverlap]):
    """An overlap to accept: `a:b`, `a:b:0.5mm`, or `0.5mm` for all parts."""

    name = "[part:part][:depth]"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, AllowedOverlap):
            return value
        parts, depth = value.split(":"), ANY_DEPTH
        if len(parts) in (1, 3):
            length = length_of(parts.pop())
            if length is None or length < 0:
                from factory.lang.words import UNITS

                units = ", ".join(UNITS)
                self.fail(f"'{value}' ends in no length in one of {units}.", param, ctx)
            depth = length
        if len(parts) not in (0, 2) or not all(parts) or len({*parts}) == 1:
            self.fail(f"'{value}' is neither part:part, part:part:depth nor depth.", param, ctx)
        return AllowedOverlap(depth, tuple(parts))


ALLOW = click.option(
    "--allow",
    multiple=True,
    type=OverlapOption(),
    help="Accept an overlap: a:b, a:b:0.5mm, or 0.5mm everywhere (repeatable).",
)


def allowed_in(
    words: Sequence[str], labels: Collection[str]
) -> tuple[list[AllowedOverlap], tuple[str, ...]]:
    """The words of `plan --allow` in two groups: those with a depth, as overlaps to accept, and
    labels, or pairs of labels, of parts that may pass through others."""
    lengths = {
        word
        for word in words
        if word not in labels
        and word.count(":") != 1
        and length_of(word.split(":")[-1]) is not None
    }
    overlaps = [OverlapOption().convert(word, None, None) for word in lengths]
    return overlaps, tuple(word for word in words if word not in lengths)


def length_of(word: str) -> float | None:
    """Length [m] of a word such as `0.5mm`, in metres without a unit; None if it is none."""
    from factory.lang.words import UNITS, number

    match = re.fullmatch(r"(.*?)\s*([a-z]*)", word)
    unit = (match[2] or "m") if match else ""
    return number(match[1], unit) if match and unit in UNITS else None
