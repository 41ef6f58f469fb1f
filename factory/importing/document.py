"""Nested documents, JSON or YAML, with the place of every value in its text."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from factory.lang.source import Source, quoted
from factory.support.errors import Diagnostic, InputError, Position

Kind = Literal["object", "list", "text", "number", "boolean", "null"]

NAMES = {"object": "an object", "list": "a list"}
"""Kinds in words."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DocumentNode:
    """A value where it stands. `content`: pairs of key and value of an object, the values of a
    list, else a str, float, bool or None. Values may nest without end, so they are not compared
    or printed."""

    kind: Kind
    content: Any
    position: Position

    @property
    def words(self) -> str:
        """What it is, for a message."""
        if self.kind == "text":
            return quoted(self.content)
        if self.kind == "number":
            return f"{self.content:g}"
        if self.kind == "boolean":
            return "true" if self.content else "false"
        return NAMES.get(self.kind, self.kind)


def syntax_error(source: Source, line: int, column: int, message: str, hint: str) -> InputError:
    """A document that cannot be read on from here (from 1)."""
    line = min(max(line, 1), len(source.lines))
    at = Position(source.file, line, max(column, 1), source.lines[line - 1])
    return InputError(Diagnostic("Syntax", message, at, hint))
