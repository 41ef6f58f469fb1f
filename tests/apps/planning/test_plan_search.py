"""The theorems of the planner: what interlocks, what is best, and what `check` says of it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, islice, product
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.few_robots.lines import admitted
from factory.apps.planning import searching
from factory.apps.planning.blocking import (
    CLASHES,
    DEEPER,
    FREE,
    LOCKED,
    SCRAPES,
    Blocking,
    blocking,
)
from factory.apps.planning.cannot import cores, interlocks, removal
from factory.apps.planning.divisions import Late, divisions
from factory.apps.planning.exact import Best, Expected, Tree, TreeTask, tables
from factory.apps.planning.growing import Divider, bettered, divided, units_of
from factory.apps.planning.judging import Judged, Site
from factory.apps.planning.laying import LaidOut
from factory.apps.planning.parts import InPlace
from factory.apps.planning.searching import GROWING, Sought, budget_of, trees
from factory.apps.planning.source import placed
from factory.apps.planning.subsets import ROOT_AXIS, Stance, stances, subsets
from factory.apps.planning.writing import planned_product
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.durations import Pace
from factory.floor.mating.findings import BLOCKED, LEFT_OUT, NO_DEEPER, STRICT
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.support.errors import Diagnostic, RunError
from factory.theory.compiler.expanding import expand
from factory.theory.lang.pag_reader import read_pag

TEMPLATES = all_templates()
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


def halves(members: tuple[int, ...]) -> Iterator[tuple[tuple[int, ...], tuple[int, ...]]]:
    """All ways to divide some units in two."""
    first, *rest = members
    for size in range(len(rest)):
        for more in combinations(rest, size):
            yield (first, *more), tuple(n for n in rest if n not in more)


def comes_apart(locks: np.ndarray, members: tuple[int, ...]) -> bool:
    """Whether some units can be taken apart along the axes: by trying all ways."""
    if len(members) < 2:
        return True
    return any(
        not locks[axis][np.ix_(one, other)].any()
        and comes_apart(locks, one)
        and comes_apart(locks, other)
        for left, right in halves(members)
        for axis, (one, other) in product(range(3), ((left, right), (right, left)))
    )


def binary(members: tuple[int, ...]) -> Iterator[Tree]:
    """All trees in which a third robot takes what two bring, with relays wherever they can be."""
    if len(members) == 1:
        yield members[0]
        return
    for one, other in halves(members):
        for tree in product(binary(one), binary(other)):
            yield tree
            yield (tree,)


def piled(members: tuple[int, ...]) -> Iterator[Tree]:
    """All trees without relays, in which robots may stay with their piles."""
    if len(members) == 1:
        yield members[0]
        return
    for left, right in halves(members):
        yield from product(piled(left), piled(right))
        for pile, come in ((left, right), (right, left)):
            if len(pile) > 1:
                for tree, last in product(piled(pile), piled(come)):
                    yield (*tree, last)


def site(found: Blocking, stance: Stance) -> Site:
    """The problem in a stance, of units that cost nothing."""
    return Site(found, stance, EXPECTED, np.zeros((2, len(found))))


def judged(found: Blocking, stance: Stance, all_: Iterator[Tree]) -> list[Judged]:
    """The trees of which no join is locked."""
    return [one for one in map(site(found, stance).judged, all_) if not one.count(LOCKED)]


@settings(max_examples=20, deadline=None)
@given(graphs(least=3))
def test_a_group_takes_the_room_of_its_units(found: Blocking) -> None:
    group = found.grouped([(0, 2), *((n,) for n in range(len(found)) if n not in (0, 2))])
    assert (group.low[0] == np.minimum(found.low[0], found.low[2])).all()
    assert (group.high[0] == np.maximum(found.high[0], found.high[2])).all()


def test_estimated_times_are_those_of_the_trapezoid() -> None:
    ways = np.linspace(0.0, 1.0, 101)
    times = [EXPECTED.pace.rest(way) for way in ways.tolist()]
    assert EXPECTED.rest(ways) == pytest.approx(times)


@settings(max_examples=60, deadline=None)
@given(graphs())
def test_parts_interlock_if_and_only_if_no_tree_joins_them(found: Blocking) -> None:
    every = tuple(range(len(found)))
    stuck = interlocks(found)
    assert comes_apart(found.locks, every) == (not stuck)
    for one in stuck:
        members = tuple(found.labels.index(label) for label in one.labels)
        for left, right in halves(members):
            for axis in range(3):
                assert found.locks[axis][np.ix_(left, right)].any()
                assert found.locks[axis][np.ix_(right, left)].any()
        for (axis, side), circuit in one.circuits:
            way = [found.labels.index(label) for label in circuit]
            for i, j in zip(way, [*way[1:], way[0]], strict=True):
                assert found.locks[axis][(i, j) if side > 0 else (j, i)]


@settings(max_examples=40, deadline=None)
@given(graphs(most=6))
def test_no_fewer_parts_can_be_removed(found: Blocking) -> None:
    every, least = range(len(found)), removal(found)
    assert least.smallest
    gone = {found.labels.index(label) for label in least.labels}
    assert not cores(found.locks, [n for n in every if n not in gone])
    for fewer in combinations(every, len(gone) - 1) if gone else ():
        assert cores(found.locks, [n for n in every if n not in fewer])
    assert not interlocks(found.allowing(least.labels))


def test_the_hub_of_many_pairs_is_removed() -> None:
    levels = np.zeros((3, 5, 5), np.int8)
    levels[:, 4, :4] = levels[:, :4, 4] = CLASHES
    touch, low = np.ones((5, 5), bool), np.zeros((5, 3))
    found = Blocking(tuple("abcde"), levels, levels >= LOCKED, touch, low, low + 1)
    assert interlocks(found)[0].labels == tuple("abcde")
    assert removal(found).labels == ("e",)


@settings(max_examples=25, deadline=None)
@given(graphs(most=4), st.sampled_from(stances()))
def test_least_price_and_cycle_are_those_of_all_trees(found: Blocking, stance: Stance) -> None:
    task = TreeTask(divisions(subsets(found), stance.axes[2], stance.up, apart=True), EXPECTED)
    known, at = tables(task), task.divisions.level.index(stance.axes[ROOT_AXIS])
    all_ = judged(found, stance, (t for t in binary(tuple(range(len(found))))))
    price, time = known.price[at, -1], known.time[at, -1]
    if not all_:
        assert price == np.inf
        return
    best = min(all_, key=lambda one: (one.price, one.seconds))
    assert price == best.price
    assert time == pytest.approx(best.seconds) or best.relays
    tree = Best(task, None).tree(task.subsets.whole, at)
    assert site(found, stance).judged(tree).price == price


@settings(max_examples=25, deadline=None)
@given(graphs(most=4), st.sampled_from(stances()))
def test_no_tree_of_that_price_has_fewer_robots(found: Blocking, stance: Stance) -> None:
    task = TreeTask(divisions(subsets(found), stance.axes[2], stance.up, apart=True), EXPECTED)
    best, at = Best(task), task.divisions.level.index(stance.axes[ROOT_AXIS])
    all_ = judged(found, stance, piled(tuple(range(len(found)))))
    if not np.isfinite(best.made[at, -1]):
        assert not all_
        return
    mine = site(found, stance).judged(best.tree(task.subsets.whole, at))
    for other in all_:
        assert (mine.price, mine.robots) <= (other.price, other.robots)


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


def test_a_search_that_is_stopped_gives_a_tree() -> None:
    count = 10
    levels, touch = np.zeros((3, count, count), np.int8), np.ones((count, count), bool)
    low = np.random.default_rng(0).random((count, 3))
    found = Blocking(tuple("abcdefghij"), levels, levels > 0, touch, low, low + 0.1)
    given_ = np.zeros((2, count))
    budget = budget_of(count, 60.0, lambda: True)
    stopped = trees(Sought(found, EXPECTED, lambda _: given_, budget=budget))
    assert not stopped.optimal
    assert units_of(stopped.all[0].tree) == tuple(range(count))


def test_many_units_that_interlock_are_not_divided() -> None:
    count = 20
    levels = np.full((3, count, count), CLASHES, np.int8)
    levels[:, range(count), range(count)] = 0
    touch, low = np.ones((count, count), bool), np.zeros((count, 3))
    found = Blocking(tuple(map(str, range(count))), levels, levels > 0, touch, low, low + 1)
    random = np.random.default_rng(0)
    assert Divider(found).best(tuple(range(count)), (0, 1, 2), random) is None


@st.composite
def boxes(draw: st.DrawFn) -> InPlace:
    """Boxes in a lattice, some of them long, some apart: many of them in each other's way."""
    count = draw(st.integers(2, 6))
    lines = []
    for n in range(count):
        at = [draw(st.integers(0, 3)) * 0.02 for _ in range(3)]
        size = [draw(st.sampled_from((0.0198, 0.0198, 0.0598))) for _ in range(3)]
        lines.append(f"p{n} = atomic ( box = {tuple(size)}, pos = {tuple(at)} );")
    names = ", ".join(f"p{n}" for n in range(count))
    pag = read_pag(f"root = all; all = mate ( {names} ); " + "".join(lines), TEMPLATES)
    parts, _ = placed(pag, {})
    return InPlace("boxes", parts)


LEVEL_OF = {FREE: STRICT, SCRAPES: NO_DEEPER, DEEPER: LEFT_OUT, LOCKED: LEFT_OUT, CLASHES: BLOCKED}


@settings(max_examples=60, deadline=None)
@given(boxes(), st.sampled_from(stances()), st.integers(0, 2**32))
def test_what_is_free_is_what_check_calls_free(source: InPlace, stance: Stance, seed: int) -> None:
    """Of any tree in any stance each operation is as free along each way as `check` finds, and
    comes along the way that `check` chooses."""
    found, count, rng = blocking(source), len(source.parts), np.random.default_rng(seed)
    made: list[Tree] = list(range(count))
    while len(made) > 1:
        rng.shuffle(made)
        pile, come = made.pop(), made.pop()
        made.append(
            (*pile, come) if isinstance(pile, tuple) and rng.random() < 0.7 else (pile, come)
        )
    joins = site(found, stance).judged(made[0]).joins

    def named(tree: Tree) -> Tree:
        return source.parts[tree].label if isinstance(tree, int) else tuple(map(named, tree))

    pag = planned_product(source, named(made[0]), stance.rotation).pag
    solids = product_geometry(pag)
    theirs, admits = (
        matings(expand(pag, TEMPLATES), solids),
        admitted(expand(pag, TEMPLATES), solids),
    )
    inside: dict[str, frozenset[int]] = {
        p.label: frozenset([n]) for n, p in enumerate(source.parts)
    }
    mine = {frozenset((*join.pile, *join.come)): join for join in joins}
    assert len(theirs.all) == len(mine)
    for mating in theirs.all:
        inside[mating.label] = frozenset().union(*(inside[label] for label in mating.inputs))
        join, admit = mine[inside[mating.label]], admits[mating.label]
        last = tuple(inside[mating.inputs[-1]])
        other = tuple(inside[mating.label] - {*last})

        def level(come: tuple[int, ...], stay: tuple[int, ...], axis: int, side: int) -> int:
            levels = found.levels[axis] if side > 0 else found.levels[axis].T
            return LEVEL_OF[int(levels[np.ix_(come, stay)].max())]

        x, y, z = stance.axes
        assert admit.slides == tuple(max(level(last, other, n, s) for s in (1, -1)) for n in (x, y))
        assert admit.lowers[1] == level(last, other, z, stance.up)
        assert admit.lowers[0] == level(other, last, z, stance.up)
        assert (join.level == CLASHES) == (mating.approach.kind == "blocked")
        assert (join.lowered and join.level < CLASHES) == (mating.approach.kind == "lower")


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
