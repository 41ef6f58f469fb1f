"""A text being read: its lines, the places in it, and what is wrong with it."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

from lark import Token

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.support.files import LOG

FILES = 1000  # at most so many names of a folder are compared with a missing one


@dataclass(frozen=True, slots=True)
class Source:
    """A text and the name of its file; line ends are `\\n` and a byte-order mark is gone."""

    text: str
    file: str
    lines: tuple[str, ...]

    def at(self, token: Token) -> Position:
        """The place of a token's first character."""
        line = token.line or 1
        return Position(self.file, line, token.column or 1, self.lines[line - 1])

    def after(self, token: Token) -> Position:
        """The place just behind a token (tokens never span lines)."""
        line = token.line or 1
        return Position(self.file, line, (token.column or 1) + len(token), self.lines[line - 1])

    def start(self) -> Position:
        """The first place of the text."""
        return Position(self.file, 1, 1, self.lines[0])


def source_of(text: str, file: str) -> Source:
    """The source of a text as it was given: without byte-order mark, line ends made alike."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return Source(text, file, tuple(text.split("\n")))


@dataclass(slots=True)
class Findings:
    """The errors found so far in one text; raised all at once, in the order of the text."""

    diagnostics: list[Diagnostic] = field(default_factory=list)

    def add(self, code: str, message: str, position: Position, hint: str) -> None:
        """Note an error: what was found, where, and what would have been valid."""
        self.diagnostics.append(Diagnostic(code, message, position, hint))

    def raise_if_any(self) -> None:
        """Raise one InputError with every error found, if there is any."""
        if self.diagnostics:
            raise InputError(sorted(self.diagnostics, key=_place))


def _place(diagnostic: Diagnostic) -> tuple[int, int]:
    at = diagnostic.position
    return (at.line, at.column) if at else (0, 0)


def read_text(path: str | os.PathLike[str]) -> str:
    """The text of a UTF-8 file. Raises InputError (BadFile, Syntax where it is not UTF-8, or Usage
    for a log)."""
    name = os.fspath(path)
    try:
        data = Path(name).read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(_unreadable(name, error)) from None
    if data.startswith(LOG):
        raise InputError(_log(name))
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(_not_utf8(name, data, error.start)) from None


def _unreadable(name: str, error: Exception) -> Diagnostic:
    at = Position(name, 1, 1)
    hint = "give a file that exists and that you may read"
    if isinstance(error, FileNotFoundError):
        return Diagnostic(
            "BadFile", f"there is no file {quoted(name)}", at, near_file("", name) or hint
        )
    if isinstance(error, IsADirectoryError):
        message = f"{quoted(name)} is a folder, not a file"
        return Diagnostic("BadFile", message, at, "name a file in it")
    why = getattr(error, "strerror", None) or str(error)
    return Diagnostic("BadFile", f"{quoted(name)} cannot be read: {why}", at, hint)


def _log(name: str) -> Diagnostic:
    message = f"{quoted(name)} is a log of a run, not the PAG of a product"
    hint = "logs are for `monitor`, `report`, `render`, `export` and `analyze --measured`"
    return Diagnostic("Usage", message, None, hint)


def near_file(folder: str, path: str) -> str:
    """A hint that names the file most like the missing one at `path`, relative to `folder`, among
    those with its suffix; "" if there is none."""
    inside, base = os.path.split(path)
    try:
        names = sorted(os.listdir(os.path.join(folder, inside) or "."))[:FILES]
    except (OSError, ValueError):
        return f"there is no folder {quoted(inside)}"
    suffix = os.path.splitext(base)[1].lower()
    alike = [name for name in names if os.path.splitext(name)[1].lower() == suffix]
    shown = [os.path.join(inside, name) for name in alike]
    return did_you_mean(path, shown, f"'{suffix}' files there") if alike else ""


def _not_utf8(name: str, data: bytes, offset: int) -> Diagnostic:
    before = data[:offset].decode("utf-8").removeprefix("\ufeff").replace("\r\n", "\n")
    line = before.count("\n") + 1
    start = data.rfind(b"\n", 0, offset) + 1
    end = data.find(b"\n", offset)
    shown = data[start : end if end >= 0 else len(data)].decode("utf-8", "replace")
    column = len(before) - (before.rfind("\n") + 1) + 1
    shown = shown.removeprefix("\ufeff").rstrip("\r")
    binary = any(c < " " and c != "\t" for c in shown)
    at = Position(name, line, column, "" if binary else shown)
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    hint = "this is UTF-16: save the file as UTF-8" if wide else "save the file as UTF-8"
    return Diagnostic("Syntax", f"byte 0x{data[offset]:02x} is not UTF-8 text", at, hint)


def quoted(found: str, width: int = 60) -> str:
    """A found text in quotes, on one line: unprintable characters escaped, long texts cut."""
    cut = found if len(found) <= width else found[: width - 3] + "..."
    shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in cut)
    if shown.startswith('"'):
        return shown
    return f'"{shown}"' if "'" in shown else f"'{shown}'"
