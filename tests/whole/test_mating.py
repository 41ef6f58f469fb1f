"""How inputs come together: slide, lower or blocked, at three levels, against brute force and the
engine."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import product as every
from pathlib import Path

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from factory.apps.exports.clash_picture import draw
from factory.apps.exports.product_view import picture_names
from factory.commands.warnings import LISTED, condensed
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.floor.mating import bodies, paths
from factory.floor.mating.depth import Difference, exact, polytope, rough, summits
from factory.floor.mating.findings import BLOCKED, LEFT_OUT, NO_DEEPER, STRICT, Mating, Matings
from factory.floor.mating.mating import judged as without_lifts
from factory.floor.mating.mating import matings
from factory.floor.mating.meetings import meetings
from factory.floor.mating.overlaps import CHUNK
from factory.floor.mating.paths import CLEAR, LAST, NEAR, TOLERANCE, depths_of, sought
from factory.pipeline import all_templates
from factory.support.errors import Diagnostic
from factory.theory.compiler.expanding import expand
from factory.theory.lang import read_pag
from factory.theory.problem.pag import PAG, AllowedOverlap
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.pag_values import factory_of
from tests.strategies import pags, random_pag_text
from tests.work import counted

TEMPLATES = all_templates()
MM = 1e-3
ALONG_Y = "root = r; r = mate ( a, b ); "
ALONG_X = (
    "root = r; r = mate ( s, far ); s = mate ( a, b ); far = atomic ( box = (0.01, 0.01, 0.01),"
)
ALONG_X += " pos = (0, 9, 0) ); "


def block(*spans: tuple[float, float]) -> np.ndarray:
    """The corners of a box from its intervals in x, y and z [mm]."""
    return np.array(list(every(*spans)), float) * MM


def prism(radius: float, low: float, high: float, axis: int, sides: int = 48) -> np.ndarray:
    """A round peg along an axis through the origin [mm]."""
    angles = 2 * np.pi * np.arange(sides) / sides
    rim = np.column_stack([np.cos(angles), np.sin(angles)]) * radius
    ends = [np.insert(rim, axis, value, axis=1) for value in (low, high)]
    return np.concatenate(ends) * MM


def plate(hole: float, axis: int, size: float = 30, thick: float = 5) -> list[np.ndarray]:
    """A plate across an axis, with a square hole of half width `hole`, in four boxes [mm]."""
    spans = (
        [(-size, -hole), (-size, size)],
        [(hole, size), (-size, size)],
        [(-hole, hole), (-size, -hole)],
        [(-hole, hole), (hole, size)],
    )
    found = []
    for span in spans:
        span.insert(axis, (-thick, thick))
        found.append(block(*span))
    return found


def judged(text: str, **pieces: list[np.ndarray]) -> Matings:
    """The matings of a PAG whose parts `pieces` are made of these convex bodies."""
    pag, product = made_of(text, **pieces)
    return matings(expand(pag, TEMPLATES), product)


def made_of(text: str, **pieces: list[np.ndarray]) -> tuple[PAG, Product]:
    """A PAG whose parts `pieces` are made of these convex bodies."""
    atoms = "; ".join(f"{name} = atomic ( box = (1, 1, 1) )" for name in pieces)
    pag = read_pag(text + atoms, TEMPLATES)
    product = product_geometry(pag)
    solids = dict(product.solids)
    for name, mine in pieces.items():
        corners = np.concatenate(mine)
        low, high = corners.min(axis=0), corners.max(axis=0)
        solid = replace(solids[name], pieces=tuple(mine), corners=corners, low=low, high=high)
        solids[name] = solid
    return pag, replace_solids(product, solids)


def replace_solids(product: Product, solids: Mapping[str, object]) -> Product:
    return Product(solids, product.low, product.high)  # type: ignore[arg-type]


def one(found: Matings, label: str = "") -> Mating:
    """The mating of a label, or the first."""
    return next(m for m in found.all if label in ("", m.label))


def overlapping(mating: Mating) -> tuple[tuple[tuple[str, str], ...], ...]:
    """The parts that overlap or scrape, for each side."""
    return tuple(tuple(found.parts for found in side) for side in mating.approach.overlaps)


# --- hand-made cases --------------------------------------------------------------------------


def test_two_boxes_side_by_side_slide_from_one_side_only() -> None:
    a, b = block((0, 10), (0, 10), (0, 10)), block((0, 10), (10, 20), (0, 10))
    found = one(judged(ALONG_Y, a=[a], b=[b]))
    assert (found.approach.kind, found.approach.axis) == ("slide", 1)
    assert found.approach.sides == (+1,)
    assert overlapping(found) == ((),)
    assert found.level == STRICT and found.clashes == ()
    swapped = one(judged(ALONG_Y, a=[b], b=[a]))
    assert swapped.approach.sides == (-1,)


def test_what_lies_beside_the_way_comes_from_both_sides() -> None:
    a, b = block((0, 10), (0, 10), (0, 10)), block((10, 20), (0, 10), (0, 10))
    assert one(judged(ALONG_Y, a=[a], b=[b])).approach.sides == (-1, +1)
    assert one(judged(ALONG_X, a=[a], b=[b]), "s").approach.sides == (+1,)


def hooks() -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Two hooks that hold each other along y."""
    high = (0, 10)
    a = [block((0, 30), (0, 10), high), block((20, 30), (10, 30), high)]
    a.append(block((10, 20), (20, 30), high))
    b = [block((0, 20), (40, 50), high), block((0, 9.9), (10.1, 40), high)]
    b.append(block((9.9, 19.9), (10.1, 19.9), high))
    return a, b


def test_hooks_that_hold_each_other_are_lowered() -> None:
    a, b = hooks()
    found = one(judged(ALONG_Y, a=a, b=b))
    assert (found.approach.kind, found.slide, found.lower) == ("lower", BLOCKED, STRICT)
    assert found.approach.lowered == "b"
    assert found.approach.stroke == pytest.approx(0.030)
    assert found.approach.sides == (-1, +1)
    assert overlapping(found) == ((), ())


def test_hooks_between_covers_are_blocked_and_told() -> None:
    a, b = hooks()
    covers = [block((0, 30), (0, 50), z) for z in ((-5, 0), (10, 15))]
    found = one(judged(ALONG_Y, a=a + covers, b=b))
    assert found.approach.kind == "blocked"
    assert [clash.parts for clash in found.clashes] == [("a", "b")]
    assert found.clashes[0].depth == pytest.approx(10 * MM, abs=0.2 * MM)
    assert found.clashes[0].finished == 0.0
    assert overlapping(found) == ((("a", "b"),),) * len(found.approach.sides)


@pytest.mark.parametrize(
    ("axis", "text", "kind"),
    [
        (1, ALONG_Y, "slide"),
        (0, ALONG_X, "slide"),
        (2, ALONG_Y, "lower"),
        (2, ALONG_X, "lower"),
        (0, ALONG_Y, "blocked"),
        (1, ALONG_X, "blocked"),
    ],
)
def test_a_peg_goes_into_its_hole_along_its_axis_alone(axis: int, text: str, kind: str) -> None:
    found = judged(text, a=plate(8, axis), b=[prism(7.9, -20, 20, axis)])
    mating = one(found, "r" if text == ALONG_Y else "s")
    assert mating.approach.kind == kind
    if kind == "blocked":
        assert mating.clashes[0].depth > 5 * MM
    else:
        assert mating.level == STRICT


def test_a_box_in_a_frame_is_lowered_and_under_a_lid_is_blocked() -> None:
    frame, inner = plate(8, 2), block((-8, 8), (-8, 8), (-4, 4))
    into = one(judged(ALONG_Y, a=frame, b=[inner])).approach
    assert (into.kind, into.stroke) == ("lower", pytest.approx(0.029))
    lids = [block((-30, 30), (-30, 30), z) for z in ((-7, -5), (5, 7))]
    closed = one(judged(ALONG_Y, a=frame + lids, b=[inner]))
    assert closed.approach.kind == "blocked"
    assert closed.clashes[0].parts == ("a", "b")


def test_robots_without_lifts_lower_nothing() -> None:
    pag, product = made_of(ALONG_Y, a=plate(8, 2), b=[block((-8, 8), (-8, 8), (-4, 4))])
    factory = without_lifts(factory_of(pag), product)
    (approach,) = (o.approach for o in factory.operations if len(o.inputs) > 1)
    assert approach is not None and approach.kind == "blocked"


def test_with_a_floor_the_box_is_still_lowered_or_the_frame_is_put_over_it() -> None:
    frame, inner = plate(8, 2), block((-8, 8), (-8, 8), (-5, 4))
    floor = block((-30, 30), (-30, 30), (-7, -5))
    lid = block((-30, 30), (-30, 30), (5, 7))
    into = one(judged(ALONG_Y, a=[*frame, floor], b=[inner]))
    assert (into.approach.kind, into.approach.lowered) == ("lower", "b")
    over = one(judged(ALONG_Y, a=[*frame, lid], b=[inner]))
    assert (over.approach.kind, over.approach.lowered) == ("lower", "a")
    assert over.approach.stroke == pytest.approx(0.029)


def test_a_pile_that_its_carrier_holds_is_not_lowered() -> None:
    frame, inner = plate(8, 2), block((-8, 8), (-8, 8), (-5, 4))
    lid = block((-30, 30), (-30, 30), (5, 7))
    beside = block((-90, -80), (-4, 4), (-4, 4))
    text = "root = r; r = mate ( a, c, b ); "
    found = judged(text, a=[*frame, lid], c=[beside], b=[inner])
    assert one(found, "r").approach.kind == "blocked"
    assert one(found, "r/2").approach.kind == "slide"
    last = judged(text, a=[inner], c=[beside], b=[*frame, lid])
    assert one(last, "r").approach.lowered == "b"


def test_a_press_fit_is_clean_only_with_finished_overlaps_left_out() -> None:
    found = judged(ALONG_Y, a=plate(8, 1), b=[block((-8.05, 8.05), (-20, 20), (-7, 7))])
    mating = one(found)
    assert (mating.approach.kind, mating.slide) == ("slide", NO_DEEPER)
    assert overlapping(mating) == ((("a", "b"),), (("a", "b"),))
    assert [found.count(level) for level in (LEFT_OUT, NO_DEEPER, STRICT)] == [1, 1, 0]


def test_what_overlaps_is_known_body_by_body() -> None:
    """Part z has three bodies: a overlaps the second and scrapes along the third. Parts are in
    alphabetical order, and their bodies in that of the parts."""
    bodies = [block((90, 99), (0, 9), (0, 9)), block((0, 10), (0, 10), (0, 10))]
    bodies.append(block((-5, 0), (9, 20), (0, 10)))
    text = "root = r; r = mate ( z, a ); "
    found = one(judged(text, z=bodies, a=[block((0, 10), (9.7, 20), (0, 10))]))
    ((overlap,),) = found.approach.overlaps
    assert (overlap.parts, overlap.deep) == (("a", "z"), pytest.approx(0.3 * MM))
    far = [pytest.approx(0.3 * MM), pytest.approx(CLEAR)]
    assert overlap.bodies == ((0, 1, far[0]), (0, 2, far[1]))


def test_a_snap_fit_goes_deeper_on_its_way() -> None:
    peg = [block((-7, 7), (-20, 20), (-7, 7)), block((-9, 9), (6, 20), (-7, 7))]
    peg.append(block((-9, 9), (-20, -6), (-7, 7)))
    loose = one(judged(ALONG_Y, a=plate(8, 1), b=peg))
    assert (loose.approach.kind, loose.clashes[0].depth) == ("blocked", pytest.approx(1 * MM))
    assert loose.clashes[0].shift == pytest.approx(1 * MM, abs=1.1 * MM)
    tight = one(judged(ALONG_Y, a=plate(8, 1), b=[*peg, block((-8.05, 0), (-5, 5), (-7, 7))]))
    assert (tight.approach.kind, tight.slide) == ("blocked", BLOCKED)
    assert tight.clashes[0].finished == pytest.approx(0.05 * MM)


@pytest.mark.parametrize(
    ("by", "level"), [(0.05, BLOCKED), (0.005, NO_DEEPER), (-0.04, NO_DEEPER), (-0.06, STRICT)]
)
def test_planted_fault_something_is_in_the_way_by_a_hair(by: float, level: int) -> None:
    peg = [block((-7, 7), (-20, 20), (-7, 7)), block((-8 - by, 0), (6, 20), (-7, 7))]
    peg.append(block((-8 - by, 0), (-20, -6), (-7, 7)))
    assert one(judged(ALONG_Y, a=plate(8, 1), b=peg)).slide == level


def test_sides_may_differ_in_what_they_exclude() -> None:
    """From +y the last one passes a lug that it overlaps in the end, from -y another."""
    body = block((0, 10), (0, 10), (0, 10))
    lugs = {"a": block((-10, 0.1), (0, 10), (0, 10)), "c": block((0, 10), (9.9, 20), (0, 10))}
    text = "root = r; r = mate ( a, c, b ); "
    found = one(judged(text, **{n: [v] for n, v in lugs.items()}, b=[body]), "r")
    assert found.approach.sides == (-1,)
    assert overlapping(found) == ((("a", "b"), ("b", "c")),)


def test_positions_are_those_of_the_input_that_comes() -> None:
    text = "root = r;\nr = mate ( a, c,\n b );\n"
    where = (block((0, 10), (k, k + 10), (0, 10)) for k in (0, 20, 40))
    found = judged(text, **{name: [body] for name, body in zip("acb", where, strict=True)})
    assert [(m.label, m.position.line) for m in found.all if m.position] == [("r/2", 2), ("r", 3)]


# --- the axes, and where parts meet -----------------------------------------------------------


def test_axes_alternate_with_the_robots_that_bring() -> None:
    text = """root = r; r = weld ( t ); t = mate ( u, d, e ); u = weld ( v ); v = mate ( a, b );
    e = mate ( f, g ); a = atomic(); b = atomic(); d = atomic(); f = atomic(); g = atomic()"""
    pag = read_pag(text, TEMPLATES)
    found = {m.label: (m.axis, m.either) for m in meetings(expand(pag, TEMPLATES)).all}
    assert found == {"v": (0, True), "t/2": (1, True), "e": (0, True), "t": (1, False)}


@given(pags(max_labels=30))
@settings(max_examples=60)
def test_parts_meet_at_their_lowest_common_operation(pag: PAG) -> None:
    nodes = expand(pag, TEMPLATES)
    found = meetings(nodes)
    above = {name: label for label, node in nodes.items() for name in node.inputs}

    def ancestors(label: str) -> list[str]:
        chain = [label]
        while chain[-1] in above:
            chain.append(above[chain[-1]])
        return chain

    pairs = [(i, j) for j in range(len(found.parts)) for i in range(j)]
    if not pairs:
        return
    got = found.of(*(np.array(side) for side in zip(*pairs, strict=True)))
    for (i, j), number in zip(pairs, got, strict=True):
        mine = set(ancestors(found.parts[i]))
        lowest = next(label for label in ancestors(found.parts[j]) if label in mine)
        assert found.all[number].label == lowest


# --- products with no shapes of their own -----------------------------------------------------


@given(pags(max_labels=60))
@settings(max_examples=80)
def test_default_boxes_always_slide(pag: PAG) -> None:
    """Theorem: neighbouring intervals of the path to and fro go ahead of each other."""
    plain = tuple(n if n.inputs else replace(n, parameters=()) for n in pag.nodes)
    bare = replace(pag, nodes=plain)
    assert not bare.is_shaped
    found = matings(expand(bare, TEMPLATES), product_geometry(bare))
    assert all(m.approach.kind == "slide" and m.level == STRICT for m in found.all)


def test_large_default_products_always_slide() -> None:
    pag = read_pag(random_pag_text(1501, 1), TEMPLATES)
    found = matings(expand(pag, TEMPLATES), product_geometry(pag))
    assert found.count(STRICT) == len(found.all) and not found.of_kind("lower")


def test_work_grows_with_the_number_of_parts() -> None:
    work = []
    for parts in (900, 4_500):
        pag = read_pag(random_pag_text(2 * parts - 1, 1), TEMPLATES)
        product = product_geometry(pag)
        calls, judged = counted(matings, expand(pag, TEMPLATES), product)
        assert len(judged.approaches) == parts - 1
        work.append(calls)
    assert work[1] < 6 * work[0]
    assert len(product.solids) > CHUNK


# --- the depth of a path ----------------------------------------------------------------------


def convex_pair(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Two convex bodies near each other, of some centimetres: random, prisms, or alike."""
    rng = np.random.default_rng(seed)
    found = []
    for kind in rng.integers(3, size=2):
        if kind == 0:
            found.append(rng.normal(size=(int(rng.integers(4, 24)), 3)) * 0.02)
        else:
            sides, axis = int(rng.integers(3, 14)), int(rng.integers(3))
            found.append(prism(20, -15, 25, axis, sides) * rng.uniform(0.5, 1.5))
    if seed % 5 == 0:
        found[1] = found[0].copy()
    return found[0], found[1] + rng.normal(size=3) * 0.04


def deepest(
    difference: Difference, apart: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The greatest depth on the way along a direction, and how far that is, for each place."""
    heights = difference.heights(apart)
    return summits(heights, np.broadcast_to(difference.normals @ direction, heights.shape))


def brute(p: np.ndarray, q: np.ndarray, direction: np.ndarray, shifts: np.ndarray) -> np.ndarray:
    """D(λ) from the hull of all differences of vertices."""
    hull = ConvexHull((q[:, None] - p[None]).reshape(-1, 3) * 100).equations
    heights = -hull[:, 3] / 100
    return np.array([(heights - hull[:, :3] @ (shift * direction)).min() for shift in shifts])


def test_depths_are_those_of_the_hull_of_all_differences() -> None:
    for seed in range(24):
        p, q = convex_pair(seed)
        direction = np.eye(3)[seed % 3] * (1 if seed % 2 else -1)
        mine, theirs, here = polytope(p), polytope(q), np.zeros((1, 3))
        difference = exact(mine, theirs)
        shifts = np.linspace(0, 0.4, 1601)
        expected = brute(p, q, direction, shifts)
        finished = difference.heights(here).min()
        assert max(finished, 0) == pytest.approx(max(expected[0], 0), abs=1e-8)
        assert np.sign(finished) == np.sign(expected[0])
        depth, shift = deepest(difference, here, direction)
        at_shift = brute(p, q, direction, shift)[0]
        assert max(depth[0], 0) >= expected.max() - 1e-8
        assert max(depth[0], 0) == pytest.approx(max(at_shift, 0), abs=1e-8)
        assert (depth[0] > 0) == (max(expected.max(), at_shift) > 0)
        assert deepest(rough(mine, theirs), here, direction)[0][0] >= depth[0] - 1e-9


def test_blades_over_a_box_meet_its_edges_on_the_right_side() -> None:
    """The faces beside the edge of a blade say nearly nothing of where outside is."""
    box, along = block((-20, 20), (-20, 20), (-20, 20)), np.array([-0.03, 0.03])
    blade = np.array([(x, y, z) for x in along for y, z in ((0, 0), (5e-4, 0.02), (-5e-4, 0.02))])
    met = 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        turned = blade @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3) * 0.02
        depth = exact(polytope(box), polytope(turned)).heights(np.zeros((1, 3))).min()
        expected = brute(box, turned, np.eye(3)[0], np.zeros(1))[0]
        assert max(depth, 0) == pytest.approx(max(expected, 0), abs=1e-8), seed
        assert (depth > 0) == (expected > 0)
        met += depth > 0
    assert 5 < met < 24


def test_what_grazes_is_met_beyond_the_last_bit_of_the_way() -> None:
    for seed in range(12):
        p, q = convex_pair(seed)
        difference = exact(polytope(p), polytope(q))
        for axis, direction in enumerate(np.eye(3)):
            heights, slopes = difference.heights(np.zeros((1, 3))), difference.normals[:, axis]
            depths, places = depths_of(heights, slopes)
            for side, sign in enumerate((-1, 1)):
                graze, place = depths.graze[0, side], places[2 + side]
                assert sign * place[0] >= LAST
                assert max(graze, 0) == pytest.approx(
                    max(brute(p, q, direction, place)[0], 0), abs=1e-8
                )
                beyond = sign * np.linspace(LAST, 0.4, 400)
                assert max(graze, 0) >= brute(p, q, direction, beyond).max() - 1e-8


def test_one_difference_serves_bodies_wherever_they_are() -> None:
    p, q = convex_pair(1)
    apart = np.random.default_rng(0).normal(size=(50, 3)) * 0.05
    together = deepest(exact(polytope(p), polytope(q)), apart, np.eye(3)[0])[0]
    alone = [
        deepest(exact(polytope(p + by), polytope(q)), np.zeros((1, 3)), np.eye(3)[0])[0][0]
        for by in apart
    ]
    assert np.maximum(together, 0) == pytest.approx(np.maximum(alone, 0), abs=1e-8)
    assert ((together > 0) == (np.array(alone) > 0)).all() and 5 < (together > 0).sum() < 45


def test_planted_fault_without_the_edges_depths_are_too_large() -> None:
    """Two beams that cross aslant meet at edges: faces alone do not see that they are apart."""
    beam = block((-40, 40), (-5, 5), (-5, 5))
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    worst = 0.0
    for height in np.linspace(0, 0.03, 31):
        p, q = polytope(beam @ turn + [0, 0, height]), polytope(beam)
        depths = [d(p, q).heights(np.zeros((1, 3))).min() for d in (rough, exact)]
        worst = max(worst, float(depths[0] - depths[1]))
    assert worst > 1 * MM


def test_depths_that_are_sought_are_those_of_all_facets() -> None:
    for seed in range(12):
        p, q = convex_pair(seed)
        apart = np.random.default_rng(seed).normal(size=(6, 3)) * 0.04
        for axis in range(3):
            difference = exact(polytope(p), polytope(q))
            all_, _ = depths_of(difference.heights(apart), difference.normals[:, axis])
            found = sought(p, q, apart, axis)
            assert (found.faulty == all_.faulty).all()
            faulty = all_.faulty.any(axis=1)
            for one, other in ((found.path, all_.path), (found.finished, all_.finished)):
                assert np.maximum(one, 0)[faulty] == pytest.approx(
                    np.maximum(other, 0)[faulty], abs=NEAR
                )
                assert (np.maximum(one, 0) >= np.maximum(other, 0) - 1e-8).all()


def egg(count: int, size: Sequence[float]) -> np.ndarray:
    """Points spread over an ellipsoid."""
    z = 1 - (2 * np.arange(count) + 1) / count
    turns = np.pi * (1 + 5**0.5) * np.arange(count)
    ring = np.sqrt(1 - z**2)
    return np.column_stack([ring * np.cos(turns), ring * np.sin(turns), z]) * size


def test_few_facets_of_fine_bodies_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two balls of 3,000 vertices: their difference has about 20,000 facets, and pairs of edges
    that may span one are 80 million."""
    looked: list[int] = []

    def touching(normals: np.ndarray, *bodies: np.ndarray) -> object:
        looked.append(len(normals))
        return real_touching(normals, *bodies)

    real_touching = paths._touching
    monkeypatch.setattr(paths, "_touching", touching)
    monkeypatch.setattr(bodies, "exact", pytest.fail)
    p, q = egg(3000, (0.02, 0.03, 0.02)), egg(3000, (0.02, 0.02, 0.04))
    beside, above = (
        one(judged(ALONG_Y, a=[p], b=[q + by])) for by in ([0.041, 0, 0], [0, 0.06, 0])
    )
    assert beside.approach.sides == (-1, +1) and above.approach.sides == (+1,)
    depth = sought(q, p, np.array([[0.03, 0.0, 0.0]]), 1).finished[0]
    assert depth == pytest.approx(0.01, abs=1e-4)  # the radii along x are 0.04 together
    assert sum(looked) < 500


class Engine:
    """Two convex meshes in MuJoCo; how deep they are in each other when one is shifted."""

    def __init__(self, p: np.ndarray, q: np.ndarray) -> None:
        spec = mujoco.MjSpec()
        for name, vertices in (("p", p), ("q", q)):
            mesh = spec.add_mesh(name=name)
            mesh.uservert = vertices.ravel()
            mesh.userface = ConvexHull(vertices).simplices.ravel()
            body = spec.worldbody.add_body(name=name, mocap=name == "p")
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, name=name)
            if name == "q":
                body.add_freejoint()
        self.m = spec.compile()
        self.d = mujoco.MjData(self.m)

    def depth(self, shift: np.ndarray) -> float:
        self.d.mocap_pos[0] = shift
        mujoco.mj_forward(self.m, self.d)
        return max((-float(contact.dist) for contact in self.d.contact), default=0.0)


def test_what_is_called_clean_gives_no_contact_in_the_engine() -> None:
    for seed in range(8):
        p, q = convex_pair(seed)
        engine, difference = Engine(p, q), exact(polytope(p), polytope(q))
        for direction in (*np.eye(3), *-np.eye(3)):
            depth, shift = deepest(difference, np.zeros((1, 3)), direction)
            if depth[0] <= TOLERANCE:
                found = [engine.depth(by * direction) for by in np.linspace(0, 0.2, 60)]
                assert max(found) <= TOLERANCE + 1e-6
            elif depth[0] > 1 * MM:
                assert engine.depth(shift[0] * direction) > 0.5 * MM


# --- check ------------------------------------------------------------------------------------

CLOSED = """root = r;
r = mate ( a, b );
a = mate ( low, left, right, front, rear, lid );
low = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.005) );
left = atomic ( box = (0.01, 0.06, 0.03), pos = (-0.025, 0, 0.025) );
right = atomic ( box = (0.01, 0.06, 0.03), pos = (0.025, 0, 0.025) );
front = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, -0.025, 0.025) );
rear = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, 0.025, 0.025) );
lid = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.045) );
b = atomic ( box = (0.03, 0.03, 0.02), pos = (0, 0, 0.02) )
"""


@pytest.fixture
def closed(tmp_path: Path) -> Path:
    """A box in a closed box."""
    file = tmp_path / "closed.pag"
    file.write_text(CLOSED)
    return file


def test_check_tells_figures_and_names_what_is_blocked(run: Terminal, closed: Path) -> None:
    done = run("check", closed)
    out = done.out
    assert done.status == 0
    assert "approach: 5 of 6 operations clear; 5 lowered, 1 blocked" in out
    assert "5 lowered, 1 blocked (--clashes DIR draws each)" in out
    assert done.err.splitlines()[-3:] == blocked_lines(closed)


def blocked_lines(closed: Path) -> list[str]:
    """What is told of CLOSED."""
    line = f"{closed}:2:15: Blocked warning: b cannot come to r: b and front 20.00 mm"
    return [line, "    r = mate ( a, b );", f"    {' ' * 14}^"]


def test_run_and_build_tell_what_is_blocked_as_check_does(run: Terminal, closed: Path) -> None:
    """The same lines, and the same entries in the documents; nothing with -q. No hand can hold
    what is in a closed box either."""
    found, lines = run("check", closed, "--json").json["warnings"], run("check", closed).err
    where = [(w["code"], w["line"], w["col"]) for w in found]
    assert where == [("Blocked", 2, 15), ("NoGrip", 10, 1)]
    assert lines.splitlines()[-3:] == blocked_lines(closed) and "no hand can hold 'b'" in lines
    made = ["build", closed, "--mjcf", closed.with_suffix(".xml")]
    for words in (["run", closed, "--world", "ideal"], made):
        for _ in range(2):  # a second build is left out
            assert run(*words).err == lines, words
        assert run(*words, "-q").err == ""
        done = run(*words, "--json")
        assert done.json["warnings"] == found and done.err == "", words


def test_of_many_blocked_operations_the_first_are_told_and_how_many_more() -> None:
    other, (shown, _) = Diagnostic("Size", "long"), LISTED["Blocked"]
    many = [Diagnostic("Blocked", f"b cannot come to r{i}: b and c 1.00 mm") for i in range(shown)]
    assert condensed([other, *many], verbose=False) == [other, *many]
    more = [*many, *many]
    assert condensed([other, *more], verbose=True) == [other, *more]
    *first, last = condensed([other, *more], verbose=False)
    assert first == [other, *many]
    assert str(last) == f"Blocked and {shown} more operations are blocked\n    list: -v"


def test_all_pairs_that_clash_in_one_operation_are_one_entry(run: Terminal, closed: Path) -> None:
    """Three parts in a closed box: one line, one entry, every pair in it."""
    text = CLOSED.replace("b = atomic", "b = mate ( b1, b2, b3 ); b1 = atomic").replace(
        "(0.03, 0.03, 0.02), pos = (0, 0, 0.02)", "(0.008, 0.03, 0.02), pos = (0, 0, 0.02)"
    )
    for name, x in (("b2", -0.0101), ("b3", 0.0101)):
        text += f"; {name} = atomic ( box = (0.008, 0.03, 0.02), pos = ({x}, 0, 0.02) )"
    closed.write_text(text)
    document = run("check", closed, "--json").json
    (clashes,) = document["clashes"]
    (warning,) = (w for w in document["warnings"] if w["code"] == "Blocked")
    pairs = [pair["parts"] for pair in clashes["pairs"]]
    assert (clashes["label"], clashes["line"]) == ("r", 2)
    assert sorted(pairs) == [["b1", "front"], ["b2", "front"], ["b3", "front"]]
    assert warning["message"].startswith("b cannot come to r: ")
    assert run("check", closed).err.count("Blocked warning: ") == 1
    tried = run("run", closed, "--json").json
    assert {*map(tuple, tried["excluded"])} == {*map(tuple, pairs)}, "those that check names"


def test_check_lists_approaches_and_clashes(run: Terminal, closed: Path) -> None:
    document = run("check", closed, "--json").json
    found = document["approaches"]
    assert {k: found[k] for k in ("operations", "slide", "lower", "blocked")} == {
        "operations": 6,
        "slide": 0,
        "lower": 5,
        "blocked": 1,
    }
    assert (found["left_out"], found["no_deeper"], found["strict"]) == (5, 5, 5)
    last = found["list"][-1]
    assert (last["label"], last["kind"], last["axis"], last["level"]) == (
        "r",
        "blocked",
        "y",
        "none",
    )
    (clashes,) = document["clashes"]
    (clash,) = clashes["pairs"]
    assert (clashes["label"], clash["parts"]) == ("r", ["b", "front"])
    assert clash["depth_mm"] == pytest.approx(20) and clashes["line"] == 2
    assert Path(clashes["file"]) == closed


def test_check_computes_no_geometry_where_no_part_has_a_shape(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "plain.pag"
    file.write_text("root = r; r = mate ( a, b ); a = atomic(); b = atomic()")
    monkeypatch.setattr("factory.floor.geometry.product.product_geometry", pytest.fail)
    document = run("check", file, "--clashes", tmp_path / "none", "--json").json
    assert document["approaches"] is None and document["clashes"] == []
    assert not (tmp_path / "none").exists()


def test_pictures_are_written_into_the_folder_alone(run: Terminal, tmp_path: Path) -> None:
    file, folder = tmp_path / "odd.pag", tmp_path / "pictures" / "here"
    file.write_text(
        CLOSED.replace("root = r", "root = ..").replace("r = mate ( a", ".. = mate ( a")
    )
    before = set(tmp_path.rglob("*"))
    assert run("check", file, "--clashes", folder).status == 0
    new = set(tmp_path.rglob("*")) - before - {folder, folder.parent}
    assert {path.parent for path in new} == {folder}
    blocked, grip = sorted(path.name for path in new)
    assert grip.startswith("grip-")
    text = (folder / blocked).read_text()
    root = ElementTree.fromstring(text)
    assert root.tag.endswith("svg") and "href" not in text and "url(" not in text
    words = "".join(root.itertext())
    assert "b and front overlap by 20.00 mm, 25.00 mm before" in words
    assert 'class="clash"' in text and " mm" in words


def test_a_link_in_the_folder_is_not_followed(run: Terminal, closed: Path, out: Path) -> None:
    aim = closed.parent / "elsewhere.svg"
    (out / "clash-001-r.svg").symlink_to(aim)
    done = run("check", closed, "--clashes", out)
    assert done.status == 2 and "is a link" in done.err
    assert not aim.exists()


def test_a_file_where_the_folder_should_be_is_refused(run: Terminal, closed: Path) -> None:
    done = run("check", closed, "--clashes", closed)
    assert done.status == 2 and "is a file, not a folder" in done.err


def test_names_of_pictures_are_safe_and_differ() -> None:
    labels = ["../../etc/x", "a/2", "a_2", "..", "é" * 300, "c:\\d", "x\0y"]
    names = picture_names("clash", labels)
    assert len(set(names)) == len(labels)
    assert all(re.fullmatch(r"clash-\d{3}-[\w.-]{1,40}\.svg", name) for name in names)


def test_a_picture_is_the_same_every_time_and_survives_odd_labels() -> None:
    pag = read_pag(CLOSED.replace("front", "fé"), TEMPLATES)
    product = product_geometry(pag)
    found = matings(expand(pag, TEMPLATES), product)
    (mating,) = found.of_kind("blocked")
    picture = draw(mating, found, product)
    assert picture == draw(mating, matings(expand(pag, TEMPLATES), product), product)
    odd = ElementTree.fromstring(draw(replace(mating, label="<&>" + "x" * 90), found, product))
    assert "<&>xxxx" in "".join(odd.itertext())


@given(st.integers(0, 10_000))
@settings(max_examples=15)
def test_random_products_have_nested_levels_and_consistent_exclusions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    spans = rng.integers(0, 40, (5, 3, 1)) + np.concatenate(
        [np.zeros((5, 3, 1), int), rng.integers(4, 30, (5, 3, 1))], axis=2
    )
    shapes = {f"p{i}": [block(*map(tuple, spans[i]))] for i in range(5)}
    text = "root = r; r = mate ( s, t ); s = mate ( p0, p1, p2 ); t = mate ( p3, p4 ); "
    found = judged(text, **shapes)
    assert found.count(STRICT) <= found.count(NO_DEEPER) <= found.count(LEFT_OUT)
    for mating in found.all:
        approach = mating.approach
        assert len(approach.overlaps) == len(approach.sides) > 0
        assert (mating.level == STRICT) == (not any(approach.overlaps))
        assert (approach.kind == "blocked") == bool(mating.clashes) == (mating.level == BLOCKED)


def test_matings_of_a_single_part_are_none(templates: Mapping[str, Template]) -> None:
    pag = read_pag("root = a; a = atomic ( sphere = 0.1 )", templates)
    assert matings(expand(pag, templates), product_geometry(pag)).all == ()


def test_what_passes_through_each_other_is_noted_where_it_is_allowed() -> None:
    a, b = hooks()
    covers = [block((0, 30), (0, 50), z) for z in ((-5, 0), (10, 15))]
    found = judged(ALONG_Y, a=a + covers, b=b)
    assert found.notes([]) == found.notes([AllowedOverlap(0.001)]) == []
    (note,) = found.notes([AllowedOverlap(0.011, ("a", "b"))])
    assert note.startswith("a pair of parts passes through each other on the way by up to")
