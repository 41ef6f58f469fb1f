"""Commands whose help lists their options in sections: `-h` those that most users need, `--help`
all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import click

from factory.commands.options import DRAW, FAULTS, FLOOR, MOTION, OUTPUT, PICTURE, RELAY, RUN, WIP

ADVANCED = "Advanced"
"""The title of the section for EXPERT."""

TITLES = {
    "Run": (RUN, DRAW, WIP),
    "Failures": (FAULTS,),
    "Pictures": (PICTURE,),
    "Robots": (RELAY,),
    "Floor": (FLOOR,),
    "Motion and physics": (MOTION,),
    ADVANCED: (),
    "Printing": (OUTPUT,),
}
"""The shared options in each section of a help text."""

EXPERT = frozenset(
    (
        *("acceleration", "force", "timestep", "substeps", "overlap", "stage", "tile"),
        *("start", "fuse", "max_time", "swap", "fps", "poster", "order", "effort", "limit"),
        *("monitor", "lenient", "distributed", "jobs", "host", "expose"),
    )
)
"""The parameters that few users need: a section of their own, which `-h` leaves out."""

SHORT = "-h"
"""The option that lists the common options alone."""


class Grouped(click.Command):
    """A command whose help has a section for each of TITLES, after its own options, and one for
    EXPERT."""

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.common = click.Option(
            [SHORT, "common"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_show_common,
            help="Show the common options and exit.",
        )
        self.params.append(self.common)

    def get_help_option_names(self, ctx: click.Context) -> list[str]:
        """The names of the option that lists all."""
        return [name for name in super().get_help_option_names(ctx) if name != SHORT]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the sections."""
        titles, helps = _titles(), (self.common, self.get_help_option(ctx))
        sections: dict[str, list[tuple[str, str]]] = {"Options": [], **{t: [] for t in TITLES}}
        for parameter in self.get_params(ctx):
            if record := parameter.get_help_record(ctx):
                name = parameter.name
                title = ADVANCED if name in EXPERT else titles.get(name, "Options")
                title = "Printing" if parameter in helps else title
                sections[title].append(record)
        left = sections.pop(ADVANCED) if SHORT in ctx.meta else []
        for title, rows in sections.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)
        if left:
            formatter.write_paragraph()
            formatter.write_text(f"--help lists {len(left)} more options.")


def _show_common(ctx: click.Context, parameter: click.Parameter, asked: bool) -> None:
    """Print the help without EXPERT, if it is asked for."""
    if asked and not ctx.resilient_parsing:
        ctx.meta[SHORT] = True
        click.echo(ctx.get_help(), color=ctx.color)
        ctx.exit()


@cache
def _titles() -> Mapping[str | None, str]:
    """The title of each shared option."""

    def named(decorate: Callable[[Any], Any]) -> list[str | None]:
        def bare() -> None:
            """Nothing."""

        return [option.name for option in decorate(bare).__click_params__]

    return {n: title for title, every in TITLES.items() for one in every for n in named(one)}
