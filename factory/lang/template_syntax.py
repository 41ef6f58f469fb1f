"""The syntax of templates: a text becomes a header and clauses, and every syntax error is found.

Texts are short, so there is one path: the text is cut at its semicolons, and each piece is parsed
alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

from lark import Lark, Token, Transformer

from factory.lang.pag_syntax import Vector
from factory.lang.recovery import END, UNLAWFUL, Stuck, drive, unlawful_words
from factory.lang.source import Findings, Source, quoted
from factory.support.errors import did_you_mean

Words = list[Token]

FORMS: Mapping[str, str] = MappingProxyType(
    {
        "R": "R = < dot, dot, dot >;",
        "j": "j = 3;",
        "~": "~ = { A1 = A2 = B3 };",
        "<a; b>": "<a; b> = < LAB1, LAB2, nopart; nopart, nopart, LAB3 >;",
        "F": "F = navigation on W to ( A1 + 2r, A2 + 2r, B3 ) within eps;",
        "further": "further = insert;",
        "parameters": "parameters = ( dwell = 1.0 );",
    }
)
NEEDED = ("R", "j", "~", "<a; b>", "F")
HEADER = "mate = (R, j, ~, <a; b>, F) where"


class Labels(NamedTuple):
    """`<a; b>`: the words of a and of b."""

    before: Words
    after: Words


class RawLaw(NamedTuple):
    """`F = name on W to goals within eps for dwell`; each goal is the words of a point."""

    name: Token
    goals: list[Words]
    eps: Token
    dwell: Token | None


class ParameterClause(NamedTuple):
    """`parameters = geometry and ( name = value )`."""

    geometry: bool
    values: list[tuple[Token, Token | Vector]]


class Clause(NamedTuple):
    """What stands behind the `=` of a clause, and its place."""

    kind: str
    head: Token
    content: Any


@dataclass(slots=True)
class TemplateDraft:
    """The clauses of a text that did parse, by kind; `broken` are the kinds that did not."""

    name: Token | None = None
    clauses: dict[str, Clause] = field(default_factory=dict)
    broken: set[str] = field(default_factory=set)


class _Builder(Transformer[Token, Any]):
    """Makes the contents of clauses; methods are named after the grammar's rules."""

    def header(self, children: list[Any]) -> Any:
        return children[0]

    def robots(self, children: list[Any]) -> Any:
        return children[0]

    carrier = further = name = value = parameters = identifications = robots

    def labels(self, children: list[Any]) -> Labels:
        return Labels(children[0], children[1])

    def law(self, children: list[Any]) -> RawLaw:
        return RawLaw(*children)

    def names(self, children: list[Any]) -> list[Any]:
        return children

    def point(self, children: list[Any]) -> Words:
        return children

    classes = goals = defaults = names

    def dwell(self, children: list[Any]) -> Token | None:
        return children[0] if children else None

    def geometry(self, children: list[Any]) -> ParameterClause:
        return ParameterClause(True, children[0] if children else [])

    def plain(self, children: list[Any]) -> ParameterClause:
        return ParameterClause(False, children[0])

    def default(self, children: list[Any]) -> tuple[Token, Any]:
        return children[0], children[1]

    def vector(self, children: list[Any]) -> Vector:
        words = [token for token in children if token.type not in ("LPAR", "COMMA", "RPAR")]
        return Vector(children[0], words)


# `class` is a keyword of Python, so that rule's method cannot be written as the others are.
setattr(_Builder, "class", _Builder.names)


@cache
def _lark() -> Lark:
    return Lark.open(
        "template.lark",
        rel_to=__file__,
        parser="lalr",
        lexer="basic",
        start=["header", "clause", "unlawful"],
        transformer=_Builder(),
        maybe_placeholders=False,
    )


def template_draft_of(source: Source, findings: Findings) -> TemplateDraft:
    """The clauses of a text; its syntax errors go to `findings`."""
    draft = TemplateDraft()
    tokens = list(_lark().lex(source.text))
    if not tokens:
        message = "there is no template: the text is empty"
        findings.add("Syntax", message, source.start(), f"a template starts: {HEADER}")
        return draft
    end = _header_end(tokens)
    if end:
        draft.name = _parse(tokens[:end], "header", HEADER, source, findings)
    else:
        message = "missing header: the clauses belong to no template"
        findings.add("Syntax", message, source.at(tokens[0]), f"a template starts: {HEADER}")
    for piece, ended in _pieces(tokens[end:]):
        if [str(token) for token in piece[1:4]] == ["=", "(", "R"]:
            message, hint = "a second template in one file", "give each template a file of its own"
            findings.add("Syntax", message, source.at(piece[0]), hint)
            break
        _take(piece, draft, source, findings)
        if not ended:
            hint = "every clause but the last one ends with a semicolon"
            findings.add("Syntax", "missing ';'", source.after(piece[-1]), hint)
    _report_missing(tokens[-1], draft, source, findings)
    return draft


def _report_missing(last: Token, draft: TemplateDraft, source: Source, findings: Findings) -> None:
    for kind in NEEDED:
        if kind not in draft.clauses and kind not in draft.broken:
            hint = f"add it, for example: {FORMS[kind]}"
            findings.add("Syntax", f"missing clause {kind}", source.after(last), hint)


def _take(piece: list[Token], draft: TemplateDraft, source: Source, findings: Findings) -> None:
    """Parse one clause into the draft."""
    head, kind = piece[0], _kind(piece)
    if kind is None:
        _report_unknown(piece, draft, source, findings)
        return
    content = _parse(piece, "clause", FORMS[kind], source, findings)
    if content is None:
        draft.broken.add(kind)
    elif kind in draft.clauses:
        where = f"in line {draft.clauses[kind].head.line}"
        message = f"the clause {kind} is given twice, first {where}"
        findings.add("Syntax", message, source.at(head), "remove one of the two")
    else:
        draft.clauses[kind] = Clause(kind, head, content)


def _kind(piece: Sequence[Token]) -> str | None:
    """The kind of clause a piece starts as; None if it is none."""
    if piece[0] == "<":
        return "<a; b>"
    return str(piece[0]) if piece[0] in FORMS else None


def _report_unknown(
    piece: list[Token], draft: TemplateDraft, source: Source, findings: Findings
) -> None:
    head = piece[0]
    unlawful = next((token for token in piece if token.type in UNLAWFUL), None)
    if unlawful:
        message, hint = unlawful_words(unlawful)
        findings.add("Syntax", message, source.at(unlawful), hint)
        draft.broken.update(NEEDED)
        return
    hint = did_you_mean(head, list(FORMS), "clauses")
    draft.broken.update(kind for kind in FORMS if hint == f"did you mean '{kind}'?")
    message = f"there is no clause {quoted(head)}"
    findings.add("Syntax", message, source.at(head), hint)


def _parse(
    piece: list[Token], start: str, form: str, source: Source, findings: Findings
) -> Any | None:
    """What a piece says, or None after its error has been noted."""
    hint = f"it is written like this: {form}"
    unlawful = next((token for token in piece if token.type in UNLAWFUL), None)
    if unlawful:
        message, way_out = unlawful_words(unlawful)
        findings.add("Syntax", message, source.at(unlawful), way_out)
        return None
    result = drive(_lark(), start, piece)
    if not isinstance(result, Stuck):
        return result
    at_end = result.token.type == END
    found = "the end" if at_end else quoted(result.token)
    at = source.after(piece[-1]) if at_end and piece else source.at(result.token)
    findings.add("Syntax", f"expected {_names(result.expected)}, not {found}", at, hint)
    return None


def _names(expected: frozenset[str]) -> str:
    """Kinds of tokens in words: signs and keywords in quotes, any name as `a name`."""
    signs = [_lark().get_terminal(kind) for kind in expected - {"WORD", "STRING", END}]
    names = {"R", "j", "F", "W", "a", "b", "further", "parameters", "geometry"}
    if "WORD" not in expected:
        names = set()
    shown = sorted(f"'{sign.pattern.value}'" for sign in signs if sign.pattern.value not in names)
    also = {"WORD": "a name", "STRING": "a text", END: "';'"}
    words = shown + [word for kind, word in also.items() if kind in expected]
    return " or ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def _header_end(tokens: Sequence[Token]) -> int:
    """The index behind the header: behind its `where`, or where the first clause starts."""
    for index, token in enumerate(tokens):
        if token == "where":
            return index + 1
        if _starts(tokens, index):
            return index
    return len(tokens)


def _pieces(tokens: Sequence[Token]) -> Iterator[tuple[list[Token], bool]]:
    """The tokens cut into clauses, each with whether a semicolon ends it (or the text does)."""
    piece: list[Token] = []
    inside = False
    for index, token in enumerate(tokens):
        if piece and _starts(tokens, index):
            yield _unended(piece)
            piece, inside = [], False
        if token.type == "SEMICOLON" and not inside:
            if piece:
                yield piece, True
            piece = []
            continue
        inside = token == "<" or (inside and token != ">")
        piece.append(token)
    if piece:
        yield _unended(piece)[0], True


def _unended(piece: list[Token]) -> tuple[list[Token], bool]:
    """A piece cut before the next clause: its own semicolon may lie in a list left open."""
    ended = piece[-1].type == "SEMICOLON"
    return (piece[:-1], True) if ended else (piece, False)


def _starts(tokens: Sequence[Token], index: int) -> bool:
    """Whether a clause starts here: a known head and `=`, not inside a list or behind another."""
    here = [str(token) for token in tokens[index : index + 6]]
    if here == ["<", "a", ";", "b", ">", "="]:
        return True
    before = str(tokens[index - 1]) if index else ""
    return here[0] in FORMS and here[1:2] == ["="] and before not in ("(", ",", "=", "{")
