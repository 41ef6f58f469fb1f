"""Values of parameters: the kind that each takes, and the geometry of a part."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

from lark import Token

from factory.support.decimals import is_number, number
from factory.support.errors import Position, did_you_mean
from factory.support.texts import Findings, quoted
from factory.theory.lang.pag_syntax import spelled
from factory.theory.lang.statements import Vector
from factory.theory.problem.pag import Value


@dataclass(frozen=True, slots=True)
class Kind:
    """The kind of a parameter: `length` 0 is a text, 1 a number, n a vector of n numbers.

    Each number lies in [low, high], and above 0 where `positive`; `zero`: a vector may be all zero;
    `long`: it is a length, in the unit of the text. `example` is shown with an error.
    """

    length: int
    example: str
    low: float = -math.inf
    high: float = math.inf
    positive: bool = False
    zero: bool = True
    long: bool = False

    def allows(self, number: float) -> bool:
        """Whether one number lies within the bounds."""
        return self.low <= number <= self.high and (number > 0 or not self.positive)

    def fits(self, numbers: tuple[float, ...]) -> bool:
        """Whether these finite numbers are a value of this kind."""
        if not 0 < len(numbers) == self.length or not (self.zero or any(numbers)):
            return False
        return all(math.isfinite(value) and self.allows(value) for value in numbers)

    @property
    def wanted(self) -> str:
        """The kind in words."""
        if self.length == 0:
            return "a text in double quotes"
        sort = "positive " if self.positive else ""
        among = f" from {self.low:g} to {self.high:g}" if math.isfinite(self.high) else ""
        if self.low == 0 and not among:
            among = " >= 0"
        return (
            f"a {sort}number{among}" if self.length == 1 else f"{self.length} {sort}numbers{among}"
        )


GEOMETRY: Mapping[str, Kind] = MappingProxyType(
    {
        "mesh": Kind(0, '"bricks/3001.obj"'),
        "scale": Kind(1, "0.001", positive=True, long=True),
        "pos": Kind(3, "( 0, 0, 0.1 )", long=True),
        "quat": Kind(4, "( 1, 0, 0, 0 )", zero=False),
        "density": Kind(1, "1050", positive=True),
        "mass": Kind(1, "0.1", positive=True),
        "rgba": Kind(4, "( 0.8, 0.1, 0.1, 1 )", low=0.0, high=1.0),
        "box": Kind(3, "( 0.1, 0.1, 0.05 )", positive=True, long=True),
        "cylinder": Kind(2, "( 0.02, 0.1 )", positive=True, long=True),
        "sphere": Kind(1, "0.05", positive=True, long=True),
        "fed": Kind(1, "0.61", low=-3.15, high=3.15),
    }
)

WRITTEN: Mapping[str, Kind] = MappingProxyType({**GEOMETRY, "turn": Kind(3, "( 0, 0, 90 )")})
"""The same, and those that a text may have in their place: `turn`, which is read as a `quat`."""


def kind_of(default: Value, high: float = math.inf) -> Kind:
    """The kind of a template's parameter, from its default: one >= 0 has no negative values."""
    if isinstance(default, str):
        return Kind(0, f'"{default}"')
    if isinstance(default, tuple):
        return Kind(len(default), "( " + ", ".join(map(repr, default)) + " )")
    return Kind(1, repr(default), low=0.0 if default >= 0 else -math.inf, high=high)


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

    def read(self, name: str, kind: Kind, raw: Token | Vector) -> Value | None:
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
            return self._vector(name, Kind(length, "( 0, 0, 1 )" if length > 1 else "1.0"), raw)
        return text_of(raw) if raw.type == "STRING" else self._number(name, Kind(1, "1.0"), raw)

    def _colour(self, name: str, kind: Kind, raw: Token) -> Value | None:
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

    def _vector(self, name: str, kind: Kind, raw: Vector) -> Value | None:
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

    def _number(self, name: str, kind: Kind, word: Token) -> float | None:
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

    def _refuse(self, name: str, kind: Kind, token: Token, problem: str, better: str = "") -> None:
        hint = better or f"for example: {name} = {kind.example}"
        if kind.length == 0 and token.type == "WORD":
            hint = f'in quotes: {name} = "{token}"'
        self.findings.add("BadValue", f"{quoted(name)} {problem}", token, hint)


def _better(kind: Kind, words: Sequence[Token]) -> str:
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
