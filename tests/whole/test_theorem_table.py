"""One numbering for all theorems: each is stated once, on the page that the table names; the code
and the test that it names are there; and nothing else is cited."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.paths import ROOT

THEORY = ROOT / "docs" / "theory"

ROW = re.compile(r"\| ([^|]+) \| ([^|]+) \| \[[^]]+\]\((\w+\.md)\) \| `([^`]+)` \| `([^`]+)` \|")

OTHERS = re.compile(r"(Murata|1989|Commoner|et al\.)[^.]{0,40}?Theorems? [\d.]+", re.DOTALL)
"""Theorems of others, by their numbers."""

CITED = re.compile(
    r"(?<!\w)(Theorem|Lemma)s?\s+((?:\d+(?:\.\d+)?|[A-Z]\b)(?:(?:, | and )\d+(?:\.\d+)?)*)"
)


def table() -> dict[str, tuple[str, Path, Path]]:
    """The page, code and test of each theorem, by its name."""
    rows = ROW.findall((THEORY / "theorems.md").read_text("utf-8"))
    return {
        name if name.startswith("Lemma") else f"Theorem {name}": (page, ROOT / code, ROOT / test)
        for name, _, page, code, test in rows
    }


def stated(page: str) -> list[str]:
    """The theorems that a page states."""
    text = (THEORY / page).read_text("utf-8")
    return [
        f"{kind} {name}" for kind, name in re.findall(r"\*\*(Theorem|Lemma) (\d[\d.]*\d|\d)", text)
    ]


def cited(text: str) -> set[str]:
    """The theorems of this numbering that a text cites."""
    own = OTHERS.sub("", text)
    return {
        f"{kind} {number}"
        for kind, numbers in CITED.findall(own)
        for number in re.split(r", | and ", numbers)
    }


@pytest.mark.parametrize("name", table())
def test_each_theorem_is_stated_once_with_its_code_and_its_test(name: str) -> None:
    page, code, test = table()[name]
    pages = [path.name for path in THEORY.glob("*.md") if name in stated(path.name)]
    assert pages == [page]
    assert code.is_file() and test.is_file()


def test_nothing_else_is_cited() -> None:
    known = table().keys()
    folders = (ROOT / name for name in ("docs", "factory", "tests"))
    files = [path for folder in folders for path in folder.rglob("*")]
    files = [path for path in files if path.suffix in (".py", ".md")]
    wrong = {str(path): cited(path.read_text("utf-8")) - known for path in files}
    assert {path: names for path, names in wrong.items() if names} == {}


def test_a_citation_that_is_nowhere_stated_is_found() -> None:
    word = "Theorem"
    text = f"By {word} 99 and {word}s 3 and 98; {word} B, too (Murata 1989, Theorem 21)."
    assert cited(text) - table().keys() == {f"{word} {name}" for name in ("99", "98", "B")}
