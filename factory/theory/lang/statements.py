"""The statements of a PAG, as its text has them: values of the syntax, with their tokens."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from lark import Token

COPIES = 10_000
"""The most copies that one definition makes."""


class Vector(NamedTuple):
    """`( 0, 0, 1 )`: its parenthesis and its words."""

    opening: Token
    words: list[Token]


class CopiedLabel(NamedTuple):
    """`screw[4]`: the name of copies, and their number in brackets."""

    name: Token
    brackets: Token

    @property
    def number(self) -> int:
        """The number of copies, at most COPIES + 1."""
        digits = self.brackets.strip("[] \t").lstrip("0") or "0"
        return int(digits) if len(digits) < 9 else COPIES + 1

    def labels(self) -> list[Token]:
        """The labels screw1 to screw4, all at the position of the name."""
        numbers = range(1, min(self.number, COPIES) + 1)
        return [Token.new_borrow_pos("WORD", f"{self.name}{n}", self.name) for n in numbers]


class Keyword(NamedTuple):
    """`name = value`, an argument; a VECTOR token is a vector still in one piece."""

    name: Token
    value: Token | Vector


class PlaceList(NamedTuple):
    """`at ( 0, 0, 0 ), ( 0, 0, 1 )`: its word, which may be wrong, and its vectors."""

    word: Token
    vectors: Sequence[Vector]


class Definition(NamedTuple):
    """`label = operation ( arguments ) at places`."""

    label: Token | CopiedLabel
    operation: Token
    arguments: Sequence[Token | Keyword] = ()
    places: PlaceList | None = None


class Equation(NamedTuple):
    """`root = label`, `unit = mm`."""

    left: Token | CopiedLabel
    right: Token


class WordPair(NamedTuple):
    """`6 parts`."""

    first: Token
    second: Token


class MixStatement(NamedTuple):
    """`mix = 3 truck, 1 van`, `mix = truck, truck, van`: the words of each amount."""

    word: Token
    amounts: Sequence[Sequence[Token]]


class Permission(NamedTuple):
    """`allow ( peg, frame, 0.0005 )`, `allow ( 0.0005 )`."""

    word: Token
    words: Sequence[Token]


@dataclass(slots=True)
class Statements:
    """The statements of a text. `broken`: the words of statements that did not parse; `nameless`:
    whether one of these does not start with the label that it defines."""

    definitions: list[Definition] = field(default_factory=list)
    permissions: list[Permission] = field(default_factory=list)
    mixes: list[MixStatement] = field(default_factory=list)
    units: list[Token] = field(default_factory=list)
    roots: list[Token] = field(default_factory=list)
    counts: list[Token] = field(default_factory=list)
    broken: set[str] = field(default_factory=set)
    nameless: bool = False

    @property
    def mixed(self) -> bool:
        """Whether the text has a mix of products, well formed or not."""
        return bool(self.mixes) or "mix" in self.broken

    @property
    def copied(self) -> list[CopiedLabel]:
        """The labels of definitions that make copies."""
        return [one.label for one in self.definitions if isinstance(one.label, CopiedLabel)]


def labels_of(label: Token | CopiedLabel) -> list[Token]:
    """The labels that a statement defines."""
    return label.labels() if isinstance(label, CopiedLabel) else [label]
