"""Mixes: several products on one floor, a period of units with trees of their own (Theorem 9)."""

from __future__ import annotations

import json
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from factory.apps.exports.certificate.check import check_certificate
from factory.apps.exports.certificate.writer import certificate
from factory.floor.geometry.product import product_geometry
from factory.pipeline import Project, read
from factory.support.errors import InputError
from factory.theory.compiler.mixing import even, orders
from factory.theory.lang.pag_reader import read_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.lang.writer import write_pag
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.verify import verify
from factory.theory.problem.pag import PAG, Mix
from factory.theory.problem.plan import Plan
from tests.command_line import Terminal
from tests.fold_values import pairs_of_tours, swapped
from tests.mix_values import LITTLE, Tree, family_of, mixed_factory, random_family
from tests.pag_values import TEMPLATES
from tests.state_space import explored


def little(mix: str = "mix = 2 a, 1 b") -> PAG:
    return read_pag(LITTLE.replace("mix = 2 a, 1 b", mix), TEMPLATES, "little.pag")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The little family in a file."""
    path = tmp_path / "little.pag"
    path.write_text(LITTLE)
    return path


def test_a_mix_counts_its_products_or_orders_them() -> None:
    assert little().mix == Mix((("a", 2), ("b", 1)))
    assert little("mix = b, a, a").mix == Mix((("b", 1), ("a", 2)), ("b", "a", "a"))
    for pag in (little(), little("mix = b, a, a")):
        assert read_pag(write_pag(pag), TEMPLATES, "little.pag") == pag


def test_one_product_is_no_mix() -> None:
    text = "; a = mate ( x, y ); x = atomic(); y = atomic()"
    assert read_pag("mix = 3 a" + text, TEMPLATES) == read_pag("root = a" + text, TEMPLATES)


@pytest.mark.parametrize(
    ("mix", "message"),
    [
        ("mix = 2 a, b", "'b' is not counted, and others are"),
        ("mix = 2 a, 1 b, 1 a", "'a' is counted twice"),
        ("mix = 61 a, 1 b", "'61' is no number of units from 1 to 60"),
        ("mix = 40 a, 40 b", "a period of 80 units; 60 are the most"),
        ("mix = 1 a, 1 b; root = b", "there are a root and a mix, at column 1"),
        ("mix = 1 a, 1 b; mix = a, b", "the mix is given twice, first at column 1"),
        ("mix = a, b, base", "the product 'base' is part of the product 'a'"),
    ],
)
def test_wrong_mixes_are_refused_in_words(mix: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        little(mix)
    found = [(d.code, d.message) for d in caught.value.diagnostics]
    assert ("BadMix", message) in found
    assert {code for code, _ in found} == {"BadMix"}


def test_a_product_uses_a_label_once() -> None:
    with pytest.raises(InputError) as caught:
        read_pag(
            "mix = t, v; t = mate(x, y, x); v = mate(x, y); x = atomic(); y = atomic()", TEMPLATES
        )
    (fault,) = caught.value.diagnostics
    assert fault.code == "PagNotTree"
    assert fault.message == "'x' is used twice in 't', first at column 22"


def test_a_word_that_is_no_mix_is_one_error() -> None:
    """What follows from a mix that cannot be read is not reported."""
    for mix in ("mix = ", "mix = 3 4 a", "mix = mate ( a, b )"):
        with pytest.raises(InputError) as caught:
            little(mix)
        assert [d.code for d in caught.value.diagnostics] == ["Syntax"]


@cache
def family(seed: int) -> PAG | None:
    return random_family(seed)


def test_random_families_are_certified_and_explored() -> None:
    """Theorem 9: live, safe and reversible, by the proof, by the other program, and by looking at
    every marking; any other order of a line's tours is dead. The output robot's own order may be
    another where no other robot serves both products."""
    made = 0
    for seed in range(16):
        pag = family(seed)
        if pag is None:
            continue
        made += 1
        factory = mixed_factory(pag)
        verdict = verify(factory.net)
        assert verdict.holds and verdict.gear_train
        assert pag.mix is not None and factory.sequence == pag.mix.sequence
        assert check_certificate(json.loads(json.dumps(certificate(factory.net, verdict)))) == []
        if len(factory.operations) < 18:
            truth = explored(MarkedNet.of(factory.net), 6_000)
            assert truth is None or truth.behaviour == (True, True, True)
        for robot, one, other in pairs_of_tours(factory):
            found = verify(swapped(factory, robot, one, other))
            assert not (found.live and robot), "another order of a line's tours is live"
            assert found.live or found.faults
    assert made >= 8


P = [Tree(f"p{n}") for n in range(7)]
S, T, U = (Tree(label, "mate", (P[n], P[n + 1])) for label, n in (("s", 0), ("t", 3), ("u", 5)))
"""Parts and sub-assemblies."""


@pytest.mark.parametrize(
    ("trees", "message"),
    [
        (
            (Tree("a", "mate", (S, P[2])), Tree("b", "mate", (P[3], P[4]))),
            "'b' and 'a' have to begin on one robot, and their inputs cannot come on the same two"
            " lines: part p3 slides and part p4 slides; sub-assembly s slides and part p2 slides",
        ),
        (
            (Tree("a", "mate", (S, P[2])), Tree("b", "mate", (Tree("v", "mate", (T, P[5])), P[2]))),
            "'v' and 's' have to begin on one robot, and their inputs cannot come on the same two"
            " lines: sub-assembly t slides and part p5 slides; part p0 slides and part p1 slides",
        ),
    ],
)
def test_products_that_begin_otherwise_are_refused(trees: tuple[Tree, Tree], message: str) -> None:
    """What is named is what begins otherwise, be it a sub-assembly further down."""
    with pytest.raises(InputError) as caught:
        mixed_factory(family_of(trees, ("a", "b")))
    assert [(d.code, d.message) for d in caught.value.diagnostics] == [("BadLine", message)]


def test_a_plan_makes_a_product_wholly_or_not_at_all() -> None:
    project = Project(little(), all_templates())
    turns = [list(turn) for turn in project.planned.plan.turns]
    assert project.with_plan(Plan(turns=tuple(map(tuple, turns)))).planned == project.planned
    unit = next(turn for turn in turns if Plan.NOBODY in turn)
    unit[next(n for n, robot in enumerate(unit) if robot != Plan.NOBODY)] = Plan.NOBODY
    with pytest.raises(InputError, match="nobody does some of the tours"):
        _ = project.with_plan(Plan(turns=tuple(map(tuple, turns)))).planned
    with pytest.raises(InputError, match="a turn makes no product"):
        _ = project.with_plan(Plan(turns=((Plan.NOBODY,) * len(unit),))).planned


def test_default_boxes_are_side_by_side_in_each_product() -> None:
    """Boxes of two products may be in one place, those of one never are."""
    pag = little()
    solids = product_geometry(pag).solids
    for parts in pag.insides:
        assert len({tuple(solids[part].position) for part in parts}) == len(parts)
    assert tuple(solids["x"].position) == tuple(solids["z"].position)


SHAPED = """mix = a, b;
a = mate ( base, x ); b = mate ( base, z );
base = atomic ( box = ( 0.2, 0.1, 0.02 ), pos = ( 0, 0, 0.01 ) );
x = atomic ( box = ( 0.22, 0.08, 0.05 ), pos = ( 0, 0, 0.045 ) );
z = atomic ( box = ( 0.16, 0.12, 0.03 ), pos = ( 0.02, 0, 0.035 ) );"""
"""Two products of which the first is longer and taller, and the second wider."""


@pytest.fixture
def shaped(tmp_path: Path) -> Path:
    path = tmp_path / "shaped.pag"
    path.write_text(SHAPED)
    return path


def test_the_outfeed_takes_all_products_in_one_place(shaped: Path, run: Terminal) -> None:
    """The output robot holds all products by one place, the outfeed is for the box of all, and what
    overlaps are parts of one product only: x and z do, were they in one."""
    project = read(shaped)
    layout = project.layout
    assert {layout.visits[o.index, 0].shift for o in layout.factory.dropoffs} == {(0.0, 0.0)}
    a, b = (layout.payloads[product] for product in layout.factory.products)
    assert layout.outgoing == (min(a[0], b[0]), max(a[1], b[1]), min(a[2], b[2]), max(a[3], b[3]))
    assert layout.outgoing not in (a, b)
    assert not project.overlaps.pairs
    found = run("run", shaped, "--units", 4, "--json").json
    assert found["units_by_product"] == {"a": 2, "b": 2}
    assert (found["unintended_contacts"], found["verdict"]["succeeded"]) == (0, True)


def test_an_analysis_says_how_long_each_product_takes(shaped: Path, run: Terminal) -> None:
    """By their counts these times are the cycle time, and no product takes nothing."""
    found = run("analyze", shaped, "--json").json
    assert {*found["by_product_s"]} == {"a", "b"}
    assert min(found["by_product_s"].values()) > 0.1
    assert sum(found["by_product_s"].values()) / 2 == pytest.approx(found["cycle_time_s"])
    assert " s for a a and " in run("analyze", shaped).out
    assert run("analyze", "examples/paper.pag", "--json").json["by_product_s"] == {}


LAMPS = """unit = mm; mix = 2 shaded, 1 bare;
shaded = mate ( base, shade ); bare = mate ( base, globe );
base = atomic ( box = (40, 40, 20), pos = (0, 0, 10) );
shade = atomic ( box = (30, 30, 30), pos = (0, 0, 35) );
globe = atomic ( sphere = 20, pos = (0, 0, 40) )"""


def test_products_end_at_one_height(shaped: Path, run: Terminal) -> None:
    """A product that is higher by so many millimetres would hang over the tray that takes it
    away."""
    higher = 5.0
    high = f"other = atomic ( box = ( 0.2, 0.1, {0.02 - higher / 1e3:.4f} ),"
    high += f" pos = ( 0, 0, {0.01 + higher / 2e3:.4f} ) );"
    shaped.write_text(SHAPED.replace("mate ( base, z )", "mate ( other, z )") + "\n" + high)
    done = run("run", shaped, "--json")
    assert (done.status, done.codes) == (1, ["Layout"])
    assert f"'b@2' ends {higher:.2f} mm higher than 'a'" in done.json["errors"][0]["message"]


def test_few_robots_make_a_mix(tmp_path: Path, run: Terminal) -> None:
    """Forms and lines are chosen for all products at once; no more robots than the bound of each
    product allows are asked for."""
    file = tmp_path / "family.pag"
    file.write_text(LITTLE.replace("x, y )", "x, y, w )") + "; w = atomic()")
    done = run("run", file, "--robots", "least", "--units", 6, "--jitter", 0.3, "--json")
    assert (done.status, done.json["robots"], done.json["unintended_contacts"]) == (0, 2, 0)
    assert done.json["units_by_product"] == {"a": 4, "b": 2}
    refused = run("check", file, "--robots", 1, "--json")
    assert (refused.status, refused.codes) == (2, ["TooFewRobots"])
    refused = run("run", file, "--relay", "--json")
    assert (refused.status, refused.codes) == (2, ["BadValue"])


def test_a_search_says_what_keeps_robots_of_a_mix_apart(tmp_path: Path, run: Terminal) -> None:
    file = tmp_path / "lamps.pag"
    file.write_text(
        LAMPS.replace("shade )", "shade, y )")
        .replace("globe )", "globe, y )")
        .replace("sphere = 20, pos = (0, 0, 40)", "box = (20, 20, 30), pos = (0, 0, 35)")
        + "; y = atomic ( box = (10, 10, 10), pos = (0, 25, 5) )"
    )
    refused = run("check", file, "--robots", 2, "--json").json["errors"][0]["message"]
    assert "; 'y' and 'base' cannot share a robot: they begin or end in different ways" in refused


def test_the_sequences_of_a_mix_are_its_necklaces() -> None:
    """As many as Burnside counts; of more than eight units the even one alone."""
    for counts, number in (((2, 2), 2), ((3, 3), 4), ((4, 4), 10), ((2, 2, 2), 16), ((5, 4), 1)):
        mix = Mix(tuple((f"p{n}", count) for n, count in enumerate(counts)))
        found = [*orders(mix)]
        assert len(found) == number and found[0] == even(mix)
        assert all(Counter(sequence) == dict(mix.counts) for sequence in found)
