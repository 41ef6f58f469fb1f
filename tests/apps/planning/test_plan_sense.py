"""Plans are what an engineer would do: twenty products with a known order, from STL files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.planning.blocking import blocking
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.titles import Titles
from factory.apps.planning.writing import Screwed, Tree, leaves, planned_product, screws_in
from factory.floor.geometry.overlap import drawn
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.theory.compiler.expanding import expand
from tests.apps.planning.test_plan_audit import LEAST, cuts, ways
from tests.engineered_products import (
    MADE,
    Engineered,
    along_x,
    along_y,
    box,
    drilled,
    numbered,
    rod,
    screw,
    tube,
    write_stl,
)

TEMPLATES = all_templates()

QUICK = PlanOptions(lay_out=False)

ENOUGH = 18
"""Of twenty products so many are planned as an engineer would."""


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
    assert len(MADE) == 20
    wrong = {}
    for make in MADE:
        made = make()
        found = planned(made, tmp_path / make.__name__, PlanOptions())
        if bad := faults(made, found):
            wrong[make.__name__] = bad
    assert len(MADE) - len(wrong) >= ENOUGH, wrong


SEEN = ("upright_flange", "keyed_shaft", "clamp", "hinge", "toy_car", "battery_box")
"""Products that are always planned."""


@pytest.mark.parametrize(
    "make",
    [pytest.param(make, marks=() if make.__name__ in SEEN else pytest.mark.slow) for make in MADE],
    ids=lambda make: make.__name__,
)
def test_the_order_is_that_of_an_engineer_and_nothing_is_cut_on_the_way(
    make: Callable[[], Engineered], tmp_path: Path
) -> None:
    """The greatest volume that what comes has in common with what stands is that of when it is
    there: none."""
    engineered = make()
    source = read_source(write_stl(engineered.parts, tmp_path), TEMPLATES, SourceOptions("mm"))
    found = plan_of(source, QUICK)
    assert faults(engineered, found) == []
    made = planned_product(source, found.tree, found.orientation)
    product = product_geometry(made.pag, made.files)
    judged = matings(expand(made.pag, TEMPLATES), product)
    assert len(judged.all) == len(source.parts) - 1 and not judged.of_kind("blocked")
    bodies = {label: drawn(solid) for label, solid in product.solids.items()}
    for mating in judged.all:
        for way in ways(mating):
            cut, finished = cuts(mating, made.pag, product, bodies, way)
            assert cut <= finished + LEAST and finished <= LEAST, (mating.label, way)


def test_what_falls_is_said_and_counted(tmp_path: Path) -> None:
    """Pins through the holes of a plate fall until a foot is below them, which comes last if they
    do not fit through it; in blind holes they stand."""
    at = [(-20.0, 0.0), (20.0, 0.0)]
    for low, falls in ((0, 1), (3, 0)):
        pins = numbered("pin", lambda place, low=low: rod(3, low, 14, place), at)
        plate = box(60, 40, 10) - rod(3, low, 20, at[0]) - rod(3, low, 20, at[1])
        found = planned(
            Engineered({"plate": plate, **pins}, frozenset(), ()), tmp_path / str(low), QUICK
        )
        assert leaves(found.tree)[0] == "plate"
        assert "plate is the base, onto which all others come (--base)" in found.notes
        assert found.figures.falls == falls
        told = [note for note in found.notes if "hand or glue" in note]
        assert told == ["the sub-assembly needs a hand or glue until more is there"] * falls


def test_screws_come_from_above_if_the_product_can_stand_so(tmp_path: Path) -> None:
    at = [(-20.0, -12.0), (20.0, 12.0)]
    parts = {
        "block": box(60, 40, 30) - rod(2, 10, 40, at[0]) - rod(2, 10, 40, at[1]),
        "plate": box(60, 40, 5, (0, 0, 30)) - rod(2.2, 20, 50, at[0]) - rod(2.2, 20, 50, at[1]),
        **numbered("screw", lambda place: screw(place, 35, 20, 2), at),
    }
    turned = {label: body.rotate((0, 90, 0)) for label, body in parts.items()}
    found = planned(Engineered(turned, frozenset(), ()), tmp_path, QUICK)
    assert "the product stands with +x of the file up" in found.notes[0]
    assert all(join.lowered for join in found.operations)


def test_a_product_is_not_put_onto_a_knob_for_its_screws(tmp_path: Path) -> None:
    """They come from the side if what it would stand on then is small for its height."""
    parts = {
        "block": box(60, 60, 60) - along_x(rod(2, 10, 40)).translate((0, 0, 30)),
        "plate": along_x(tube(25, 2.2, 30, 34)).translate((0, 0, 30)),
        "screw": along_x(screw((0, 0), 34, 20, 2)).translate((0, 0, 30)),
        "knob": along_x(rod(6, -40, -30)).translate((0, 0, 30)),
    }
    found = planned(Engineered(parts, frozenset(), ()), tmp_path, QUICK)
    assert "the product stands as it was drawn, +z up" in found.notes[0]
    assert screws_in(found.tree) == ("screw",)


def test_the_base_is_below_what_is_as_heavy_and_touches_more(tmp_path: Path) -> None:
    parts = {
        "plate": box(120, 60, 20),
        "block": drilled(box(80, 40, 40, (0, 0, 20)), [(-20, 0), (20, 0)], 3),
        **numbered("peg", lambda place: rod(3, 20, 70, place), [(-20, 0), (20, 0)]),
    }
    found = planned(Engineered(parts, frozenset(), ()), tmp_path, QUICK)
    assert leaves(found.tree)[0] == "plate"


def test_what_is_in_a_hole_touches_it_whatever_its_play(tmp_path: Path) -> None:
    """A lid as near to what is below it does not."""
    parts = {
        "tub": box(60, 40, 30) - box(56, 36, 40, (0, 0, 3)) + box(20, 20, 20, (0, 0, 3)),
        "pin": rod(3, 10, 29.8),
        "lid": box(60, 40, 3, (0, 0, 30)),
    }
    parts["tub"] = parts["tub"] - rod(3.2, 9.8, 40)
    source = read_source(write_stl(parts, tmp_path), TEMPLATES, SourceOptions("mm"))
    graphs = blocking(source)
    pin, tub, lid = (graphs.labels.index(label) for label in ("pin", "tub", "lid"))
    assert graphs.touch[pin, tub] and not graphs.touch[pin, lid]


def test_a_screw_across_the_way_of_the_other_parts_is_driven_in(tmp_path: Path) -> None:
    """Its pile is passed on to a robot on the other axis, and back."""
    rail = box(100, 40, 10) + box(100, 20, 10, (0, 0, 10)) + box(100, 32, 8, (0, 0, 20))
    slider = box(30, 60, 26, (0, 0, 11)) - box(40, 32.4, 8.4, (0, 0, 19.8))
    slider = (
        slider - box(40, 20.4, 20, (0, 0, 5)) - along_y(rod(1.5, -40, -16)).translate((0, 0, 24))
    )
    parts = {
        "rail": rail,
        "slider": slider,
        "screw": along_y(rod(1.5, -30, -16.1) + rod(3, -34, -30)).translate((0, 0, 24)),
    }
    found = planned(Engineered(parts, frozenset(), ()), tmp_path, replace(QUICK, up=(2, +1)))
    assert screws_in(found.tree) == ("screw",)
    assert found.figures.relays == 2 and found.figures.blocked == 0
    source = read_source(tmp_path, TEMPLATES, SourceOptions("mm"))
    made = planned_product(source, found.tree, found.orientation)
    judged = matings(expand(made.pag, TEMPLATES), product_geometry(made.pag, made.files))
    assert len(judged.all) == 2 and not judged.of_kind("blocked")


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


def test_a_driver_does_not_reach_a_screw_between_tall_walls(tmp_path: Path) -> None:
    """It comes before them, although the walls leave room for its head; between low ones last."""
    parts = {
        "plate": box(80, 60, 12) - rod(2, 2, 20),
        "tag": box(20, 20, 3, (0, 0, 12)) - rod(2.2, 0, 30),
        "screw": screw((0, 0), 15, 12, 2),
    }
    for tall, before in ((30, False), (120, True)):
        well = (
            box(40, 40, tall, (0, 0, 15))
            - box(9, 9, 2 * tall, (0, 0, 0))
            - box(21, 21, 4, (0, 0, 12))
        )
        all_ = {**parts, "well": well + box(60, 50, 3, (0, 0, 12)) - box(22, 22, 10, (0, 0, 8))}
        made = Engineered(
            all_, frozenset({"plate"}), (("screw", "well"),) if before else (("well", "screw"),)
        )
        found = planned(made, tmp_path / str(tall), QUICK)
        assert not faults(made, found), tall
