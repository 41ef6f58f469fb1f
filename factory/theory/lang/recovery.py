"""Reading on after a syntax error: a text is cut into pieces, each parsed alone.

The message about a malformed piece is found by example, as in Lark's `match_examples`: a `Lesson`
lists malformed pieces, each of which stops the parser in some state at some kind of token. A piece
that stops it in the same state at the same kind gets the message of that lesson.
"""

from __future__ import annotations

import sys
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Literal

import lark
from lark import Lark, Token, Transformer, UnexpectedToken

from factory.support.cache import digest, load, store
from factory.support.texts import Findings, quoted

END = "$END"
UNLAWFUL = frozenset({"STRAY", "UNCLOSED"})

SIGNS = frozenset(";,()=<>{}~.+-")


@dataclass(frozen=True, slots=True)
class Stuck:
    """The place where the parse of a piece stopped: the token, its index, the parser's state, and
    the kinds of token that would have been valid."""

    index: int
    token: Token
    state: object
    expected: frozenset[str]


@dataclass(frozen=True, slots=True)
class Lesson:
    """A mistake: its message, its hint, the place to show, and malformed pieces that make it,
    between bars. Places: the token `found`, the `last` good one or `behind` it, the `first` one or
    behind it (`second`)."""

    message: str
    hint: str
    place: Literal["found", "last", "behind", "first", "second"]
    examples: str


def open_grammar(name: str, start: list[str], builder: Transformer[Token, Any]) -> Lark:
    """The parser of a grammar in this folder; `builder` transforms its rules during the parse. Its
    tables take longer to make than most texts to read: they are kept in the user's cache."""
    grammar = Path(__file__).with_name(name).read_text("utf-8")
    entry = digest(grammar, start, type(builder), lark.__version__, sys.version_info)
    kept = load("grammars", entry)
    if kept is not None:
        return Lark.load(BytesIO(kept))
    parser = Lark(
        grammar,
        parser="lalr",
        lexer="basic",
        start=start,
        transformer=builder,
        maybe_placeholders=False,
    )
    tables = BytesIO()
    parser.save(tables)
    store("grammars", entry, tables.getvalue())
    return parser


def tokens_of(parser: Lark, text: str) -> Iterator[Token]:
    """The tokens of a text, by the lexer that the parser has made already."""
    parse = parser.parse_interactive(text, start=parser.options.start[0])
    yield from parse.lexer_thread.lex(parse.parser_state)  # type: ignore[no-untyped-call]


def drive(parser: Lark, start: str, tokens: Sequence[Token]) -> Any | Stuck:
    """The value of tokens parsed from the symbol `start`, or where the parse stopped."""
    parse = parser.parse_interactive(None, start=start)
    last = tokens[-1] if tokens else Token(END, "", 0, 1, 1)
    result: Any = None
    for index, token in enumerate([*tokens, Token.new_borrow_pos(END, "", last)]):
        try:
            result = parse.feed_token(token)
        except UnexpectedToken as error:
            accepted = frozenset(parse.accepts())  # type: ignore[no-untyped-call]
            return Stuck(index, token, error.state.position, accepted)
    return result


def learn(
    parser: Lark, start: str, lessons: Iterable[Lesson], lex: Callable[[str], list[Token]]
) -> Mapping[tuple[object, str], Lesson]:
    """The lessons by the state of the parser and the kind of token at which it stops."""
    table: dict[tuple[object, str], Lesson] = {}
    for lesson in lessons:
        for example in lesson.examples.split(" | ") if lesson.examples else ():
            stuck = drive(parser, start, lex(example))
            if not isinstance(stuck, Stuck):
                raise ValueError(f"the example {example!r} is well formed")
            table.setdefault((stuck.state, stuck.token.type), lesson)
    return table


def report_unlawful(token: Token, findings: Findings) -> None:
    """Note a character that no statement contains, or a text without its closing quote."""
    message, hint = f"{quoted(token)} has no meaning here", _way_out(token[0])
    if token.type == "UNCLOSED":
        message, hint = "the text is not closed", 'close it with " on the same line'
    findings.add("Syntax", message, token, hint)


def _way_out(character: str) -> str:
    plain = _plain(character)
    if plain:
        return f"write {plain} instead"
    if character in "'`":
        return 'write texts in double quotes, as in "base.stl"'
    hints = {
        "/": "no word contains it; a comment runs from // to the end of the line",
        "#": "a comment runs from // to the end of the line",
        ":": "write = between a name and what it is",
        "[": "numbers lie in parentheses: ( 0, 0, 0.1 ); copies have a whole number: screw[2]",
        "]": "numbers lie in parentheses: ( 0, 0, 0.1 ); copies have a whole number: screw[2]",
    }
    return hints.get(character, "remove it, or put it in a comment: // ...")


def _plain(character: str) -> str:
    """The plain sign of a typographic variant (full width, dash, curly quote), or ""."""
    folded = unicodedata.normalize("NFKC", character)
    if folded != character and folded in SIGNS:
        return folded
    category = unicodedata.category(character)
    if category == "Pd" or character == "\N{MINUS SIGN}":
        return "-"
    return '"' if category in ("Pi", "Pf") else ""
