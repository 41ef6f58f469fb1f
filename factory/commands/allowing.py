"""The option by which overlaps of parts are allowed."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any

import click

from factory.problem.pag import ANY_DEPTH, AllowedOverlap


class OverlapOption(click.ParamType[AllowedOverlap]):
    """An overlap that is meant: `a:b`, `a:b:0.5mm`, or `0.5mm` for all parts."""

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
    """Of the words of `plan --allow` those with a depth, as overlaps that are meant, and the
    others: a label, or two, of what may pass through something."""
    meant = {
        word
        for word in words
        if word not in labels
        and word.count(":") != 1
        and length_of(word.split(":")[-1]) is not None
    }
    found = [OverlapOption().convert(word, None, None) for word in meant]
    return found, tuple(word for word in words if word not in meant)


def length_of(word: str) -> float | None:
    """The length that a word with a unit, or none for metres, is [m]; None for no length."""
    from factory.lang.words import UNITS, number

    found = re.fullmatch(r"(.*?)\s*([a-z]*)", word)
    unit = (found[2] or "m") if found else ""
    return number(found[1], unit) if found and unit in UNITS else None
