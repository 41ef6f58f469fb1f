"""XML elements that are written: every number in full precision, attributes in a fixed order."""

from __future__ import annotations

from collections.abc import Iterable
from copy import deepcopy
from xml.etree.ElementTree import Element, SubElement

__all__ = ["add", "exact", "number", "numbers", "prefixed"]

Number = float | int


def number(value: Number) -> str:
    """The shortest text that reads back as the same number; lengths to a nanometre."""
    whole = int(value)
    if whole != value:
        rounded = round(float(value), 9)
        whole = int(rounded)
        if whole != rounded:
            return repr(rounded)
    return str(whole)


def numbers(values: Iterable[Number]) -> str:
    """Numbers separated by spaces."""
    return " ".join([number(v) for v in values])


def exact(values: Iterable[Number]) -> str:
    """Numbers to nine significant digits, for masses and inertias that may be tiny."""
    return " ".join(f"{float(v):.9g}" for v in values)


def add(parent: Element, tag: str, **attributes: object) -> Element:
    """A child element. Tuples are written as numbers; None is left out; a trailing `_` is
    dropped."""
    child = SubElement(parent, tag)
    fill(child, **attributes)
    return child


def fill(element: Element, **attributes: object) -> None:
    """Give an element attributes, written as those of a child are."""
    for name, value in attributes.items():
        if value is not None:
            text = value if isinstance(value, str) else _text(value)
            element.set(name.rstrip("_"), text)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return number(value)
    return numbers(value)  # type: ignore[arg-type]


def prefixed(element: Element, prefix: str, names: bool = False) -> Element:
    """A copy in which references to classes and assets are prefixed, and names too if wanted."""
    copy = deepcopy(element)
    for node in copy.iter():
        for key in ("class", "childclass", "material", "mesh", "texture"):
            if key in node.attrib:
                node.set(key, f"{prefix}/{node.get(key)}")
        if names and "name" in node.attrib:
            node.set("name", f"{prefix}/{node.get('name')}")
    return copy
