"""The command `export`: a factory for other tools."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from factory.commands.grouped import Grouped
from factory.commands.options import FLOOR, MOTION, OUTPUT, PATH, RELAY, SOURCE
from factory.commands.outputs import writable, writable_folder
from factory.commands.requests import OutputOptions, ProjectOptions
from factory.commands.warnings import announced, cut_off, read_partly
from factory.support.console import emit, say
from factory.support.errors import did_you_mean, usage_error

if TYPE_CHECKING:
    from factory.exporting import Exporter, Made
    from factory.exporting.subject import Source

TAKEN = {
    "net": ("a PAG", "a net in PNML"),
    "pag": ("a PAG",),
    "log": ("a log",),
    "factory": ("a PAG", "a log"),
}
"""The kinds of file that an exporter can take."""


class _Listing(Grouped):
    """A command whose help ends with the summary of every exporter."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from factory.exporting import exporters

        with formatter.section("Formats"):
            formatter.write_dl([(e.format, e.summary) for e in exporters().values()])


class _Format(click.ParamType[str]):
    """The name of an exporter, which the shell completes."""

    name = "format"

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:
        """The list of formats."""
        from factory.exporting import exporters

        return f"There are: {', '.join(exporters())}."

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from factory.exporting import exporters

        known = exporters().values()
        return [
            CompletionItem(e.format, help=e.summary.partition(";")[0].partition(":")[0])
            for e in known
            if e.format.startswith(incomplete)
        ]


@click.command(cls=_Listing)
@SOURCE
@click.option("--format", "form", type=_Format(), required=True, help="A format listed below.")
@click.option("-o", "--output", type=PATH, help="Output file (default: stdout, for text formats).")
@click.option("--of", default="", help="What to export, where a format offers a choice.")
@FLOOR
@RELAY
@MOTION
@OUTPUT
def export(
    options: ProjectOptions, out: OutputOptions, form: str, output: Path | None, of: str
) -> int:
    """Write FILE.pag, a net in FILE.pnml or a LOG of a run for other tools."""
    from factory.exporting import Subject
    from factory.pipeline import Project
    from factory.record.log import Log
    from factory.support.files import write_all

    chosen = _exporter(form, of)
    whole = chosen.folder and output is not None and _is_folder(output)
    _writable(options.file, output, whole, chosen)
    source = _source(options, chosen, out.silent)
    name = output.name if output else ""
    made = chosen.export(Subject(options.file, source, of, name, whole))
    seen = source.product if isinstance(source, Project) and source.has_geometry else None
    warnings = announced(seen.warnings if seen else (), out)
    files = _files(made, output, whole)
    if output is not None:
        write_all(files)
    if out.as_json:
        text = {"text": made} if output is None else {}
        shown = str(output) if output else None
        listed = [str(f) for f in files]
        made_of = {"format": form, "output": shown, "files": listed, "warnings": warnings}
        log = cut_off(source if isinstance(source, Log) else None)
        emit({**made_of, **log, **text})
    elif output is None and isinstance(made, str):
        say(made.rstrip("\n"))
    elif output is not None:
        say(f"{form}: {output}" + (f", {len(files)} files" if len(files) > 1 else ""))
    return 0


def _source(options: ProjectOptions, chosen: Exporter, silent: bool) -> Source:
    """The input of an exporter. Raises InputError, of code Usage if the exporter does not take such
    a file."""
    from factory.record.log import is_log
    from factory.support.files import is_net

    file = options.file
    kind = "a log" if is_log(file) else "a net in PNML" if is_net(file) else "a PAG"
    wanted = TAKEN[chosen.takes]
    if kind not in wanted:
        message = f"{chosen.format} is made from {' or '.join(wanted)}; '{file}' is {kind}"
        hint = f"give {wanted[0]}"
        if chosen.takes == "log":
            hint = "keep one first: `factory run FILE.pag --log OUT`"
        raise usage_error(message, hint)
    if kind == "a log":
        return read_partly(file, silent)
    if kind == "a PAG":
        return options.project(silent)
    from factory.foreign_nets.pnml_reader import load_net

    return load_net(file)


def _exporter(form: str, of: str) -> Exporter:
    from factory.exporting import exporters

    known = exporters()
    if form not in known:
        hint = did_you_mean(form, list(known), "formats")
        raise usage_error(f"unknown format '{form}'", hint)
    if of and not known[form].of:
        some = ", ".join(f"{e.format} ({e.of})" for e in known.values() if e.of)
        message = f"format {form} offers no choice, so no --of"
        raise usage_error(message, f"a choice is offered by {some}")
    return known[form]


def _is_folder(output: Path) -> bool:
    """Whether an output is a folder, or a new name without an ending."""
    return output.is_dir() or not (output.suffix or output.exists())


def _writable(file: Path, output: Path | None, whole: bool, chosen: Exporter) -> None:
    if output is None and chosen.binary:
        message = f"{chosen.format} is binary and is not written to a terminal"
        raise usage_error(message, f"give -o OUT.{chosen.ending or chosen.format}")
    if whole:
        writable_folder(output)
    else:
        writable(file, output)


def _files(made: Made, output: Path | None, whole: bool) -> dict[Path, bytes]:
    """Content of each output file. Raises InputError (Usage) for several files without -o."""
    if not isinstance(made, Mapping):
        content = made.encode() if isinstance(made, str) else made
        return {} if output is None else {output: content}
    if output is None:
        message = f"this format writes {len(made)} files"
        raise usage_error(message, "give -o OUT for the first of them")
    folder = output if whole else output.parent
    return {folder / name if name else output: content for name, content in made.items()}
