"""Errors, with codes and places in the user's file.

A `Diagnostic` has a position, what was found and what would have been valid; a `FactoryError`
carries every diagnostic of one stage. The command line prints them and takes its exit status
from the class.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches

__all__ = [
    "MissingError",
    "Position",
    "StoppedError",
    "did_you_mean",
    "listing",
    "one_line",
    "usage_error",
]

SHOWN = 100
"""Maximum number of diagnostics that are printed; the others are counted."""

LONGEST = 1000
"""Maximum number of characters of a message or a hint."""

WORD = 200
"""A longer word is not compared with valid ones, which would take memory and time."""


@dataclass(frozen=True, slots=True)
class Position:
    """A place in a text.

    Attributes:
        file: the name of the file.
        line: counted from 1.
        column: counted from 1.
        text: the line itself.
    """

    file: str
    line: int
    column: int
    text: str = field(default="", compare=False)

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """An error or a warning.

    Attributes:
        code: its documented code, such as Syntax; `factory --explain CODE` prints the text.
        message: what was found.
        position: where in the user's text; None for no place.
        hint: what would have been valid, or what to do; "" for nothing.
        many: the words for several diagnostics of one cause, as in "4 meshes are open: ..."; ""
            where each is listed.
        about: the label by which it is named in such a line.
    """

    code: str
    message: str
    position: Position | None = None
    hint: str = ""
    many: str = ""
    about: str = ""

    def __str__(self) -> str:
        """`file:line:col: CODE message`, then the source line with a caret, then the hint."""
        where = f"{self.position}: " if self.position else ""
        lines = [one_line(f"{where}{self.code} {_cut(self.message)}")]
        if self.position and self.position.text:
            start, caret = _window(self.position.text, self.position.column - 1)
            lines += [f"    {one_line(start).rstrip()}", f"    {' ' * caret}^"]
        if self.hint:
            lines.append(f"    {one_line(_cut(self.hint))}")
        return "\n".join(lines)

    def as_json(self) -> dict[str, object]:
        """The diagnostic as the `--json` document lists it."""
        at = self.position
        return {
            "file": at.file if at else None,
            "line": at.line if at else None,
            "col": at.column if at else None,
            "code": self.code,
            "message": _cut(self.message),
            "hint": _cut(self.hint),
        }


def _cut(text: str) -> str:
    """A text of at most LONGEST characters."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def one_line(text: str) -> str:
    """A text with a space for every line end, tab and unprintable character."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else " " for c in text)


def _window(source: str, caret: int) -> tuple[str, int]:
    """The part of a long source line around the caret, and the caret's column in it."""
    start = max(0, caret - 50) if len(source) > 100 else 0
    return source[start : start + 100], caret - start


class FactoryError(Exception):
    """The errors of a stage, as one or more diagnostics, of which the first SHOWN are printed. Exit
    status 2."""

    exit_status = 2

    def __init__(self, diagnostics: Diagnostic | Iterable[Diagnostic]) -> None:
        many = [diagnostics] if isinstance(diagnostics, Diagnostic) else diagnostics
        self.diagnostics: tuple[Diagnostic, ...] = tuple(many)
        super().__init__()

    def __str__(self) -> str:
        return "\n".join(printed(self.diagnostics, "errors"))

    def _render_traceback_(self) -> list[str]:
        """What a notebook shows of it: the diagnostics, not the code that found them."""
        return str(self).splitlines()

    def __reduce__(self) -> tuple[type[FactoryError], tuple[tuple[Diagnostic, ...]]]:
        return type(self), (self.diagnostics,)


class InputError(FactoryError):
    """Bad input: a PAG, a template, a net, a log, an option. Exit status 2."""


def usage_error(message: str, hint: str) -> InputError:
    """The error of a wrong use of the command line (code Usage).

    Args:
        message: what was found.
        hint: what would have been valid.
    """
    return InputError(Diagnostic("Usage", message, None, hint))


class RunError(FactoryError):
    """A factory that failed a check, or a run that failed. Exit status 1."""

    exit_status = 1


class MissingError(FactoryError):
    """Something is missing on this machine; the message says what to install. Exit status 3."""

    exit_status = 3


class StoppedError(FactoryError):
    """The user, or the system, has stopped the program. Exit status 130."""

    exit_status = 130


def printed(diagnostics: Sequence[Diagnostic], noun: str) -> list[str]:
    """The texts of the first SHOWN diagnostics, and a line with the number of the others."""
    more = len(diagnostics) - SHOWN
    last = [f"... and {more} more {noun}"] if more > 0 else []
    return [*map(str, diagnostics[:SHOWN]), *last]


def did_you_mean(word: str, valid: Sequence[str], noun: str = "") -> str:
    """A hint: the nearest valid name, or a list of the valid ones, at most twelve.

    Args:
        word: the name that is not valid.
        valid: the valid names.
        noun: what they are, in the plural, for the list.
    """
    near = get_close_matches(word, valid, n=1, cutoff=0.6) if len(word) <= WORD else []
    if near:
        return f"did you mean '{near[0]}'?"
    if not valid:
        return f"there is no {noun} to choose from" if noun else ""
    shown = ", ".join(valid[:12]) + (", ..." if len(valid) > 12 else "")
    return f"valid {noun or 'names'}: {shown}"


def listing(names: Iterable[str], most: int = 6) -> str:
    """Names in a sentence: the first few, then how many more.

    Args:
        names: the names.
        most: number of names that are written.
    """
    every = list(names)
    shown = ", ".join(every[:most])
    return shown + (f" and {len(every) - most} more" if len(every) > most else "")
