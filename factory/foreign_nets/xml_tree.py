"""XML as a tree of elements that know their line and column; without entities or doctypes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from factory.support.errors import Diagnostic, InputError, Position


@dataclass(slots=True)
class Element:
    """An element: its name without the namespace, attributes, text before its first child, and
    where its start tag stands (line and column from 1)."""

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    text: str = ""
    children: list[Element] = field(default_factory=list)

    def all(self, name: str) -> Iterator[Element]:
        """The children of that name."""
        return (child for child in self.children if child.name == name)

    def first(self, name: str) -> Element | None:
        """The first child of that name."""
        return next(self.all(name), None)


class _Builder:
    """Makes the tree from expat's events; a stack in place of recursion."""

    def __init__(self, file: str, lines: list[str], ignored: frozenset[str]) -> None:
        self.file, self.lines, self.ignored = file, lines, ignored
        self.depth = 0  # within elements that are ignored
        self.root: Element | None = None
        self.stack: list[Element] = []
        self.parser = expat.ParserCreate("utf-8", namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.data
        self.parser.StartDoctypeDeclHandler = self.doctype

    def start(self, name: str, attributes: dict[str, str]) -> None:
        local = name.rpartition(" ")[2]
        if self.depth or (self.stack and local in self.ignored):
            self.depth += 1
            return
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        element = Element(local, attributes, line, column)
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)

    def end(self, name: str) -> None:
        if self.depth:
            self.depth -= 1
        else:
            self.stack.pop()

    def data(self, text: str) -> None:
        if not self.depth and not self.stack[-1].children:
            self.stack[-1].text += text

    def doctype(self, *_: object) -> None:
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        hint = "leave the <!DOCTYPE ...> out: nothing in a net needs entities"
        self.refuse("a document type declaration is not accepted", line, column, hint)

    def refuse(self, message: str, line: int, column: int, hint: str) -> None:
        at = position(self.file, self.lines, line, column)
        raise InputError(Diagnostic("Syntax", message, at, hint))


def position(file: str, lines: list[str], line: int, column: int) -> Position:
    """A position with the text of its line, where the file has that line."""
    shown = lines[line - 1] if 0 < line <= len(lines) else ""
    return Position(file, line, column, shown.rstrip("\r"))


def read_xml(
    text: str, file: str, lines: list[str], ignored: frozenset[str] = frozenset()
) -> Element:
    """The root element of an XML document, without the elements that are `ignored`.

    Raises InputError (Syntax) where it is not well-formed or declares a document type.
    """
    builder = _Builder(file, lines, ignored)
    try:
        builder.parser.Parse(text.encode("utf-8", "surrogatepass"), True)
    except expat.ExpatError as error:
        hint = "every element that is opened must be closed, and & and < in text escaped"
        message = f"not well-formed XML: {expat.ErrorString(error.code)}"
        builder.refuse(message, error.lineno, error.offset + 1, hint)
    del builder.parser  # it holds the builder, so both would wait for the cycle collector
    assert builder.root is not None
    return builder.root
