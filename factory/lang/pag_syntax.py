"""The syntax of PAGs: a text becomes statements, and every syntax error is found.

A lawful text takes one fast parse. If that fails, the text is cut at its semicolons and at what
looks like the start of a statement, and each piece is parsed alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple, cast

from lark import Lark, Token, Transformer, UnexpectedInput

from factory.lang.pag_lessons import FALLBACK, FALSE_ROOT, LESSONS
from factory.lang.recovery import UNLAWFUL, Lesson, Stuck, drive, learn, unlawful_words
from factory.lang.source import Findings, Source, quoted

_SIGN_OR_WORD = re.compile(r"[=(),]|[^\s=(),]+")
_SIGNS = {"=": "EQUAL", "(": "LPAR", ")": "RPAR", ",": "COMMA"}


class Vector(NamedTuple):
    """`( 0, 0, 1 )`: its parenthesis and its words."""

    opening: Token
    words: list[Token]


class Keyword(NamedTuple):
    """`name = value`, an argument; a VECTOR token is a vector still in one piece."""

    name: Token
    value: Token | Vector


class Definition(NamedTuple):
    """`label = operation ( arguments )`."""

    label: Token
    operation: Token
    arguments: list[Token | Keyword]


class Equation(NamedTuple):
    """`root = label`."""

    left: Token
    right: Token


class WordPair(NamedTuple):
    """`6 parts`."""

    first: Token
    second: Token


@dataclass(slots=True)
class Statements:
    """The statements of a text; `broken` are the words of those that did not parse, `nameless`
    tells that one of those does not even start with the label it defines."""

    definitions: list[Definition] = field(default_factory=list)
    roots: list[Token] = field(default_factory=list)
    counts: list[Token] = field(default_factory=list)
    broken: set[str] = field(default_factory=set)
    nameless: bool = False


class _Builder(Transformer[Token, Any]):
    """Makes statements as the parser goes; methods are named after the grammar's rules."""

    def start(self, children: list[Any]) -> list[Any]:
        return children

    def definition(self, children: list[Any]) -> Definition:
        arguments = children[2] if len(children) > 2 else []
        return Definition(children[0], children[1], arguments)

    def equation(self, children: list[Any]) -> Equation:
        return Equation(children[0], children[1])

    def pair(self, children: list[Any]) -> WordPair:
        return WordPair(children[0], children[1])

    def arguments(self, children: list[Any]) -> list[Any]:
        return children

    def positional(self, children: list[Any]) -> Token:
        token: Token = children[0]
        return token

    def keyword(self, children: list[Any]) -> Keyword:
        return Keyword(children[0], children[1])

    def vector(self, children: list[Any]) -> Vector:
        return Vector(children[0], [token for token in children if token.type == "WORD"])


@cache
def _lark() -> Lark:
    return Lark.open(
        "pag.lark",
        rel_to=__file__,
        parser="lalr",
        lexer="basic",
        start=["start", "statement", "unlawful"],
        transformer=_Builder(),
        maybe_placeholders=False,
    )


@cache
def _lessons() -> Mapping[tuple[object, str], Lesson]:
    return learn(_lark(), "statement", LESSONS, _lex)


def _lex(text: str) -> list[Token]:
    """All tokens of a text, vectors taken apart."""
    tokens: list[Token] = []
    for token in _lark().lex(text):
        tokens.extend(_apart(token) if token.type == "VECTOR" else (token,))
    return tokens


def _apart(token: Token) -> Iterator[Token]:
    """The tokens of `= ( 0, 0, 1 )`, which the lexer takes at one stroke."""
    for match in _SIGN_OR_WORD.finditer(token):
        kind = _SIGNS.get(match[0], "WORD")
        offset = match.start()
        start, column = (token.start_pos or 0) + offset, (token.column or 1) + offset
        yield Token(kind, match[0], start, token.line, column, token.line, column + len(match[0]))


def spelled(token: Token) -> Vector:
    """A VECTOR token as the vector it is."""
    _, opening, *rest = _apart(token)
    return Vector(opening, [part for part in rest if part.type == "WORD"])


def draft_of(source: Source, findings: Findings) -> Statements:
    """The statements of a text; its syntax errors go to `findings`."""
    draft = Statements()
    try:
        statements = cast("list[Any]", _lark().parse(source.text, start="start"))
    except UnexpectedInput:
        statements = _recover(source, findings, draft)
    for statement in statements:
        _sort_in(statement, draft, source, findings)
    return draft


def _sort_in(statement: Any, draft: Statements, source: Source, findings: Findings) -> None:
    """Put a statement where it belongs; `pair` and `equation` may yet lack a sign."""
    if isinstance(statement, Definition):
        draft.definitions.append(statement)
        return
    first, second = statement
    if isinstance(statement, Equation) and first == "root":
        draft.roots.append(second)
    elif isinstance(statement, WordPair) and second == "parts":
        draft.counts.append(first)
    else:
        draft.broken.update((str(first), str(second)))
        _report_incomplete(statement, source, findings)


def _report_incomplete(statement: Equation | WordPair, source: Source, findings: Findings) -> None:
    first, second = statement
    if isinstance(statement, Equation):
        message = f"missing '(' after the operation {quoted(second)}"
        hint = f"an operation has parentheses, even around nothing: {first} = {second} ();"
        findings.add("Syntax", message, source.after(second), hint)
    elif first == "parts":
        message = "the number of parts stands before the word"
        findings.add("Syntax", message, source.at(second), f"write: {second} parts;")
    else:
        hint = f"write: {first} = {second}" + (";" if first == "root" else " ( ... );")
        findings.add("Syntax", f"missing '=' after {quoted(first)}", source.after(first), hint)


def _recover(source: Source, findings: Findings, draft: Statements) -> list[Any]:
    """The statements of a broken text that do parse; an error for each of the others."""
    statements: list[Any] = []
    for piece, ended in _pieces(_lex(source.text)):
        statement = _parse_piece(piece, source, findings)
        if statement is None:
            draft.broken.update(_words(piece))
            draft.nameless |= not _is_named(piece)
            continue
        statements.append(statement)
        if not ended:
            hint = "every statement but the last one ends with a semicolon"
            findings.add("Syntax", "missing ';'", source.after(piece[-1]), hint)
    return statements


def _words(piece: Sequence[Token]) -> Iterator[str]:
    for token in piece:
        yield from token.strip('"').replace(",", " ").replace(")", " ").split()


def _is_named(piece: Sequence[Token]) -> bool:
    return piece[0].type == "WORD" and len(piece) > 1 and piece[1].type != "LPAR"


def _parse_piece(piece: list[Token], source: Source, findings: Findings) -> Any | None:
    """The statement a piece is, or None after its error has been noted."""
    result = drive(_lark(), "statement", piece)
    if not isinstance(result, Stuck):
        return result
    if result.token.type in UNLAWFUL:
        message, hint = unlawful_words(result.token)
        findings.add("Syntax", message, source.at(result.token), hint)
    else:
        _report_stuck(result, piece, source, findings)
    return None


def _report_stuck(stuck: Stuck, piece: list[Token], source: Source, findings: Findings) -> None:
    lesson = _lessons().get((stuck.state, stuck.token.type), FALLBACK)
    if piece[0] == "root" and stuck.index >= 3 and piece[1].type == "EQUAL":
        lesson = FALSE_ROOT
    words = {
        "found": quoted(stuck.token) if stuck.token else "the end of the statement",
        "before": quoted(piece[stuck.index - 1]) if stuck.index else "",
        "first": piece[0],
        "operation": quoted(_operation(piece)),
    }
    last = piece[max(stuck.index - 1, 0)]
    place = lesson.place if stuck.token or lesson.place != "found" else "behind"
    places = {
        "found": source.at(stuck.token),
        "last": source.at(last),
        "behind": source.after(last),
        "first": source.at(piece[0]),
        "second": source.after(piece[0]),
    }
    at = places[place]
    findings.add("Syntax", lesson.message.format(**words), at, lesson.hint.format(**words))


def _operation(piece: Sequence[Token]) -> str:
    """The word before the first parenthesis of a piece, or its first token."""
    pairs = pairwise(piece)
    return str(next((word for word, sign in pairs if sign.type == "LPAR"), piece[0]))


def _pieces(tokens: list[Token]) -> Iterator[tuple[list[Token], bool]]:
    """The tokens cut into statements, each with whether a semicolon ends it (or the text does)."""
    piece: list[Token] = []
    depth = 0
    for index, token in enumerate(tokens):
        if piece and _starts(tokens, index, depth):
            yield piece, False
            piece, depth = [], 0
        if token.type == "SEMICOLON" and (depth <= 0 or _cuts(tokens, index + 1)):
            if piece:
                yield piece, True
            piece, depth = [], 0
            continue
        depth += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
        piece.append(token)
    if piece:
        yield piece, True


def _cuts(tokens: Sequence[Token], index: int) -> bool:
    """Whether a semicolon inside parentheses ends a statement: a new one or nothing follows it."""
    return index >= len(tokens) or tokens[index].type == "SEMICOLON" or _starts(tokens, index, 0)


def _starts(tokens: Sequence[Token], index: int, depth: int) -> bool:
    """Whether a statement starts here: `label = operation (`, `root =` or `6 parts`."""
    kinds = [token.type for token in tokens[index : index + 4]]
    if kinds[:1] != ["WORD"]:
        return False
    before = tokens[index - 1] if index else None
    if kinds[:2] == ["WORD", "WORD"]:
        return tokens[index + 1] == "parts" and tokens[index].isdecimal()
    if (before and before.type == "EQUAL") or kinds[1:2] != ["EQUAL"]:
        return False
    if depth > 0 and before and before.type != "SEMICOLON" and before.line == tokens[index].line:
        return before.type not in ("COMMA", "LPAR") and kinds[2:] == ["WORD", "LPAR"]
    return tokens[index] == "root" or kinds[2:] == ["WORD", "LPAR"]
