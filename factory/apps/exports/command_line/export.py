"""The command `export`: a factory for other tools."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from factory.commands.defaults import with_defaults
from factory.commands.grouped import Grouped
from factory.commands.options import FLOOR, MOTION, OUT, OUTPUT, PATH, RELAY, SOURCE
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced, cut_off
from factory.support.console import emit, say, warn
from factory.support.errors import usage_error

if TYPE_CHECKING:
    from factory.apps.exports.subject import Source


STDOUT = Path("-")
"""The output that is standard output."""


class _Listing(Grouped):
    """A command whose help ends with the summary of every exporter."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from factory.apps.exports import exporters

        with formatter.section("Formats"):
            formatter.write_dl([(e.format, e.summary) for e in exporters().values()])


class _Format(click.ParamType[str]):
    """The name of an exporter, which the shell completes."""

    name = "format"

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:
        """The list of formats."""
        from factory.apps.exports import exporters

        return f"There are: {', '.join(exporters())}."

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from factory.apps.exports import exporters

        offered = exporters().values()
        return [
            CompletionItem(e.format, help=e.summary.partition(";")[0].partition(":")[0])
            for e in offered
            if e.format.startswith(incomplete)
        ]


@with_defaults
@click.command(cls=_Listing)
@SOURCE
@click.option("--format", "form", type=_Format(), required=True, help="A format listed below.")
@click.option(
    "--exporters",
    "exporting",
    multiple=True,
    type=PATH,
    help="Folder of additional exporters, *.py (repeatable).",
)
@click.option(
    "-o", "--output", type=OUT, help="Output file, - for stdout (default for text formats)."
)
@click.option("--of", default="", help="What to export, where a format offers a choice.")
@FLOOR
@RELAY
@MOTION
@OUTPUT
def export(
    options: ProjectOptions,
    out: OutputOptions,
    form: str,
    exporting: tuple[Path, ...],
    output: Path | None,
    of: str,
) -> int:
    """Write a factory, a net or a LOG of a run for other tools.

    FILE is a PAG, a net in PNML, or a LOG of `run --log`.
    """
    from factory.api import Project
    from factory.apps.exports.writing import check_taken, exporter, read_source, takes_folder
    from factory.apps.exports.writing import export as exported
    from factory.apps.log import Log
    from factory.support.files import write_all

    chosen = exporter(form, of, exporting)
    piped, output = output == STDOUT, None if output == STDOUT else output
    if output is None and chosen.binary and (out.as_json or not piped or sys.stdout.isatty()):
        message = f"{chosen.format} is binary and is not written to a terminal"
        raise usage_error(message, f"give -o OUT.{chosen.ending or chosen.format}")
    if takes_folder(chosen, output):
        writable_folder(output)
    else:
        writable(output)
    source: Source | None = read_source(options.file)
    check_taken(chosen, options.file, source)
    if isinstance(source, Log) and source.cut_off:
        warn([source.cut_off.diagnostic(options.file)], out.silent)
    source = options.project(out.silent) if source is None else source
    made, files = exported(chosen, options.file, source, output, of)
    if output is None and isinstance(made, Mapping):
        raise usage_error(
            f"this format writes {len(made)} files", "give -o OUT for the first of them"
        )
    seen = source.product if isinstance(source, Project) and source.has_geometry else None
    warnings = announced(seen.warnings if seen else (), out)
    if output is not None:
        write_all(files)
    if out.as_json:
        text = {"text": made} if output is None else {}
        shown = str(output) if output else None
        listed = [str(f) for f in files]
        made_of = {"format": form, "output": shown, "files": listed, "warnings": warnings}
        log = cut_off(source if isinstance(source, Log) else None)
        emit({**made_of, **log, **text})
    elif isinstance(made, bytes) and piped:
        sys.stdout.buffer.write(made)
    elif output is None and isinstance(made, str):
        say(made.rstrip("\n"))
    elif output is not None:
        first = output if output in files or output.is_dir() else next(iter(files))
        say(f"{form}: {first}" + (f", {len(files)} files" if len(files) > 1 else ""))
    return 0
