"""The theorems of the planner: what interlocks, what is best, and what `check` says of it. The
exploded view of a planned product, as a still and as a film."""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold

from factory.apps.planning import searching
from factory.apps.planning.blocking import (
    CLASHES,
    DEEPER,
    LOCKED,
    Blocking,
)
from factory.apps.planning.cannot import interlocks, removal
from factory.apps.planning.divisions import Late, divisions
from factory.apps.planning.exact import Best, Expected, Tree, TreeTask
from factory.apps.planning.growing import Divider, bettered, divided, units_of
from factory.apps.planning.judging import Judged, Site
from factory.apps.planning.laying import LaidOut
from factory.apps.planning.loose_parts import loose_parts
from factory.apps.planning.searching import GROWING, Sought, budget_of, trees
from factory.apps.planning.subsets import Stance, stances, subsets
from factory.floor.geometry.decimation import ENOUGH, decimated
from factory.floor.layout.durations import Pace
from factory.support.errors import Diagnostic, RunError

EXPECTED = Expected(Pace())


@st.composite
def graphs(draw: st.DrawFn, least: int = 2, most: int = 5) -> Blocking:
    """Blocking graphs of any units, dense or not."""
    count = draw(st.integers(least, most))
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    levels = np.zeros((3, count, count), np.int8)
    for share, level in ((0.2, DEEPER), (draw(st.sampled_from((0.1, 0.25, 0.4))), CLASHES)):
        levels[random.random(levels.shape) < share] = level
    levels[:, range(count), range(count)] = 0
    touch = random.random((count, count)) < 0.7
    touch = touch | touch.T | np.eye(count, dtype=bool)
    low = random.random((count, 3)) * 0.1
    labels = tuple("abcdefghijkl"[:count])
    return Blocking(labels, levels, levels >= LOCKED, touch, low, low + 0.02)


def site(found: Blocking, stance: Stance) -> Site:
    """The problem in a stance, of units that cost nothing."""
    return Site(found, stance, EXPECTED, np.zeros((2, len(found))))


def test_the_hub_of_many_pairs_is_removed() -> None:
    levels = np.zeros((3, 5, 5), np.int8)
    levels[:, 4, :4] = levels[:, :4, 4] = CLASHES
    touch, low = np.ones((5, 5), bool), np.zeros((5, 3))
    found = Blocking(tuple("abcde"), levels, levels >= LOCKED, touch, low, low + 1)
    assert interlocks(found)[0].labels == tuple("abcde")
    assert removal(found).labels == ("e",)


@settings(max_examples=20, deadline=None)
@given(graphs(least=9, most=12), st.sampled_from(stances()[:4]), st.integers(0, 9))
def test_dividing_finds_a_tree_whenever_there_is_one(
    found: Blocking, stance: Stance, seed: int
) -> None:
    sparse = np.where(np.random.default_rng(seed).random(found.levels.shape) < 0.3, found.levels, 0)
    found = Blocking(
        found.labels, sparse, sparse >= LOCKED, found.touch, found.low.copy(), found.high.copy()
    )
    if interlocks(found):
        return
    random = np.random.default_rng(seed)
    problem = site(found, stance)
    tree = divided(problem, random, 1.0)
    assert units_of(tree) == tuple(range(len(found)))
    last = problem.judged(tree)
    assert last.count(LOCKED) == 0
    betters = bettered(problem, tree, np.inf, lambda: False, random)
    for better in islice(betters, 3):
        assert better.price <= last.price and units_of(better.tree) == units_of(tree)
        assert better.count(LOCKED) == 0
        last = better


def test_many_units_that_interlock_are_not_divided() -> None:
    count = 20
    levels = np.full((3, count, count), CLASHES, np.int8)
    levels[:, range(count), range(count)] = 0
    touch, low = np.ones((count, count), bool), np.zeros((count, 3))
    found = Blocking(tuple(map(str, range(count))), levels, levels > 0, touch, low, low + 1)
    random = np.random.default_rng(0)
    assert Divider(found).best(tuple(range(count)), (0, 1, 2), random) is None


def test_stances_are_the_rotations_up_to_half_a_turn() -> None:
    turned = [stance.rotation for stance in stances()]
    half = np.diag([-1.0, -1.0, 1.0])
    whole = {tuple(m.ravel().tolist()) for r in turned for m in (r, half @ r)}
    assert len(whole) == 24
    assert all(np.linalg.det(r) == pytest.approx(1.0) for r in turned)
    assert np.array_equal(turned[0], np.eye(3)) and stances()[0] == Stance()
    for stance in stances():
        assert abs(stance.rotation[0, stance.axes[0]]) == 1
        assert stance.rotation[2, stance.axes[2]] == stance.up


SIDES = 512
"""The sides of round parts."""


def ball(radius: float) -> Manifold:
    return Manifold.sphere(radius, SIDES // 4)


def test_a_decimated_body_is_as_near_as_it_says() -> None:
    within = 1e-2
    body = ball(8.0)
    coarse = decimated(body, within)
    assert coarse.body.num_tri() < body.num_tri() and 0 < coarse.far <= within
    points = np.asarray(coarse.body.to_mesh64().vert_properties)
    middles = points[np.asarray(coarse.body.to_mesh64().tri_verts).astype(int)].mean(axis=1)
    sunk = 8.0 - np.linalg.norm(middles, axis=1).min()
    assert sunk <= 3 * within, "the surface has not gone elsewhere"


def test_what_is_coarse_enough_stays_as_it_is() -> None:
    body = Manifold.sphere(8.0, 32)
    assert body.num_tri() <= ENOUGH
    assert decimated(body, 1.0).body is body


def test_a_tolerance_that_no_coarser_body_keeps_gives_the_body_itself() -> None:
    body = ball(8.0)
    coarse = decimated(body, 1e-9)
    assert coarse.far == 0.0 and coarse.body.num_tri() == body.num_tri()


def two_units(price: float) -> TreeTask:
    """Two units that nothing blocks, of a price if their own inputs come along the first axis."""
    levels, low = np.zeros((3, 2, 2), np.int8), np.array([[0.0, 0, 0], [0.1, 0, 0]])
    found = Blocking(("a", "b"), levels, levels > 0, np.ones((2, 2), bool), low, low + 0.1)
    of = divisions(subsets(found), stances()[0].axes[2], stances()[0].up, apart=True)
    return TreeTask(of, EXPECTED, np.array([[price, price], [0.0, 0.0]]))


@pytest.mark.parametrize(("price", "tree"), [(0.4, (0, 1)), (0.6, ((0, 1),))])
def test_a_relay_is_chosen_where_it_costs_less_than_the_units(price: float, tree: Tree) -> None:
    task = two_units(price)
    assert Best(task, None).tree(task.subsets.whole, 1) == tree


def test_each_bound_has_an_equal_share_of_the_budget(monkeypatch: pytest.MonkeyPatch) -> None:
    count, used = 20, list[float]()
    levels, touch = np.zeros((3, count, count), np.int8), np.ones((count, count), bool)
    low = np.random.default_rng(0).random((count, 3))
    found = Blocking(tuple(map(str, range(count))), levels, levels > 0, touch, low, low + 0.1)
    given_ = np.zeros((2, count))
    asked = Sought(found, EXPECTED, lambda _: given_, "floor", budget_of(count))

    def used_up(
        _site: Site, _tree: Tree, _bound: float, late: Late, _random: object
    ) -> list[Judged]:
        used.append(asked.budget.used)
        while not late():
            pass
        return []

    monkeypatch.setattr(searching, "bettered", used_up)
    trees(asked)
    used.append(asked.budget.used)
    assert np.diff(used) == pytest.approx((GROWING - used[0]) / 3, abs=0.01)


def test_a_tree_without_a_layout_takes_for_ever_on_an_endless_floor() -> None:
    class Unlaid:
        settings = None

        @property
        def layout(self) -> None:
            raise RunError(Diagnostic("NoLayout", "no", None, ""))

    tree: Any = LaidOut(None, (), Unlaid(), 1)  # type: ignore[arg-type]
    assert tree.seconds == np.inf == tree.area


def test_a_light_stands_as_far_off_as_the_product_is_large() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    surfaces = {"a": (np.array(box.vertices), np.array(box.faces))}
    for size in (0.1, 2.0):
        m = loose_parts(surfaces, [(1.0, 0.0, 0.0, 1.0)], 0.0, size)
        assert m.light_pos == pytest.approx(-3.0 * size * m.light_dir, rel=0.01)
