"""Exporters, found by directory: every module here that defines `FORMAT`, `TAKES` and `export`.

`FORMAT`: name of the format and, without `ENDING`, the ending of its files; `TAKES`: its source,
"net" (a PAG, or a net in PNML), "pag", "log" or "factory" (a PAG or a log); `OF`: meaning of
`--of`, where there is a choice. `export(subject)` returns a text, bytes where `BINARY` is set, or
several files by name beside the requested one, which has the name ""; where the subject is `whole`,
the files of a folder. The docstring is the line in `factory export --help`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType, ModuleType

from factory.exporting.subject import Subject

Made = str | bytes | Mapping[str, bytes]
"""What an exporter gives: a text, bytes, or files by their names."""


@dataclass(frozen=True, slots=True)
class Exporter:
    """A format, what it takes, and what writes it; `of`: what `--of` means, "" for nothing;
    `folder`: whether it writes a whole folder if asked to; `ending`: of its files, "" where that is
    the format's name."""

    format: str
    takes: str
    summary: str
    export: Callable[[Subject], Made]
    binary: bool = False
    of: str = ""
    folder: bool = False
    ending: str = ""


def exporters() -> Mapping[str, Exporter]:
    """The exporters by the names of their formats, sorted."""
    modules = (import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__))
    exporting = [_exporter(module) for module in modules if hasattr(module, "FORMAT")]
    return MappingProxyType({e.format: e for e in sorted(exporting, key=lambda e: e.format)})


def _exporter(module: ModuleType) -> Exporter:
    summary = " ".join((module.__doc__ or "").strip().partition("\n\n")[0].split())
    words = ("FORMAT", "TAKES", "BINARY", "OF", "FOLDER", "ENDING")
    names = [name for name in words if hasattr(module, name)]
    fields = {name.lower(): getattr(module, name) for name in names}
    return Exporter(**fields, summary=summary, export=module.export)


__all__ = ["Exporter", "Made", "Subject", "exporters"]
