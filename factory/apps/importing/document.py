"""Nested documents, JSON or YAML, with the position of every value in the text.

The usual loaders keep no positions and are recursive; a document here may be nested arbitrarily
deep.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, Literal

from lark import Lark, Token, Transformer, v_args
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from factory.api import Diagnostic, InputError
from factory.support.decimals import is_number
from factory.support.errors import Position
from factory.support.texts import Source, quoted
from factory.support.version import optional

Kind = Literal["object", "list", "text", "number", "boolean", "null"]

NAMES = {"object": "an object", "list": "a list"}
"""Names of kinds in messages."""

GRAMMAR = r"""
?start: value
?value: object | array | TEXT -> text | NUMBER -> number | WORD -> word
object: OPEN (pair ("," pair)*)? "}"
array: BRACKET (value ("," value)*)? "]"
pair: TEXT ":" value
OPEN: "{"
BRACKET: "["
TEXT: /"(?:[^"\\\x00-\x1f]++|\\["\\\/bfnrt]|\\u[0-9A-Fa-f]{4})*+"/
NUMBER: /-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?(?![\w.])/
WORD: /(?:true|false|null)\b/
%ignore /[ \t\r\n]+/
"""
"""JSON (RFC 8259)."""

JSON_HINT = "JSON has objects { }, lists [ ], texts in double quotes, numbers, true, false and null"
YAML_HINT = "one YAML document of mappings, sequences and scalars"

DEEPEST = 1_000
"""The greatest nesting depth of YAML: libyaml takes time quadratic in it, and from version 0.2.6 on
refuses greater depths itself."""
TOO_DEEP = f"more than {DEEPEST} values are nested here"

YAML_WORDS = {"true": True, "false": False, "null": None, "~": None, "": None}
"""Plain YAML scalars that are neither a number of the PAG language nor a text."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DocumentNode:
    """A value with its position. `content`: the pairs of key and value of an object, the values of
    a list, else a str, float, bool or None. Values may be nested arbitrarily deep, so they are not
    compared or printed."""

    kind: Kind
    content: Any
    position: Position

    @property
    def words(self) -> str:
        """The value in the words of a message."""
        if self.kind == "text":
            return quoted(self.content)
        if self.kind == "number":
            return f"{self.content:g}"
        if self.kind == "boolean":
            return "true" if self.content else "false"
        return NAMES.get(self.kind, self.kind)


def read_json(source: Source) -> DocumentNode:
    """The value of a JSON text. Raises InputError (Syntax) at the first fault."""
    parser = Lark(GRAMMAR, parser="lalr", transformer=_JsonNodes(source))
    try:
        root: Any = parser.parse(source.text)
    except UnexpectedInput as error:
        line, column = error.line, error.column
        if isinstance(error, UnexpectedToken) and error.token.type != "$END":
            message = f"{quoted(str(error.token))} is not expected here"
        elif isinstance(error, UnexpectedCharacters):
            start = error.pos_in_stream or 0
            message = f"{quoted(source.text[start : start + 20])} is not JSON"
        else:
            message = "the text ends too early"
            line, column = len(source.lines), len(source.lines[-1]) + 1
        raise _syntax_error(source, line, column, message, JSON_HINT) from None
    return root  # type: ignore[no-any-return]


@v_args(inline=True)
class _JsonNodes(Transformer[Token, DocumentNode]):
    """Builds values during parsing, without recursion."""

    def __init__(self, source: Source) -> None:
        super().__init__()
        self.source = source

    def object(self, opening: Token, *pairs: Any) -> DocumentNode:
        return DocumentNode("object", pairs, self.source.at(opening))

    def array(self, opening: Token, *values: Any) -> DocumentNode:
        return DocumentNode("list", values, self.source.at(opening))

    def pair(self, key: Token, value: DocumentNode) -> tuple[DocumentNode, DocumentNode]:
        return self.text(key), value

    def text(self, token: Token) -> DocumentNode:
        # pairs of surrogates are one character; a single one is none
        spelled = json.loads(token).encode("utf-16", "surrogatepass")
        return DocumentNode("text", spelled.decode("utf-16", "replace"), self.source.at(token))

    def number(self, token: Token) -> DocumentNode:
        return DocumentNode("number", float(token), self.source.at(token))

    def word(self, token: Token) -> DocumentNode:
        return _constant(json.loads(token), self.source.at(token))


def read_yaml(source: Source) -> DocumentNode:
    """The value of a YAML text, from the events of PyYAML. Raises InputError (Syntax) at the first
    fault, and MissingError if PyYAML is not installed."""
    yaml = optional("yaml", "PyYAML", "reading YAML", "yaml", "write the tree as JSON")
    nodes = _YamlNodes(source)
    try:
        for event in yaml.parse(source.text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            nodes.take(type(event).__name__, event)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        message = " ".join(filter(None, (error.context, error.problem)))
        if "nesting depth" in message:
            message = TOO_DEEP
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise _syntax_error(source, line, column, message, YAML_HINT) from None
    except yaml.YAMLError as error:
        raise _syntax_error(source, 1, 1, str(error).splitlines()[0], YAML_HINT) from None
    if len(nodes.done) != 1:
        what = "is empty" if not nodes.done else f"has {len(nodes.done)} documents"
        raise _syntax_error(source, 1, 1, f"the file {what}", YAML_HINT)
    return nodes.done[0]


class _YamlNodes:
    """Assembles values from events; incomplete ones are on a stack."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.open: list[tuple[Any, list[DocumentNode]]] = []
        self.done: list[DocumentNode] = []
        self.anchors: dict[str, DocumentNode] = {}

    def take(self, kind: str, event: Any) -> None:
        """Process one event."""
        if kind in ("MappingStartEvent", "SequenceStartEvent"):
            self._check_tag(event)
            if len(self.open) == DEEPEST:
                raise self._error(event, TOO_DEEP)
            self.open.append((event, []))
        elif kind == "SequenceEndEvent":
            start, values = self.open.pop()
            self._add(start, DocumentNode("list", tuple(values), self._at(start)))
        elif kind == "MappingEndEvent":
            start, values = self.open.pop()
            pairs = tuple(zip(values[::2], values[1::2], strict=True))
            self._add(start, DocumentNode("object", pairs, self._at(start)))
        elif kind == "ScalarEvent":
            self._check_tag(event)
            self._add(event, self._scalar(event))
        elif kind == "AliasEvent":
            if event.anchor not in self.anchors:
                raise self._error(event, f"there is no anchor {quoted(event.anchor)} before here")
            self._add(None, self.anchors[event.anchor])

    def _add(self, event: Any, value: DocumentNode) -> None:
        if event is not None and event.anchor:
            self.anchors[event.anchor] = value
        (self.open[-1][1] if self.open else self.done).append(value)

    def _scalar(self, event: Any) -> DocumentNode:
        at, text = self._at(event), event.value
        plain = event.implicit[0]
        if plain and text in YAML_WORDS:
            return _constant(YAML_WORDS[text], at)
        if plain and is_number(text):
            return DocumentNode("number", float(text), at)
        return DocumentNode("text", text, at)

    def _check_tag(self, event: Any) -> None:
        if event.tag not in (None, "!", "tag:yaml.org,2002:str"):
            raise self._error(event, f"the tag {quoted(event.tag)} is not supported")

    def _at(self, event: Any) -> Position:
        line, column = event.start_mark.line, event.start_mark.column
        line = min(line, len(self.source.lines) - 1)
        return Position(self.source.file, line + 1, column + 1, self.source.lines[line])

    def _error(self, event: Any, message: str) -> InputError:
        at = self._at(event)
        return InputError(Diagnostic("Syntax", message, at, YAML_HINT))


def _constant(content: bool | None, at: Position) -> DocumentNode:
    return DocumentNode("null" if content is None else "boolean", content, at)


def _syntax_error(source: Source, line: int, column: int, message: str, hint: str) -> InputError:
    """The error of a document that cannot be parsed beyond this line and column (from 1)."""
    line = min(max(line, 1), len(source.lines))
    at = Position(source.file, line, max(column, 1), source.lines[line - 1])
    return InputError(Diagnostic("Syntax", message, at, hint))
