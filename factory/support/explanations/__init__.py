"""Explanations of the codes of diagnostics: a text each, in this folder.

A text is a title, the meaning, an example that causes it (files, and the command), and a remedy.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from factory.support.errors import did_you_mean, usage_error

FOLDER = Path(__file__).resolve().parent


@dataclass(frozen=True, slots=True)
class CodeExplanation:
    """A code, its meaning in a line, and the whole text."""

    code: str
    title: str
    text: str


@cache
def codes() -> tuple[str, ...]:
    """All codes in alphabetical order."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.txt")))


def explain(code: str) -> CodeExplanation:
    """The explanation of a code, in upper or lower case. Raises InputError (Usage) with similar
    codes for an unknown one."""
    names = {name.lower(): name for name in codes()}
    name = names.get(code.strip().lower())
    if name is None:
        raise usage_error(f"there is no code '{code}'", _near(code))
    title, _, text = (FOLDER / f"{name}.txt").read_text("utf-8").partition("\n\n")
    return CodeExplanation(name, title, text.rstrip("\n"))


def _near(code: str) -> str:
    """The codes that contain the word, or the most similar one."""
    inside = [name for name in codes() if len(code) > 2 and code.lower() in name.lower()]
    if inside:
        return "there are " + ", ".join(inside) if len(inside) > 1 else f"there is {inside[0]}"
    return did_you_mean(code, codes(), "codes")
