"""The option by which overlaps of parts are allowed."""

from __future__ import annotations

import re
from typing import Any

import click

from factory.lang.words import UNITS, number
from factory.problem.pag import ANY_DEPTH, AllowedOverlap


class OverlapOption(click.ParamType[AllowedOverlap]):
    """An overlap that is meant: `a:b`, `a:b:0.5mm`, or `0.5mm` for all parts."""

    name = "[part:part][:depth]"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if isinstance(value, AllowedOverlap):
            return value
        parts, depth = value.split(":"), ANY_DEPTH
        if len(parts) in (1, 3):
            found = re.fullmatch(r"(.*?)\s*([a-z]*)", parts.pop())
            unit = (found[2] or "m") if found else ""
            length = number(found[1], unit) if found and unit in UNITS else None
            if length is None or length < 0:
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
    help="An overlap that is meant: a:b, a:b:0.5mm, or 0.5mm everywhere (repeatable).",
)
