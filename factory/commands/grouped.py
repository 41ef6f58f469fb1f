"""Commands whose help lists their options in sections."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import click

from factory.commands.options import DRAW, FAULTS, FLOOR, MOTION, OUTPUT, PICTURE, RELAY, RUN, WIP

TITLES = {
    "Run": (RUN, DRAW, WIP),
    "Failures": (FAULTS,),
    "Pictures": (PICTURE,),
    "Robots": (RELAY,),
    "Floor": (FLOOR,),
    "Motion and physics": (MOTION,),
    "Printing": (OUTPUT,),
}
"""The shared options in each section of a help text."""


class Grouped(click.Command):
    """A command whose help has a section for each of TITLES, after its own options."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the sections."""
        sections: dict[str, list[tuple[str, str]]] = {"Options": [], **{t: [] for t in TITLES}}
        for parameter in self.get_params(ctx):
            if record := parameter.get_help_record(ctx):
                title = "Printing" if parameter.name == "help" else _titles().get(parameter.name)
                sections[title or "Options"].append(record)
        for title, rows in sections.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


@cache
def _titles() -> Mapping[str | None, str]:
    """The title of each shared option."""

    def named(decorate: Callable[[Any], Any]) -> list[str | None]:
        def bare() -> None:
            """Nothing."""

        return [option.name for option in decorate(bare).__click_params__]

    return {n: title for title, every in TITLES.items() for one in every for n in named(one)}
