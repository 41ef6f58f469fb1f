"""Plans are what an engineer would do: products with a known order, from STL files."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.titles import Titles
from factory.apps.planning.writing import Screwed, Tree, leaves
from factory.pipeline import all_templates
from tests.engineered_products import MADE, Engineered, box, rod, write_stl

TEMPLATES = all_templates()


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ways are the same without CoACD, which takes most of the time."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


def joins(tree: Tree) -> Iterator[tuple[list[str], list[str]]]:
    """The operations of a tree: the pile, and what comes."""
    below = (tree.tree, *tree.screws) if isinstance(tree, Screwed) else tree
    if isinstance(below, str):
        return
    pile = list[str]()
    for one in below:
        yield from joins(one)
        if pile:
            yield pile, list(leaves(one))
        pile = [*pile, *leaves(one)]


def faults(made: Engineered, found: Planned) -> list[str]:
    """What an engineer would do otherwise."""
    base = leaves(found.tree)[0]
    wrong = [] if base in made.base else [f"{base} is the base"]
    for first, then in made.pairs():
        for pile, come in joins(found.tree):
            if then in pile and first in come:
                wrong.append(f"{then} is there before {first}")
    return wrong


def planned(made: Engineered, folder: Path, options: PlanOptions) -> Planned:
    source = read_source(write_stl(made.parts, folder), TEMPLATES, SourceOptions("mm"))
    return plan_of(source, options)


def plan_of(source: InPlace, options: PlanOptions) -> Planned:
    found = plan(source, options)
    assert isinstance(found, Planned)
    return found


@pytest.mark.slow
def test_orders_are_those_of_an_engineer_with_a_layout(tmp_path: Path) -> None:
    """Of at least six of eight products."""
    wrong = {}
    for make in MADE:
        made = make()
        found = planned(made, tmp_path / make.__name__, PlanOptions())
        if bad := faults(made, found):
            wrong[make.__name__] = bad
    assert len(MADE) == 8 and len(wrong) <= 2, wrong


def test_names_say_what_is_in_and_what_on_another(tmp_path: Path) -> None:
    """The key is named before the shaft, whichever comes; what is under a flange is not in it."""
    shaft = rod(20, 60, 70) + rod(8, 0, 80)
    parts = {
        "tub": box(60, 60, 40) - box(54, 54, 50, (0, 0, 3)),
        "cell": box(20, 20, 20, (0, 0, 3)),
        "spool": shaft,
        "ring": rod(3, 50, 60, (13, 0)),
    }
    source = read_source(write_stl(parts, tmp_path), TEMPLATES, SourceOptions("mm"))
    titles = Titles(source, set())
    assert titles.joined(("tub",), ("cell",)) == "cell_in_tub"
    assert titles.joined(("ring",), ("spool",)) == "ring_on_spool"
    assert titles.joined(("tub", "cell"), ("ring", "spool")) == "spool_on_tub"
