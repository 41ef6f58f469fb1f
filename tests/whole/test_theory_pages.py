"""The theory pages: their figures are what `make figures` draws, can be read, and have words for
those who do not see them; nets, numbers and links are what the pages say; exercises are solved.

`test_docs.py` runs the commands of exercises and lecture.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from factory.floor.modes.modes import operation_modes
from factory.support.settings import Settings
from factory.theory.nets.exclusion import excluding
from tests.net_values import net_from
from tests.paths import ROOT
from tools.figures.all import FIGURES, compiled, layout
from tools.figures.nets import ORDER
from tools.figures.rings import TEETH, WAITS
from tools.figures.sheet import WIDTH

THEORY = ROOT / "docs" / "theory"
FOLDER = THEORY / "figures"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_what_is_drawn_anew(name: str) -> None:
    assert (FOLDER / f"{name}.svg").read_bytes() == FIGURES[name]().encode()


def test_every_figure_is_shown_and_every_picture_is_a_figure() -> None:
    """With words for those who do not see it, whose figures are on it."""
    pages = [path.read_text("utf-8") for path in sorted(THEORY.glob("*.md"))]
    shown = [pair for page in pages for pair in re.findall(r"!\[([^]]*)\]\(figures/(\S+)\)", page)]
    assert {name for _, name in shown} == {path.name for path in FOLDER.iterdir()}
    assert {path.stem for path in FOLDER.iterdir()} == {*FIGURES}
    assert min(len(words) for words, _ in shown) >= 25
    for words, name in shown:
        text = (FOLDER / name).read_text("utf-8")
        assert all(number in text for number in re.findall(r"\d+\.\d+", words)), words


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_can_be_read(name: str) -> None:
    """It is as wide as a column, loads nothing, and no letter is smaller than 9 pixels, but for
    indices; so letters of a drawing inside it that is shown smaller."""
    text = (FOLDER / f"{name}.svg").read_text("utf-8")
    assert not re.search(r"href|url\(|@import", text)
    root = ET.fromstring(text)
    assert float(root.get("width", "0")) <= WIDTH
    assert min(_sizes(root, 1.0)) >= 9.0


def test_the_two_teeth_are_dead_by_the_circuit_in_red() -> None:
    teeth = [(before, after, 0) for before, _, after in TEETH]
    waits = [(before, after, tokens) for before, after, *_, tokens in WAITS]
    net = net_from(teeth + waits)
    red = {place for place, tokens in enumerate(net.tokens) if not tokens}
    assert {*net.stuck_circuit(net.token_free.stuck)} == red


def test_the_order_places_exclude_by_one_token() -> None:
    gears = [("a", "b", 0), ("b", "a", 1), ("c", "d", 0), ("d", "c", 1)]
    net = net_from([*gears, *ORDER])
    assert not net.token_free.stuck
    (circuit,) = excluding(net, [(0, 2)])
    assert circuit is not None and {*circuit} == {0, 2, 4, 5}
    assert excluding(net_from(gears), [(0, 2)]) == [None]


def test_the_redistribution_function_on_the_page_is_that_of_the_net() -> None:
    page = (THEORY / "threaded.md").read_text("utf-8")
    rows = re.findall(r"^\| \((\S+), (\d)\) \| ↦ \| \((\S+), (\d)\) \| r(\S) \|$", page, re.M)
    digits = str.maketrans("₀₁₂₃₄₅₆₇₈₉", "0123456789")
    said = {tuple(cell.translate(digits) for cell in row) for row in rows}
    factory = compiled()
    net, slots = factory.net.threaded, factory.net.slots
    names = [place.name for place in net.places]
    start = factory.by_label["sub1"].start
    assert said == {
        (names[p], str(i + 1), names[q], str(j + 1), str(slots[q][j] + 1))
        for (p, i), (q, j) in net.redistribution[start]
    }


def test_the_calls_of_compile_on_the_page_are_those_of_the_factory() -> None:
    page = (THEORY / "compile.md").read_text("utf-8")
    rows = re.findall(r"^\| CompileNode\((\w+), r(.)\) \| (\w+)\(([^)]+)\) \|", page, re.M)
    subscripts = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
    assert {(label, carrier, mode, robots) for label, carrier, mode, robots in rows} == {
        (
            operation.label,
            str(operation.carrier + 1).translate(subscripts),
            operation.template.name,
            ", ".join(f"r{robot + 1}".translate(subscripts) for robot in operation.robots),
        )
        for operation in compiled().making
    }


def test_the_goals_on_the_page_are_those_of_the_mode() -> None:
    operation = compiled().by_label["sub1"]
    mode = operation_modes(layout(), Settings().eps)[operation.index]
    first, second, third = (round(1e3 * goal) for goal in mode.goals)
    words = f"{first}, {second} and {third} mm", f"{1e3 * mode.eps:g} mm"
    page = " ".join((THEORY / "modes.md").read_text("utf-8").split())
    assert all(said in page for said in words)


def test_there_are_ten_exercises_with_solutions_that_run() -> None:
    page = (THEORY / "exercises.md").read_text("utf-8")
    titles = re.findall(r"^## (\d+)\. ", page, re.M)
    assert [int(number) for number in titles] == list(range(1, 11))
    for section in re.split(r"^## ", page, flags=re.M)[1:]:
        _, solution = section.split("<details><summary>Solution</summary>")
        assert re.search(r"^```console\n\$ factory ", solution, re.M)
        assert solution.rstrip().endswith("</details>")


def test_the_lecture_lasts_90_minutes() -> None:
    page = (THEORY / "lecture.md").read_text("utf-8")
    plan = [tuple(map(int, row)) for row in re.findall(r"^\| (\d+) – (\d+) \|", page, re.M)]
    assert plan == [tuple(map(int, h)) for h in re.findall(r"^## (\d+) – (\d+): ", page, re.M)]
    assert [begin for begin, _ in plan] == [0, *(end for _, end in plan[:-1])]
    assert plan[-1][1] == 90


@pytest.mark.parametrize("page", sorted(THEORY.glob("*.md")), ids=lambda path: path.stem)
def test_links_work_where_the_repository_is_read(page: Path) -> None:
    """None leads to a page that is made with the site, or to a folder."""
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.M | re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        path = target.partition("#")[0]
        assert not path or (page.parent / path).is_file(), target


def _sizes(element: ET.Element, scale: float) -> list[float]:
    """Sizes of the lettering on the page."""
    sizes = []
    for child in element:
        inner = scale
        if child.tag == f"{SVG}svg":
            wide = float(child.get("viewBox", "").split()[2])
            inner = scale * float(child.get("width", "0")) / wide
        if child.tag == f"{SVG}text":
            sizes.append(scale * float(child.get("font-size", "0")))
        sizes += _sizes(child, inner)
    return sizes


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
