"""The syntax of templates: a text becomes a header and clauses, and every syntax error is found.

The text is cut at its semicolons, and each piece is parsed alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from types import MappingProxyType
from typing import Any, NamedTuple

from lark import Lark, Token, Transformer, v_args

from factory.support.errors import did_you_mean
from factory.support.texts import Findings, quoted, where
from factory.theory.lang.recovery import (
    END,
    UNLAWFUL,
    Stuck,
    drive,
    open_grammar,
    report_unlawful,
    tokens_of,
)
from factory.theory.lang.statements import Vector

Words = Sequence[Token]

FORMS: Mapping[str, str] = MappingProxyType(
    {
        "R": "R = < dot, dot, dot >;",
        "j": "j = 3;",
        "~": "~ = { A1 = A2 = B3 };",
        "<a; b>": "<a; b> = < LAB1, LAB2, nopart; nopart, nopart, LAB3 >;",
        "F": "F = navigation on W to ( A1 + 2r, A2 + 2r, B3 ) within eps;",
        "further": "further = insert;",
        "instead": "instead = insert;",
        "brought": "brought = pick;",
        "failure": "failure = { residual > 5e-4 : again 2 then scrap, lost : scrap };",
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
    goals: Sequence[Words]
    eps: Token
    dwell: Token | None = None


class ParameterClause(NamedTuple):
    """`parameters = geometry and ( name = value )`."""

    geometry: bool
    values: Sequence[tuple[Token, Token | Vector]] = ()


class FailureCase(NamedTuple):
    """`test > limit : responses`: the words of the test, one or two, and those of the responses."""

    test: Words
    responses: Words


class Clause(NamedTuple):
    """The first token of a clause, and what stands behind its `=`."""

    head: Token
    content: Any


@dataclass(slots=True)
class TemplateDraft:
    """The clauses of a text that did parse, by kind; `broken` are the kinds that did not."""

    name: Token | None = None
    clauses: dict[str, Clause] = field(default_factory=dict)
    broken: set[str] = field(default_factory=set)


@v_args(inline=True)
class _Builder(Transformer[Token, Any]):
    """Makes the contents of clauses; attributes are named after the grammar's rules."""

    labels, law = Labels, RawLaw

    def header(self, content: Any) -> Any:
        return content

    robots = carrier = further = instead = brought = failure = parameters = header
    identifications = header

    def names(self, *items: Any) -> tuple[Any, ...]:
        return items

    classes = same = point = goals = defaults = default = cases = test = names

    def case(self, test: Words, *responses: Token) -> FailureCase:
        return FailureCase(test, responses)

    def geometry(self, *values: Any) -> ParameterClause:
        return ParameterClause(True, *values)

    def plain(self, values: Any) -> ParameterClause:
        return ParameterClause(False, values)

    def vector(self, opening: Token, *rest: Token) -> Vector:
        return Vector(opening, [t for t in rest if t.type not in ("COMMA", "RPAR")])


@cache
def _lark() -> Lark:
    return open_grammar("template.lark", ["header", "clause", "unlawful"], _Builder())


def read_clauses(findings: Findings) -> TemplateDraft:
    """The clauses of a text; its syntax errors go to `findings`."""
    draft, source = TemplateDraft(), findings.source
    tokens = list(tokens_of(_lark(), source.text))
    hint = f"a template starts: {HEADER}"
    if not tokens:
        findings.add("Syntax", "there is no template: the text is empty", source.start(), hint)
        return draft
    end = _header_end(tokens)
    if end:
        draft.name = _parse(tokens[:end], "header", HEADER, findings)
    else:
        message = "missing header: the clauses belong to no template"
        findings.add("Syntax", message, tokens[0], hint)
    for piece, ended in _pieces(tokens[end:]):
        if [str(token) for token in piece[1:4]] == ["=", "(", "R"]:
            message, hint = "a second template in one file", "give each template a file of its own"
            findings.add("Syntax", message, piece[0], hint)
            break
        _take(piece, draft, findings)
        if not ended:
            hint = "every clause but the last one ends with a semicolon"
            findings.add("Syntax", "missing ';'", source.after(piece[-1]), hint)
    for kind in NEEDED:
        if kind not in draft.clauses and kind not in draft.broken:
            hint = f"add it, for example: {FORMS[kind]}"
            findings.add("Syntax", f"missing clause {kind}", source.after(tokens[-1]), hint)
    return draft


def _take(piece: list[Token], draft: TemplateDraft, findings: Findings) -> None:
    """Parse one clause into the draft."""
    head = piece[0]
    kind = "<a; b>" if head == "<" else str(head)
    if kind not in FORMS:
        _report_unknown(piece, draft, findings)
        return
    content = _parse(piece, "clause", FORMS[kind], findings)
    if content is None:
        draft.broken.add(kind)
    elif kind in draft.clauses:
        first = findings.source.at(draft.clauses[kind].head)
        before = where(first, findings.source.at(head))
        message = f"the clause {kind} is given twice, first {before}"
        findings.add("Syntax", message, head, "remove one of the two")
    else:
        draft.clauses[kind] = Clause(head, content)


def _report_unknown(piece: list[Token], draft: TemplateDraft, findings: Findings) -> None:
    if _has_unlawful(piece, findings):
        draft.broken.update(NEEDED)
        return
    hint = did_you_mean(piece[0], list(FORMS), "clauses")
    draft.broken.update(kind for kind in FORMS if hint == f"did you mean '{kind}'?")
    findings.add("Syntax", f"there is no clause {quoted(piece[0])}", piece[0], hint)


def _has_unlawful(piece: list[Token], findings: Findings) -> bool:
    """Whether a token that no template contains is in a piece; the first one is noted."""
    unlawful = next((token for token in piece if token.type in UNLAWFUL), None)
    if unlawful is not None:
        report_unlawful(unlawful, findings)
    return unlawful is not None


def _parse(piece: list[Token], start: str, form: str, findings: Findings) -> Any | None:
    """The content of a piece, or None after its error has been noted."""
    if _has_unlawful(piece, findings):
        return None
    result = drive(_lark(), start, piece)
    if not isinstance(result, Stuck):
        return result
    at_end = result.token.type == END
    shown = "the end" if at_end else quoted(result.token)
    at = findings.source.after(piece[-1]) if at_end else result.token
    hint = f"it is written like this: {form}"
    findings.add("Syntax", f"expected {_names(result.expected)}, not {shown}", at, hint)
    return None


def _names(expected: frozenset[str]) -> str:
    """Kinds of tokens in words: signs and keywords in quotes, any name as `a name`."""
    signs = [_lark().get_terminal(kind) for kind in expected - {"WORD", "STRING", END}]
    names = {"R", "j", "F", "W", "a", "b"}
    names |= {"further", "instead", "brought", "failure", "parameters", "geometry"}
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
