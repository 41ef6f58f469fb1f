"""JSON with the place of every value, nested as deep as it may be: the standard library's reader
knows no places and recurses."""

from __future__ import annotations

import json
from typing import Any

from lark import Lark, Token, Transformer
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from factory.importing.document import DocumentNode, Kind, syntax_error
from factory.lang.source import Source, quoted
from factory.support.errors import InputError

GRAMMAR = r"""
?start: value
?value: object | array | TEXT -> text | NUMBER -> number | WORD -> word
object: OPEN (pair ("," pair)*)? "}"
array: BRACKET (value ("," value)*)? "]"
pair: TEXT ":" value
OPEN: "{"
BRACKET: "["
TEXT: /"(?:[^"\\\x00-\x1f]|\\["\\\/bfnrt]|\\u[0-9A-Fa-f]{4})*"/
NUMBER: /-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?(?![\w.])/
WORD: /(?:true|false|null)\b/
%ignore /[ \t\r\n]+/
"""
HINT = "JSON has objects { }, lists [ ], texts in double quotes, numbers, true, false and null"


def read_json(source: Source) -> DocumentNode:
    """The value of a JSON text (RFC 8259). Raises InputError (Syntax) at the first fault."""
    values: Transformer[Token, DocumentNode] = _Values(source)
    parser = Lark(GRAMMAR, parser="lalr", transformer=values)
    try:
        found: Any = parser.parse(source.text)
    except UnexpectedInput as error:
        raise _fault(source, error) from None
    return found  # type: ignore[no-any-return]


class _Values(Transformer[Token, DocumentNode]):
    """Makes values while the text is parsed, so nothing recurses."""

    def __init__(self, source: Source) -> None:
        super().__init__()
        self.source = source

    def object(self, children: list[Any]) -> DocumentNode:
        return self._value("object", tuple(children[1:]), children[0])

    def array(self, children: list[Any]) -> DocumentNode:
        return self._value("list", tuple(children[1:]), children[0])

    def pair(self, children: list[Any]) -> tuple[DocumentNode, DocumentNode]:
        return self.text(children[:1]), children[1]

    def text(self, children: list[Any]) -> DocumentNode:
        # pairs of surrogates are one character; a single one is none
        spelled = json.loads(children[0]).encode("utf-16", "surrogatepass")
        return self._value("text", spelled.decode("utf-16", "replace"), children[0])

    def number(self, children: list[Any]) -> DocumentNode:
        return self._value("number", float(children[0]), children[0])

    def word(self, children: list[Any]) -> DocumentNode:
        content = json.loads(children[0])
        return self._value("null" if content is None else "boolean", content, children[0])

    def _value(self, kind: Kind, content: Any, token: Token) -> DocumentNode:
        return DocumentNode(kind, content, self.source.at(token))


def _fault(source: Source, error: UnexpectedInput) -> InputError:
    """What lark says, in words."""
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        message = f"{quoted(str(error.token))} is not expected here"
    elif isinstance(error, UnexpectedCharacters):
        start = error.pos_in_stream or 0
        message = f"{quoted(source.text[start : start + 20])} is no JSON"
    else:
        line, column = len(source.lines), len(source.lines[-1]) + 1
        return syntax_error(source, line, column, "the text ends too early", HINT)
    return syntax_error(source, error.line, error.column, message, HINT)
