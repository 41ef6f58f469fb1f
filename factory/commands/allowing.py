"""The option by which overlaps of parts are allowed."""

from __future__ import annotations

from typing import Any

import click

from factory.support.errors import InputError
from factory.theory.problem.pag import AllowedOverlap


class OverlapOption(click.ParamType[AllowedOverlap]):
    """An overlap to accept: `a:b`, `a:b:0.5mm`, or `0.5mm` for all parts."""

    name = "[part:part][:depth]"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        from factory.theory.lang.overlaps import overlap_in

        try:
            return value if isinstance(value, AllowedOverlap) else overlap_in(value)
        except InputError as error:
            self.fail(error.diagnostics[0].message, param, ctx)


ALLOW = click.option(
    "--allow",
    multiple=True,
    type=OverlapOption(),
    help="Accept an overlap: a:b, a:b:0.5mm, or 0.5mm everywhere (repeatable).",
)
