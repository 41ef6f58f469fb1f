"""XML as a tree of elements that know their line and column; without entities or doctypes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from factory.support.errors import Diagnostic, InputError, Position

__all__ = ["Element", "XmlDocument"]

MOST = 8_000_000
"""Greatest number of elements of a document, which take 4 GB."""


@dataclass(slots=True)
class Element:
    """An element: its name without the namespace, attributes, text before its first child, and the
    position of its start tag (line and column from 1)."""

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

    def content(self, name: str, default: str) -> str:
        """The <text> of the first child of that name, stripped."""
        child = self.first(name)
        text = None if child is None else child.first("text")
        return default if text is None else text.text.strip()


@dataclass
class XmlDocument:
    """A file of XML, and the faults found in what it describes, with their `code`."""

    file: str
    lines: list[str]
    code: str
    faults: list[Diagnostic] = field(default_factory=list)

    def position(self, line: int, column: int) -> Position:
        """A position with the text of its line, where the file has that line."""
        shown = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        return Position(self.file, line, column, shown.rstrip("\r"))

    def at(self, element: Element) -> Position:
        """Where an element begins."""
        return self.position(element.line, element.column)

    def fault(self, element: Element, message: str, hint: str) -> None:
        """Note a fault at an element."""
        self.faults.append(Diagnostic(self.code, message, self.at(element), hint))

    def stop(self) -> None:
        """Raise InputError with the faults noted, if any."""
        if self.faults:
            raise InputError(self.faults)

    def read(self, text: str, ignored: frozenset[str] = frozenset()) -> Element:
        """The root element of the text, without the elements that are `ignored`.

        Raises InputError (Syntax) where it is not well-formed or declares a document type.
        """
        builder = _Builder(self, ignored)
        try:
            builder.parser.Parse(text.encode("utf-8", "surrogatepass"), True)
        except expat.ExpatError as error:
            hint = "every element that is opened must be closed, and & and < in text escaped"
            message = f"not well-formed XML: {expat.ErrorString(error.code)}"
            at = self.position(error.lineno, error.offset + 1)
            raise InputError(Diagnostic("Syntax", message, at, hint)) from None
        finally:
            del builder.parser  # it holds the builder, so both would wait for the cycle collector
        return builder.top.children[0]


class _Builder:
    """Makes the tree from expat's events; a stack in place of recursion."""

    def __init__(self, document: XmlDocument, ignored: frozenset[str]) -> None:
        self.document, self.ignored = document, ignored
        self.depth = 0  # within elements that are ignored
        self.top = Element("", {}, 0, 0)
        self.stack = [self.top]
        self.elements = 0
        self.text: list[str] = []  # of the innermost element, so far
        self.parser = expat.ParserCreate("utf-8", namespace_separator=" ")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.data
        self.parser.StartDoctypeDeclHandler = self.doctype

    def start(self, name: str, attributes: dict[str, str]) -> None:
        local = name.rpartition(" ")[2]
        if self.depth or (len(self.stack) > 1 and local in self.ignored):
            self.depth += 1
            return
        self.end_text()
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        element = Element(local, attributes, line, column)
        self.elements += 1
        if self.elements > MOST:
            self.document.fault(element, f"it has more than {MOST} elements", "take it apart")
            self.document.stop()
        self.stack[-1].children.append(element)
        self.stack.append(element)

    def end(self, name: str) -> None:
        if self.depth:
            self.depth -= 1
        else:
            self.end_text()
            self.stack.pop()

    def data(self, text: str) -> None:
        if not self.depth and not self.stack[-1].children:
            self.text.append(text)

    def end_text(self) -> None:
        """Assign the text read so far to the innermost element."""
        if self.text:
            self.stack[-1].text = "".join(self.text)
            self.text.clear()

    def doctype(self, *_: object) -> None:
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        at = self.document.position(line, column)
        hint = "leave the <!DOCTYPE ...> out: nothing here needs entities"
        message = "a document type declaration is not accepted"
        raise InputError(Diagnostic("Syntax", message, at, hint))
