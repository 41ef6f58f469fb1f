"""The figures of the theory pages: they are what `make figures` draws, each is shown with words for
those who do not see it, can be read, and its nets are what the pages say of them."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest

from factory.theory.nets.exclusion import excluding
from factory.theory.nets.marked import stuck_circuit, token_free
from tests.net_values import net_from
from tests.paths import ROOT
from tools.figures.all import FIGURES
from tools.figures.nets import ORDER
from tools.figures.rings import TEETH, WAITS
from tools.figures.sheet import WIDTH

THEORY = ROOT / "docs" / "theory"
FOLDER = THEORY / "figures"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_what_is_drawn_anew(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert (FOLDER / f"{name}.svg").read_bytes() == FIGURES[name]().encode()


def test_every_figure_is_shown_and_every_picture_is_a_figure() -> None:
    """With words for those who do not see it."""
    pages = [path.read_text("utf-8") for path in sorted(THEORY.glob("*.md"))]
    shown = [pair for page in pages for pair in re.findall(r"!\[([^]]*)\]\(figures/(\S+)\)", page)]
    assert {name for _, name in shown} == {path.name for path in FOLDER.iterdir()}
    assert {path.stem for path in FOLDER.iterdir()} == {*FIGURES}
    assert min(len(words) for words, _ in shown) > 30


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
    assert {*stuck_circuit(net, token_free(net).stuck)} == red


def test_the_order_places_exclude_by_one_token() -> None:
    gears = [("a", "b", 0), ("b", "a", 1), ("c", "d", 0), ("d", "c", 1)]
    net = net_from([*gears, *ORDER])
    assert not token_free(net).stuck
    (circuit,) = excluding(net, [(0, 2)])
    assert circuit is not None and {*circuit} == {0, 2, 4, 5}
    assert excluding(net_from(gears), [(0, 2)]) == [None]


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
