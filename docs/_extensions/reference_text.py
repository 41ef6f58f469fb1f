"""Markdown from the texts of the code: docstrings, explanations, help."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import groupby


def heading(level: int, text: str) -> str:
    """A heading."""
    return f"{'#' * level} {text}"


def prose(text: str) -> str:
    """A text that means what it says: what Markdown would take for marks is escaped, except in
    code."""
    pieces = re.split(r"(`[^`]+`)", " ".join(text.split()))
    return "".join(
        piece if piece.startswith("`") else re.sub(r"([<>*_\[\]|\\])", r"\\\1", piece)
        for piece in pieces
    )


def code(text: str, language: str = "text") -> str:
    """A block of code, with a fence longer than any in it."""
    return f"````{language}\n{text.rstrip()}\n````"


def definition(text: str) -> str:
    """Paragraphs and what is indented between them, which is code; lines that start with `*` are a
    list."""
    blocks = []
    for block in re.split(r"\n\n(?=\S)", text):
        for indented, lines in groupby(block.splitlines(), is_code):
            kept = list(lines)
            blocks += [code("\n".join(line[4:] for line in kept))] if indented else items(kept)
    return "\n\n".join(blocks)


def is_code(line: str) -> bool:
    """Whether a line is part of an indented block; one that goes on with an item is less so."""
    return not line or line.startswith("    ")


def items(lines: Sequence[str]) -> list[str]:
    """A paragraph, or the items of a list."""
    found = re.split(r"\n(?=\* )", "\n".join(lines))
    return [f"* {prose(i[2:])}" if i.startswith("* ") else prose(i) for i in found if i.strip()]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; `|` in a cell is escaped."""
    lines = [head, ["---"] * len(head), *([cell(c) for c in row] for row in rows)]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def cell(text: str) -> str:
    return re.sub(r"(?<!\\)\|", r"\\|", text).replace("\n", " ")
