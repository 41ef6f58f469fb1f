"""The syntax of PAGs: a text becomes statements, and every syntax error is found.

A lawful text takes one fast parse. If that fails, the text is cut at its semicolons and at what
looks like the start of a statement, and each piece is parsed alone.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

from lark import Lark, Token, Transformer, UnexpectedInput, v_args

from factory.support.decimals import UNITS
from factory.support.texts import Findings, quoted
from factory.theory.lang.pag_lessons import (
    FALLBACK,
    FALSE_MIX,
    FALSE_PLACE,
    FALSE_ROOT,
    FALSE_UNIT,
    LESSONS,
)
from factory.theory.lang.recovery import (
    UNLAWFUL,
    Lesson,
    Stuck,
    drive,
    learn,
    open_grammar,
    report_unlawful,
    tokens_of,
)
from factory.theory.lang.statements import (
    CopiedLabel,
    Definition,
    Equation,
    Keyword,
    MixStatement,
    Permission,
    PlaceList,
    Statements,
    Vector,
    WordPair,
    labels_of,
)

_SIGN_OR_WORD = re.compile(r"[\n=(),;]|[^\s=(),;]+")
_WORD = re.compile(r"[\n;]|[^\s=(),;]+")
"""What is looked at in definitions without values: words, and where a line or one of them ends."""

_SIGNS = {"=": "EQUAL", "(": "LPAR", ")": "RPAR", ",": "COMMA", ";": "SEMICOLON"}


@v_args(inline=True)
class _Builder(Transformer[Token, Any]):
    """Makes statements while the text is parsed; attributes are named after the grammar's rules."""

    equation, pair, keyword, copies = Equation, WordPair, Keyword, CopiedLabel

    def start(self, *statements: Any) -> tuple[Any, ...]:
        return statements

    arguments = amount = start

    def copy(self, name: Token, brackets: Token) -> Token:
        number = CopiedLabel(name, brackets).number
        return Token.new_borrow_pos("WORD", f"{name}{number}", name)

    def definition(self, label: Token | CopiedLabel, operation: Token, *rest: Any) -> Definition:
        places = rest[-1] if rest and isinstance(rest[-1], PlaceList) else None
        arguments = rest[0] if rest and rest[0] is not places else ()
        return Definition(label, operation, arguments, places)

    def definitions(self, run: Token, places: PlaceList | None = None) -> list[Definition]:
        made = [Definition(label, operation, words) for label, operation, *words in _words_of(run)]
        made[-1] = made[-1]._replace(places=places)
        return made

    def permission(self, word: Token, *words: Token) -> Permission:
        return Permission(word, words)

    def mix(self, word: Token, *amounts: Sequence[Token]) -> MixStatement:
        return MixStatement(word, amounts)

    def places(self, word: Token, *vectors: Vector) -> PlaceList:
        return PlaceList(word, vectors)

    def vector(self, opening: Token, *rest: Token) -> Vector:
        return Vector(opening, [token for token in rest if token.type == "WORD"])


@cache
def _lark() -> Lark:
    return open_grammar("pag.lark", ["start", "statement", "unlawful"], _Builder())


@cache
def _lessons() -> Mapping[tuple[object, str], Lesson]:
    return learn(_lark(), "statement", LESSONS, _lex)


def _lex(text: str) -> list[Token]:
    """All tokens of a text, those of several signs taken apart."""
    tokens: list[Token] = []
    for token in tokens_of(_lark(), text):
        tokens.extend(_apart(token) if token.type in ("VECTOR", "PLAIN") else (token,))
    return tokens


def _words_of(run: Token) -> Iterator[list[Token]]:
    """The words of each of several definitions, which are one token of the lexer."""
    start, line, left = run.start_pos or 0, run.line or 1, -(run.column or 1)
    words = list[Token]()
    for match in _WORD.finditer(run):
        text = match[0]
        if text == ";":
            yield words
            words = []
        elif text == "\n":
            line, left = line + 1, match.start()
        else:
            begin, end = match.span()
            words.append(Token("WORD", text, start + begin, line, begin - left, line, end - left))
    yield words


def _apart(whole: Token) -> Iterator[Token]:
    """The tokens of `= ( 0, 0, 1 )`, or of definitions, which are one token of the lexer."""
    start, line, left = whole.start_pos or 0, whole.line or 1, -(whole.column or 1)
    for match in _SIGN_OR_WORD.finditer(whole):
        text, (begin, end) = match[0], match.span()
        if text == "\n":
            line, left = line + 1, end - 1
        else:
            kind = _SIGNS.get(text, "WORD")
            yield Token(kind, text, start + begin, line, begin - left, line, end - left)


def spelled(token: Token) -> Vector:
    """The vector of a VECTOR token."""
    _, opening, *rest = _apart(token)
    return Vector(opening, [part for part in rest if part.type == "WORD"])


def read_statements(findings: Findings) -> Statements:
    """The statements of a text; its syntax errors go to `findings`."""
    made = Statements()
    try:
        statements: Any = _lark().parse(findings.source.text, start="start")
    except UnexpectedInput:
        statements = _recover(findings, made)
    for statement in statements:
        _sort_in(statement, made, findings)
    return made


def _sort_in(statement: Any, made: Statements, findings: Findings) -> None:
    """Add a statement to its list; `pair` and `equation` may still turn out to be malformed."""
    if isinstance(statement, list):
        made.definitions += statement
        return
    if isinstance(statement, Definition):
        made.definitions.append(statement)
        return
    if isinstance(statement, Permission):
        made.permissions.append(statement)
        return
    if isinstance(statement, MixStatement):
        made.mixes.append(statement)
        return
    first, second = statement
    if isinstance(statement, Equation) and first == "root":
        made.roots.append(second)
    elif isinstance(statement, Equation) and first == "unit":
        made.units.append(second)
    elif isinstance(statement, WordPair) and second == "parts":
        made.counts.append(first)
    else:
        made.broken.update((*labels_of(first), str(second), str(first).lower()))
        _report_incomplete(statement, findings)


def _report_incomplete(statement: Equation | WordPair, findings: Findings) -> None:
    first, second = statement
    if isinstance(first, CopiedLabel):
        first = Token.new_borrow_pos("WORD", f"{first.name}{first.brackets}", first.name)
    message = f"missing '=' after {quoted(first)}"
    whole = first == "root" or (first == "unit" and second in UNITS)
    hint = f"write: {first} = {second}" + (";" if whole else " ( ... );")
    at = findings.source.after(first)
    if isinstance(statement, Equation):
        message = f"missing '(' after the operation {quoted(second)}"
        hint = f"an operation has parentheses, even around nothing: {first} = {second} ();"
        at = findings.source.after(second)
        if first.lower() in ("root", "unit"):
            message = f"{quoted(first)} is written in small letters"
            hint, at = f"write: {first.lower()} = {second};", findings.source.at(first)
        elif second in UNITS:
            message, hint = f"{quoted(first)} is no length", f"write: unit = {second};"
            at = findings.source.at(first)
    elif first == "parts":
        message = "the number of parts stands before the word"
        hint, at = f"write: {second} parts;", findings.source.at(second)
    findings.add("Syntax", message, at, hint)


def _recover(findings: Findings, made: Statements) -> list[Any]:
    """The statements of a broken text that do parse; each of the others is noted as an error."""
    statements: list[Any] = []
    for piece, ended in _pieces(_lex(findings.source.text)):
        statement = _parse_piece(piece, findings)
        if statement is None:
            made.broken.update(_words(piece))
            if len(piece) > 1 and piece[1].type == "COPIES":
                made.broken.update(CopiedLabel(piece[0], piece[1]).labels())
            named = piece[0].type == "WORD" and len(piece) > 1 and piece[1].type != "LPAR"
            made.nameless |= not named
            continue
        statements.append(statement)
        if not ended:
            hint = "every statement but the last one ends with a semicolon"
            findings.add("Syntax", "missing ';'", findings.source.after(piece[-1]), hint)
    return statements


def _words(piece: Sequence[Token]) -> Iterator[str]:
    for token in piece:
        yield from token.strip('"').replace(",", " ").replace(")", " ").split()


def _parse_piece(piece: list[Token], findings: Findings) -> Any | None:
    """The statement a piece is, or None after its error has been noted."""
    result = drive(_lark(), "statement", piece)
    if not isinstance(result, Stuck):
        return result
    if result.token.type in UNLAWFUL:
        report_unlawful(result.token, findings)
    else:
        _report_stuck(result, piece, findings)
    return None


def _report_stuck(stuck: Stuck, piece: list[Token], findings: Findings) -> None:
    lesson = _lessons().get((stuck.state, stuck.token.type), FALLBACK)
    if piece[0].type == "MIX":
        lesson = FALSE_MIX
    elif piece[0] == "root" and stuck.index >= 3 and piece[1].type == "EQUAL":
        lesson = FALSE_ROOT
    elif piece[0] == "unit" and stuck.index >= 2 and all(t.type != "LPAR" for t in piece):
        lesson = FALSE_UNIT
    elif stuck.token.type == "LPAR" and piece[stuck.index - 1].type == "RPAR":
        opened = sum({"LPAR": 1, "RPAR": -1}.get(t.type, 0) for t in piece[: stuck.index])
        lesson = lesson if opened else FALSE_PLACE
    pairs = pairwise(piece)
    operation = next((word for word, sign in pairs if sign.type == "LPAR"), piece[0])
    words = {
        "found": quoted(stuck.token) if stuck.token else "the end of the statement",
        "before": quoted(piece[stuck.index - 1]) if stuck.index else "",
        "first": piece[0],
        "operation": quoted(operation),
    }
    last, source = piece[max(stuck.index - 1, 0)], findings.source
    places = {
        "found": source.at(stuck.token) if stuck.token else source.after(last),
        "last": source.at(last),
        "behind": source.after(last),
        "first": source.at(piece[0]),
        "second": source.after(piece[0]),
    }
    message, hint = lesson.message.format(**words), lesson.hint.format(**words)
    findings.add("Syntax", message, places[lesson.place], hint)


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
    kinds = [token.type for token in tokens[index : index + 5]]
    if kinds[1:2] == ["COPIES"]:
        del kinds[1]
    kinds = kinds[:4]
    if kinds[:1] in (["ALLOW"], ["MIX"]) and depth <= 0:
        return True
    if kinds[:1] != ["WORD"]:
        return False
    before = tokens[index - 1] if index else None
    if kinds[:2] == ["WORD", "WORD"]:
        return tokens[index + 1] == "parts" and tokens[index].isdecimal()
    if (before and before.type == "EQUAL") or kinds[1:2] != ["EQUAL"]:
        return False
    if depth > 0 and before and before.type != "SEMICOLON" and before.line == tokens[index].line:
        return before.type not in ("COMMA", "LPAR") and kinds[2:] == ["WORD", "LPAR"]
    if tokens[index] == "unit" and kinds[2:3] == ["WORD"] and tokens[index + 2] in UNITS:
        return True
    return tokens[index] == "root" or kinds[2:] == ["WORD", "LPAR"]
