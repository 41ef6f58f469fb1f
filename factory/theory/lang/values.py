"""Values of parameters: the kind that each takes, and the geometry of a part."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from lark import Token

from factory.support.decimals import is_number, number
from factory.support.errors import Position, did_you_mean
from factory.support.texts import Findings, quoted
from factory.theory.lang.pag_syntax import spelled
from factory.theory.lang.statements import Vector
from factory.theory.problem.pag import Value
from factory.theory.problem.parameters import GEOMETRY, ParameterKind


def text_of(token: Token) -> str:
    """The content of a quoted text, in which a quote is doubled."""
    return token[1:-1].replace('""', '"')


class ValueReader:
    """Reads values of one source, whose lengths are in a unit; errors go to its findings."""

    def __init__(self, findings: Findings, unit: str = "m") -> None:
        self.findings, self.unit = findings, unit

    def place(self, raw: Token | Vector) -> Position:
        """Where a value starts."""
        at = self.findings.source.at(raw.opening if isinstance(raw, Vector) else raw)
        whole = isinstance(raw, Token) and raw.type == "VECTOR"
        return replace(at, column=at.column + raw.index("(")) if whole else at

    def read(self, name: str, kind: ParameterKind, raw: Token | Vector) -> Value | None:
        """The value of the parameter `name`, or None after an error (BadValue) has been noted."""
        if isinstance(raw, Token) and raw.type == "VECTOR":
            return self._vector(name, kind, spelled(raw))
        if isinstance(raw, Vector):
            return self._vector(name, kind, raw)
        if raw.type == "STRING" and kind.length == 0:
            return text_of(raw)
        if kind is GEOMETRY["rgba"]:
            return self._colour(name, kind, raw)
        if raw.type == "STRING" or kind.length != 1:
            self._refuse(name, kind, raw, f"takes {kind.wanted}, not {quoted(raw)}")
            return None
        return self._number(name, kind, raw)

    def any(self, name: str, raw: Token | Vector) -> Value | None:
        """A value of any kind: a template's default."""
        if isinstance(raw, Vector):
            length = len(raw.words)
            return self._vector(
                name, ParameterKind(length, "( 0, 0, 1 )" if length > 1 else "1.0"), raw
            )
        return (
            text_of(raw)
            if raw.type == "STRING"
            else self._number(name, ParameterKind(1, "1.0"), raw)
        )

    def _colour(self, name: str, kind: ParameterKind, raw: Token) -> Value | None:
        """A colour by its name in CSS, or by "#rrggbb"."""
        from PIL.ImageColor import colormap, getrgb

        word = text_of(raw) if raw.type == "STRING" else str(raw)
        if word.lower() in colormap or re.fullmatch("#[0-9a-fA-F]{6}", word):
            return (*[float(level) / 255 for level in getrgb(word)], 1.0)
        if is_number(word):
            self._refuse(name, kind, raw, f"takes {kind.wanted}, or a colour, not {quoted(raw)}")
            return None
        near = did_you_mean(word.lower(), sorted(colormap))
        hint = near if near.startswith("did") else f'for example: {name} = steelblue, or "#4682b4"'
        self.findings.add("BadValue", f"{quoted(word)} is no colour", raw, hint)
        return None

    def _vector(self, name: str, kind: ParameterKind, raw: Vector) -> Value | None:
        if kind.length < 2 or len(raw.words) != kind.length:
            count = f"{len(raw.words)} number{'s' * (len(raw.words) != 1)} in parentheses"
            problem = f"takes {kind.wanted}, not {count}"
            self._refuse(name, kind, raw.opening, problem, _better(kind, raw.words))
            return None
        values = [self._number(name, kind, word) for word in raw.words]
        numbers = tuple(value for value in values if value is not None)
        if len(numbers) < len(values):
            return None
        if not kind.zero and not any(numbers):
            self._refuse(name, kind, raw.opening, "is all zero")
            return None
        return numbers

    def _number(self, name: str, kind: ParameterKind, word: Token) -> float | None:
        value = number(word, self.unit if kind.long else "m")
        if value is not None and kind.allows(value):
            return value
        why = f"takes {kind.wanted}, not {quoted(word)}"
        if value is None:
            why = f"takes {kind.wanted}; {quoted(word)} is not a number"
            if is_number(word):
                why = f"takes {kind.wanted}; {quoted(word)} overflows"
            elif word.lower().lstrip("+-") in ("inf", "infinity", "nan"):
                why = f"takes {kind.wanted}; {quoted(word)} is not a finite number"
        hint = ""
        if kind.long and (unit := re.fullmatch(r"([+-]?[0-9.]+)(m|cm|mm|in)", word)):
            hint = f"write {unit[1]}, and in a line of its own, for all lengths: unit = {unit[2]};"
        self._refuse(name, kind, word, why, hint)
        return None

    def _refuse(
        self, name: str, kind: ParameterKind, token: Token, problem: str, better: str = ""
    ) -> None:
        hint = better or f"for example: {name} = {kind.example}"
        if kind.length == 0 and token.type == "WORD":
            hint = f'in quotes: {name} = "{token}"'
        self.findings.add("BadValue", f"{quoted(name)} {problem}", token, hint)


def _better(kind: ParameterKind, words: Sequence[Token]) -> str:
    """A hint for a rotation, or for a colour of three numbers; "" for other values."""
    if kind is GEOMETRY["quat"]:
        return "(w, x, y, z); in degrees, 90 about z: turn = ( 0, 0, 90 )"
    levels = [value for word in words if (value := number(word)) is not None and value >= 0]
    if kind is not GEOMETRY["rgba"] or len(levels) != 3 or len(words) != 3 or max(levels) > 255:
        return ""
    if max(levels) <= 1:
        return f"the last is opacity: rgba = ( {', '.join(words)}, 1 )"
    return 'levels from 0 to 255 are written so: rgba = "#{:02x}{:02x}{:02x}"'.format(
        *map(round, levels)
    )
