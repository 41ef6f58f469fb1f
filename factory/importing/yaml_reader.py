"""YAML with the place of every value, from the events of PyYAML: its own loaders know no places,
recurse and build objects.

Plain scalars are numbers as the PAG language writes them, `true`, `false`, `null` and `~`; all else
is text.
"""

from __future__ import annotations

from typing import Any

from factory.importing.document import DocumentNode, syntax_error
from factory.lang.source import Source, quoted
from factory.lang.words import is_number
from factory.support.errors import Diagnostic, InputError, MissingError, Position

_WORDS = {"true": True, "false": False, "null": None, "~": None, "": None}
HINT = "one YAML document of mappings, sequences and scalars"


def read_yaml(source: Source) -> DocumentNode:
    """The value of a YAML text. Raises InputError (Syntax) at the first fault, MissingError where
    PyYAML is not installed."""
    try:
        import yaml
    except ImportError:
        hint = "pip install 'klavins-factory[yaml]', or write the tree as JSON"
        message = "reading YAML takes the package PyYAML"
        raise MissingError(Diagnostic("Missing", message, None, hint)) from None
    values = _Values(source)
    try:
        for event in yaml.parse(source.text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            values.take(type(event).__name__, event)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        message = " ".join(filter(None, (error.context, error.problem)))
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        raise syntax_error(source, line, column, message, HINT) from None
    except yaml.YAMLError as error:
        raise syntax_error(source, 1, 1, str(error).splitlines()[0], HINT) from None
    return values.document()


class _Values:
    """Puts values together, the open ones on a stack."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.open: list[tuple[Any, list[DocumentNode]]] = []
        self.done: list[DocumentNode] = []
        self.anchors: dict[str, DocumentNode] = {}

    def take(self, kind: str, event: Any) -> None:
        if kind in ("MappingStartEvent", "SequenceStartEvent"):
            self._tag(event)
            self.open.append((event, []))
        elif kind in ("MappingEndEvent", "SequenceEndEvent"):
            start, values = self.open.pop()
            self._add(start, self._collected(start, kind, values))
        elif kind == "ScalarEvent":
            self._add(event, self._scalar(event))
        elif kind == "AliasEvent":
            if event.anchor not in self.anchors:
                raise self._error(event, f"there is no anchor {quoted(event.anchor)} before here")
            self._add(None, self.anchors[event.anchor])

    def document(self) -> DocumentNode:
        """The only one there is."""
        if len(self.done) != 1:
            what = "is empty" if not self.done else f"has {len(self.done)} documents"
            raise syntax_error(self.source, 1, 1, f"the file {what}", HINT)
        return self.done[0]

    def _add(self, event: Any, value: DocumentNode) -> None:
        if event is not None and event.anchor:
            self.anchors[event.anchor] = value
        (self.open[-1][1] if self.open else self.done).append(value)

    def _collected(self, start: Any, kind: str, values: list[DocumentNode]) -> DocumentNode:
        if kind == "SequenceEndEvent":
            return DocumentNode("list", tuple(values), self._at(start))
        pairs = tuple(zip(values[::2], values[1::2], strict=True))
        return DocumentNode("object", pairs, self._at(start))

    def _scalar(self, event: Any) -> DocumentNode:
        self._tag(event)
        at, text = self._at(event), event.value
        if not event.implicit[0]:
            return DocumentNode("text", text, at)
        if text in _WORDS:
            content = _WORDS[text]
            return DocumentNode("null" if content is None else "boolean", content, at)
        return (
            DocumentNode("number", float(text), at)
            if is_number(text)
            else DocumentNode("text", text, at)
        )

    def _tag(self, event: Any) -> None:
        if event.tag not in (None, "!", "tag:yaml.org,2002:str"):
            raise self._error(event, f"the tag {quoted(event.tag)} means nothing here")

    def _at(self, event: Any) -> Position:
        line, column = event.start_mark.line, event.start_mark.column
        line = min(line, len(self.source.lines) - 1)
        return Position(self.source.file, line + 1, column + 1, self.source.lines[line])

    def _error(self, event: Any, message: str) -> InputError:
        at = self._at(event)
        return syntax_error(self.source, at.line, at.column, message, HINT)
