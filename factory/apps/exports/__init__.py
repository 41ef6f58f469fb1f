"""Exporters, found by directory: every module here, in a folder of the user or named by an entry
point of `factory.exporters` that defines `FORMAT`, `TAKES` and `export`.

`FORMAT`: name of the format and, without `ENDING`, the ending of its files; `TAKES`: its source,
"net" (a PAG, or a net in PNML), "pag", "cell" (a PAG with --arm), "log" or "factory" (a PAG or a
log); `OF`: meaning of `--of`, where there is a choice; `RAILS`: whether all robots need guidepaths.
`export(subject)` returns a text, bytes where `BINARY` is set, or several files by name beside the
requested one, which has the name ""; where the subject is `whole`, the files of a folder. The
docstring is the line in `factory export --help`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType

from factory.apps.exports.subject import Subject, user_modules
from factory.support.extensions import bad_extension, extensions, position_of

Made = str | bytes | Mapping[str, bytes]
"""What an exporter gives: a text, bytes, or files by their names."""


@dataclass(frozen=True, slots=True)
class Exporter:
    """A format, and what writes it.

    Attributes:
        format: its name.
        takes: its source, a key of `TAKEN`.
        summary: one line for `factory export --help`.
        export: makes the content of a subject.
        binary: whether that is bytes.
        of: what `--of` means, "" for nothing.
        folder: whether it can write a whole folder.
        ending: ending of its files, "" where that is the format's name.
        rails: whether all robots need a guidepath.
        file: the module of a user's exporter; None for those shipped.
    """

    format: str
    takes: str
    summary: str
    export: Callable[[Subject], Made]
    binary: bool = False
    of: str = ""
    folder: bool = False
    ending: str = ""
    rails: bool = False
    file: Path | None = None


TAKEN: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "net": ("a PAG", "a net in PNML"),
        "pag": ("a PAG",),
        "cell": ("a PAG",),
        "log": ("a log",),
        "factory": ("a PAG", "a log"),
    }
)
"""The kinds of source that an exporter can take."""


def exporters(folders: Sequence[Path] = ()) -> Mapping[str, Exporter]:
    """The exporters by the names of their formats, sorted: those shipped, of entry points and of
    some folders. Raises InputError (BadExtension)."""
    modules = (import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__))
    made = {m.FORMAT: _exporter(m) for m in modules if hasattr(m, "FORMAT")}
    for module in _extensions(folders):
        _check(module, made)
        assert module.__file__ is not None
        made[module.FORMAT] = replace(_exporter(module), file=Path(module.__file__))
    return MappingProxyType(dict(sorted(made.items())))


def _extensions(folders: Sequence[Path]) -> Iterator[ModuleType]:
    yield from extensions("exporters").values()
    for folder in folders:
        yield from (module for module in user_modules(folder) if hasattr(module, "FORMAT"))


def _check(module: ModuleType, there: Mapping[str, Exporter]) -> None:
    """Check an exporter of the user. Raises InputError (BadExtension)."""
    ending, takes = getattr(module, "FORMAT", None), getattr(module, "TAKES", None)
    faults = {
        "FORMAT": not (isinstance(ending, str) and ending) and f"is {ending!r}, not a name",
        "TAKES": takes not in TAKEN and f"is {takes!r}, not one of {', '.join(TAKEN)}",
        "export": not callable(getattr(module, "export", None)) and "is no function",
    }
    if not faults["FORMAT"] and ending in there:
        faults["FORMAT"] = f"is '{ending}', which there is already"
    for name, fault in faults.items():
        if fault:
            at = position_of(module, name)
            raise bad_extension(f"{name} of this exporter {fault}", at)


def _exporter(module: ModuleType) -> Exporter:
    summary = " ".join((module.__doc__ or "").strip().partition("\n\n")[0].split())
    words = ("FORMAT", "TAKES", "BINARY", "OF", "FOLDER", "ENDING", "RAILS")
    names = [name for name in words if hasattr(module, name)]
    fields = {name.lower(): getattr(module, name) for name in names}
    return Exporter(**fields, summary=summary, export=module.export)


__all__ = ["TAKEN", "Exporter", "Made", "Subject", "exporters"]
