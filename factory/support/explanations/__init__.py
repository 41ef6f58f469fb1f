"""Explanations of the codes of diagnostics: a text each, in this folder or, where one app alone
says the code, in the folder `explanations` of that app. An entry point of the group
`factory.explanations` names a package with more of them.

A text is a title, the meaning, an example that causes it (files, and the command), and a remedy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from factory.support.apps import FOLDER as APPS
from factory.support.errors import did_you_mean, usage_error
from factory.support.extensions import extension_folders

FOLDER = Path(__file__).resolve().parent


@dataclass(frozen=True, slots=True)
class CodeExplanation:
    """A code, its meaning in a line, and the whole text."""

    code: str
    title: str
    text: str


@cache
def codes() -> tuple[str, ...]:
    """All codes of this package in alphabetical order."""
    return tuple(sorted(_shipped()))


def explain(code: str) -> CodeExplanation:
    """The explanation of a code, in upper or lower case. Those of other packages are looked for
    where this one has none. Raises InputError (Usage) with similar codes for an unknown one."""
    texts, asked = _shipped(), code.strip().lower()
    if asked not in map(str.lower, texts):
        texts = {**_texts(extension_folders("explanations")), **texts}
    name = {name.lower(): name for name in texts}.get(asked)
    if name is None:
        raise usage_error(f"there is no code '{code}'", _near(code, sorted(texts)))
    title, _, text = texts[name].read_text("utf-8").partition("\n\n")
    return CodeExplanation(name, title, text.rstrip("\n"))


@cache
def _shipped() -> Mapping[str, Path]:
    """The texts of this package, by code."""
    return MappingProxyType(_texts((FOLDER, *APPS.glob("*/explanations"))))


def _texts(folders: Iterable[Path]) -> dict[str, Path]:
    """The texts in some folders, by code."""
    return {path.stem: path for folder in folders for path in folder.glob("*.txt")}


def _near(code: str, names: Sequence[str]) -> str:
    """The codes that contain the word, or the most similar one."""
    inside = [name for name in names if len(code) > 2 and code.lower() in name.lower()]
    if inside:
        return "there are " + ", ".join(inside) if len(inside) > 1 else f"there is {inside[0]}"
    return did_you_mean(code, names, "codes")
