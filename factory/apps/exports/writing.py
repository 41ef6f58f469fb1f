"""One export: the choice of its format, and its files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from factory.api import GearNet, MarkedNet, Project
from factory.apps.exports import TAKEN, Exporter, Made, exporters
from factory.apps.exports.subject import Source, Subject
from factory.apps.log import Log, is_log, read_log
from factory.support.errors import did_you_mean, usage_error
from factory.support.extensions import bad_extension, blaming, position_of
from factory.support.files import is_net


def exporter(form: str, of: str = "", folders: Sequence[Path] = ()) -> Exporter:
    """The exporter of a format, with a choice `of` what it exports; `folders`: of the user's
    exporters. Raises InputError (Usage, BadExtension)."""
    formats = exporters(folders)
    if form not in formats:
        raise usage_error(f"unknown format '{form}'", did_you_mean(form, list(formats), "formats"))
    if of and not formats[form].of:
        some = ", ".join(f"{e.format} ({e.of})" for e in formats.values() if e.of)
        message = f"format {form} offers no choice, so no --of"
        raise usage_error(message, f"a choice is offered by {some}")
    return formats[form]


def read_source(file: Path) -> Log | GearNet | MarkedNet | None:
    """The log or the net in a file; None for a PAG. Raises InputError."""
    if is_log(file):
        return read_log(file)
    if not is_net(file):
        return None
    from factory.apps.foreign_nets.pnml_reader import load_net

    return load_net(file)


def check_taken(chosen: Exporter, file: Path, source: Source | None) -> None:
    """Check that an exporter takes a source, which is that of a PAG where it is None. Raises
    InputError (Usage)."""
    kind = "a PAG" if source is None or isinstance(source, Project) else "a net in PNML"
    kind, wanted = "a log" if isinstance(source, Log) else kind, TAKEN[chosen.takes]
    if kind not in wanted:
        message = f"{chosen.format} is made from {' or '.join(wanted)}; '{file}' is {kind}"
        hint = f"give {wanted[0]}"
        if chosen.takes == "log":
            hint = "keep one first: `factory run FILE.pag --log OUT`"
        raise usage_error(message, hint)
    if chosen.rails and isinstance(source, Project):
        source.compiled.check_rails(f"format {chosen.format}")


def takes_folder(chosen: Exporter, output: Path | None) -> bool:
    """Whether an output is the folder of an export: a folder, or a new name without an ending."""
    if not chosen.folder or output is None:
        return False
    return output.is_dir() or not (output.suffix or output.exists())


def export(
    chosen: Exporter, file: Path, source: Source, output: Path | None = None, of: str = ""
) -> tuple[Made, dict[Path, bytes]]:
    """What an exporter makes of a source, read from a `file`, and the contents of the files to
    write, none without an output. Raises InputError."""
    check_taken(chosen, file, source)
    whole = takes_folder(chosen, output)
    made = _made(chosen, Subject(file, source, of, output.name if output else "", whole))
    if output is None:
        return made, {}
    if not isinstance(made, Mapping):
        return made, {output: made.encode() if isinstance(made, str) else made}
    folder = output if whole else output.parent
    files = {folder / name if name else output: content for name, content in made.items()}
    _keep_inside(chosen, folder, file, [path for path in files if path != output])
    return made, files


def _keep_inside(chosen: Exporter, folder: Path, source: Path, files: Sequence[Path]) -> None:
    """Check that files beside the requested one stay in its folder, through links too, and that
    none is the source. Raises InputError (BadExtension)."""
    top = folder.resolve()
    for path in files:
        inside = path.resolve()
        if not inside.is_relative_to(top) or inside == top:
            fault = f"a file that is not in the folder '{folder}'"
        elif inside == source.resolve():
            fault = "a file that is the source"
        else:
            continue
        message = f"the exporter {chosen.format} gave '{path}', {fault}"
        raise bad_extension(message, position_of(chosen.export))


def _made(chosen: Exporter, subject: Subject) -> Made:
    """What an exporter makes. Raises InputError, BadExtension for a mistake of the user."""
    if chosen.file is None:
        return chosen.export(subject)
    with blaming(f"the exporter {chosen.format}", chosen.file):
        made = chosen.export(subject)
    kinds = bytes | Mapping if chosen.binary else str | Mapping
    if not isinstance(made, kinds):
        wanted = f"{'bytes' if chosen.binary else 'a text'} or files by their names"
        message = f"the exporter {chosen.format} gave {type(made).__name__}, not {wanted}"
        raise bad_extension(message, position_of(chosen.export))
    if fault := _fault_of(made):
        message = f"the exporter {chosen.format} gave {fault}"
        raise bad_extension(message, position_of(chosen.export))
    return made


def _fault_of(made: Made) -> str:
    """What of an exporter's text or files cannot be written; "" for nothing."""
    if isinstance(made, str):
        return "" if _is_unicode(made) else "a text with a lone surrogate, which is no character"
    if isinstance(made, bytes):
        return ""
    if not made:
        return "no file"
    for name, content in made.items():
        if not isinstance(name, str):
            return f"a file whose name is {name!r}, not a text"
        if "\0" in name or not _is_unicode(name):
            return f"a file whose name {name!a} no folder can hold"
        if not isinstance(content, bytes):
            return f"{type(content).__name__} for the file {name!r}, not bytes"
    return ""


def _is_unicode(text: str) -> bool:
    return not any("\ud800" <= c <= "\udfff" for c in text)
