"""A text that is read: its lines, the places in it, and the errors found in it; and words of
messages."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

from lark import Token

from factory.support.errors import Diagnostic, InputError, Position, did_you_mean

__all__ = ["Source", "counted", "near_file", "quoted", "source_of", "where"]

FILES = 1000
"""Maximum number of names of a folder that are compared with a missing one."""


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
    """The source of a text: without byte-order mark, every line end `\\n`."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    return Source(text, file, tuple(text.split("\n")))


@dataclass(slots=True)
class Findings:
    """The errors found so far in one text; raised all at once, in the order of the text."""

    source: Source
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def add(self, code: str, message: str, at: Token | Position, hint: str) -> None:
        """Note an error: what was found, where, and what would have been valid."""
        position = self.source.at(at) if isinstance(at, Token) else at
        self.diagnostics.append(Diagnostic(code, message, position, hint))

    def raise_if_any(self) -> None:
        """Raise one InputError with every error found, if there is any."""
        if self.diagnostics:
            raise InputError(sorted(dict.fromkeys(self.diagnostics), key=_place))


def _place(diagnostic: Diagnostic) -> tuple[int, int]:
    at = diagnostic.position
    return (at.line, at.column) if at else (0, 0)


def where(first: Position, second: Position) -> str:
    """The first of two places relative to the second, in words: `in line 3`, `at column 5`."""
    return f"in line {first.line}" if first.line != second.line else f"at column {first.column}"


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


def counted(number: int, noun: str) -> str:
    """How many there are of what a noun names: `1 part`, `2 parts`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def quoted(text: str) -> str:
    """A found text in quotes, on one line: unprintable characters escaped, long texts cut."""
    cut = text if len(text) <= 60 else text[:57] + "..."
    shown = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in cut)
    if shown.startswith('"'):
        return shown
    return f'"{shown}"' if "'" in shown else f"'{shown}'"
