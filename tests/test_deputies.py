"""Deputies: who could take over for a robot that dies, and the exchange when it does."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterable
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import pytest
from hypothesis import assume, given, reject, settings
from hypothesis import strategies as st

from factory.compiler import taking_over
from factory.compiler.assigning import shared
from factory.compiler.deputies import MOST, Siblings, deputies
from factory.compiler.folding import Line, fold
from factory.compiler.taking_over import Takeover
from factory.nets.marked import marked
from factory.nets.petri import Marking
from factory.nets.replay import replay
from factory.nets.undo import marking_after
from factory.nets.undone import Entry
from factory.nets.verify import verify
from factory.pipeline import read
from factory.plant.approaches import Approach
from factory.plant.factory import Factory
from factory.problem.pag import NOPART
from factory.problem.robot_types import load_catalogue
from factory.support.errors import InputError, RunError
from tests.command_line import ROOT, Terminal
from tests.fold_values import (
    branched,
    inserted,
    lines_of_one_side,
    plain,
    robot_of,
    swapped,
    table_of,
    with_sides,
)
from tests.net_values import fair_run
from tests.pag_values import SHAPES, catalogue, paper, random_pag
from tests.test_undo import check_reached, fired_by, held

seeds = st.integers(0, 10**6)
randoms = st.randoms(use_true_random=False)

SLOW = (
    ("sub4", "insert", ("part4", "sub3")),
    ("sub3", "insert", ("sub2", "part3")),
    ("sub2", "weld", ("sub1",)),
    ("sub1", "insert", ("part1", "part2")),
    *((f"part{n}", "atomic", ()) for n in (1, 2, 3, 4)),
)
"""A slow branch, which is inserted; `part2` and `part3` come to one robot of it."""


def slow(*branches: tuple[str, int]) -> Factory:
    return branched(plain(table_of(SLOW)), *branches)


def made(seed: int, rng: random.Random, size: int = 14) -> tuple[Factory, list[Line], Factory]:
    """A random factory with sides, lines, and the fold that they make."""
    pag = random_pag(rng.randint(3, size), seed, rng.choice(SHAPES), rng.randint(2, 5))
    base = with_sides(plain(inserted(pag, rng.choice((0.5, 1.0)), seed)), rng)
    lines = lines_of_one_side(base, catalogue(), rng)
    try:
        return base, lines, shared(base, fold(base, lines, catalogue()), catalogue())
    except InputError:
        reject()


def named(factory: Factory, rows: Iterable[Iterable[int]]) -> dict[str, list[str]]:
    """Deputies by what robots deliver, those alone that have some."""
    brought = [" ".join(factory.deliveries(robot.index)) for robot in factory.robots]
    return {brought[dead]: [brought[r] for r in row] for dead, row in enumerate(rows) if row}


# --- who is one -----------------------------------------------------------------------------------


def test_the_paper() -> None:
    """As it is written all robots differ; with inserts two parts come to one robot."""
    mates, inserts = plain(paper()), plain(inserted(paper()))
    assert named(mates, deputies(mates, catalogue())) == {}
    found = named(inserts, deputies(inserts, catalogue()))
    assert found == {"part2": ["part3"], "part3": ["part2"]}


@given(seeds, randoms)
def test_they_are_the_folds(seed: int, rng: random.Random) -> None:
    """A robot to which none delivers has the deputies with which it could be folded: no others, and
    all."""
    base, _, folded = made(seed, rng)
    found = deputies(folded, catalogue())
    tours = tours_of(base, folded)
    for dead, deputy in permutations(range(1, len(folded.robots)), 2):
        kids = [r for r in folded.robots[1:] if folded.last(r.index).carrier == dead]
        admitted = not kids and folds(base, tours, dead, deputy)
        assert (deputy in found[dead]) == admitted


def tours_of(base: Factory, folded: Factory) -> list[Line]:
    """For each robot of a fold the robots of the factory before that it stands for."""
    found: list[list[int]] = [[] for _ in folded.robots]
    for robot in base.robots:
        last = base.last(robot.index)
        there = folded.operations[last.index].robots[last.robots.index(robot.index)]
        found[there].append(robot.index)
    return [tuple(line) for line in found]


def folds(base: Factory, lines: list[Line], dead: int, deputy: int) -> bool:
    """Whether two lines could be one line of a fold."""
    both = tuple(sorted(lines[dead] + lines[deputy]))
    rest = [line for number, line in enumerate(lines) if number not in (dead, deputy)]
    try:
        fold(base, [*rest, both], catalogue())
    except InputError:
        return False
    return True


@settings(max_examples=40)
@given(seeds, randoms)
def test_every_one_gives_a_live_net(seed: int, rng: random.Random) -> None:
    """One order was the witness of all; each net is proved by itself. Robots keep their names."""
    _, _, folded = made(seed, rng, 20)
    rows = deputies(folded, catalogue())
    pairs = [(dead, deputy) for dead, row in enumerate(rows) for deputy in row]
    assume(pairs)
    for dead, deputy in rng.sample(pairs, min(4, len(pairs))):
        after = Takeover(folded, dead, deputy).after
        verdict = verify(after.net)
        assert verdict.holds and verdict.gear_train and after.order
        gone = {robot.name for robot in folded.robots} - {robot.name for robot in after.robots}
        assert gone == {folded.robots[dead].name}
        for robot in after.robots:
            assert robot.index == after.robots.index(robot)
            works = {o.index for o in after.operations if robot.index in o.robots}
            assert works == {*robot.operations}


@given(seeds, randoms)
def test_the_witness(seed: int, rng: random.Random) -> None:
    """Every program ascends in the postorder, in which inputs come before what is made of them; one
    of two tours exchanged does not."""
    _, _, folded = made(seed, rng, 20)
    siblings, when = Siblings(folded, catalogue()), folded.postorder
    assert sorted(when) == [*range(len(folded.operations))]
    for o in folded.operations:
        assert all(when[folded.by_label[label].index] < when[o.index] for label in o.inputs)
    for robot in folded.robots:
        assert siblings.ascends(robot.operations)
        tours = folded.tours[robot.index]
        assert len(tours) < 2 or not siblings.ascends((*tours[1], *tours[0]))


def test_many_leaves_are_listed_in_part() -> None:
    labels = tuple(f"part{n}" for n in range(40))
    parts = ((label, "atomic", ()) for label in labels)
    factory = plain(table_of((("sub1", "insert", labels), *parts)))
    found = deputies(factory, catalogue())
    assert Counter(map(len, found)) == {0: 1, MOST: 39}


# --- who is none ----------------------------------------------------------------------------------


def test_its_kids_cannot_reach_another_carrier() -> None:
    """So a robot to which some deliver is a deputy, and has none."""
    table = (
        ("sub3", "insert", ("part1", "sub2", "part4")),
        ("sub2", "insert", ("part2", "part3")),
        *((f"part{n}", "atomic", ()) for n in (1, 2, 3, 4)),
    )
    factory = plain(table_of(table))
    assert named(factory, deputies(factory, catalogue())) == {"part4": ["sub2"]}


def test_they_come_from_one_side() -> None:
    inserts = plain(inserted(paper()))
    part2, part3 = robot_of(inserts, "part2"), robot_of(inserts, "part3")
    sides = {inserts.by_label["sub1"].index: (-1,), inserts.by_label["sub3"].index: (+1,)}
    operations = tuple(
        replace(o, approach=Approach("slide", 0, sides[o.index])) if o.index in sides else o
        for o in inserts.operations
    )
    assert deputies(inserts, catalogue())[part2] == (part3,)
    assert deputies(replace(inserts, operations=operations), catalogue())[part2] == ()


def test_a_robot_keeps_its_type() -> None:
    """One with a lift can stand in for one without, not the other way round."""
    inserts = plain(inserted(paper()))
    part2, part3 = robot_of(inserts, "part2"), robot_of(inserts, "part3")
    lift = load_catalogue()["lift"]
    robots = (replace(r, kind=lift) if r.index == part2 else r for r in inserts.robots)
    rows = deputies(replace(inserts, robots=tuple(robots)), load_catalogue())
    assert (rows[part2], rows[part3]) == ((), (part2,))


def test_a_branch_is_not_taken_over_by_its_twin() -> None:
    """What delivers to its top cannot reach the twin: only the leaves beside each other count."""
    factory = slow(("sub3", 3))
    found = named(factory, deputies(factory, catalogue()))
    units = ("", "@2", "@3")
    pairs = [(f"part2{unit}", f"part3{unit}") for unit in units]
    assert found == {one: [other] for pair in pairs for one, other in (pair, pair[::-1])}
    part2, part3 = (robot_of(factory, label) for label in ("part2", "part3"))
    check_exchange(factory, part2, part3, random.Random(1))


# --- the exchange ---------------------------------------------------------------------------------


def has(factory: Factory, marking: Marking) -> dict[str, str]:
    """What each robot has, by its name."""
    found = held(factory, marking)
    return {robot.name: found[robot.index] for robot in factory.robots}


def wanted(takeover: Takeover, fired: tuple[int, ...], after: tuple[int, ...]) -> list[str]:
    """What robots would have to hold after the exchange that they did not hold before it."""
    had = has(takeover.before, marking_after(takeover.before.net, fired))
    now = has(takeover.after, marking_after(takeover.after.net, after))
    return [label for robot, label in now.items() if label not in (NOPART, had[robot])]


def check_exchange(factory: Factory, dead: int, deputy: int, rng: random.Random) -> None:
    """The net that follows is live, its counts are reached in it, no robot is asked for what it has
    not, and the record replays to the end of the run."""
    takeover = Takeover(factory, dead, deputy)
    steps = rng.randint(0, 6 * len(factory.operations))
    names = [t.name for t in factory.net.threaded.transitions]
    record = fair_run(factory.net, factory.net.initial_marking, steps, rng)
    fired = tuple(record.count(event) for event in range(len(names)))
    after, undone = takeover.exchanged(fired, 2.5)
    assert verify(takeover.after.net).holds
    check_reached(marked(takeover.after.net), after)
    assert wanted(takeover, fired, after) == []
    begun = marking_after(takeover.after.net, after)
    onward = fair_run(takeover.after.net, begun, 20, rng)
    entries: list[Entry] = [*(names[e] for e in record), undone, *(names[e] for e in onward)]
    found = replay(factory.net, entries, None, factory.joins, (takeover.after.net,))
    assert (found.refines, found.reason) == (True, "")
    counts = [count + onward.count(event) for event, count in enumerate(after)]
    assert found.marking == marking_after(takeover.after.net, counts)


@settings(max_examples=40)
@given(seeds, randoms)
def test_exchanges_of_folds(seed: int, rng: random.Random) -> None:
    _, _, folded = made(seed, rng)
    rows = deputies(folded, catalogue())
    pairs = [(dead, deputy) for dead, row in enumerate(rows) for deputy in row]
    assume(pairs)
    check_exchange(folded, *rng.choice(pairs), rng)


@pytest.mark.parametrize("name", ["truck", "chest"])
def test_exchanges_of_products(name: str) -> None:
    project = read(ROOT / "examples" / f"{name}.pag")
    rows, rng = deputies(project.factory, project.catalogue), random.Random(name)
    for dead, row in enumerate(rows):
        for deputy in row[:1]:
            check_exchange(project.factory, dead, deputy, rng)


def test_what_is_gone_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without that, deputies would be asked for what the dead robot held."""

    def asked() -> int:
        count, rng = 0, random.Random(4)
        for seed in range(60):
            base = plain(inserted(random_pag(8, seed, "any", 3)))
            folded = shared(base, fold(base, (), catalogue()), catalogue()) if seed % 2 else base
            rows = deputies(folded, catalogue())
            for dead, row in enumerate(rows):
                for deputy in row[:1]:
                    takeover = Takeover(folded, dead, deputy)
                    fired = fired_by(folded, 25, rng)
                    count += len(wanted(takeover, fired, takeover.exchanged(fired, 0.0)[0]))
        return count

    assert asked() == 0
    monkeypatch.setattr(taking_over, "lost", lambda *_: ())
    assert asked() > 0


def test_the_record() -> None:
    """part2 is brought when its robot dies; the other fetches one more."""
    factory = plain(inserted(paper()))
    part2, part3 = (robot_of(factory, label) for label in ("part2", "part3"))
    takeover = Takeover(factory, part2, part3)
    fired = [0] * len(factory.net.threaded.transitions)
    for label in ("part2", "part3"):
        o = factory.by_label[label]
        fired[o.start] = fired[o.end] = 1
    after, undone = takeover.exchanged(fired, 2.5)
    assert set(after) == {0}, "part3 is put away, since part2 is asked for first"
    one, other = (factory.robots[robot].name for robot in (part2, part3))
    assert undone.as_json() == {
        "t": 2.5,
        "undone": ["part2_s", "part2_e", "part3_s", "part3_e"],
        "asked": ["part2_e"],
        "operation": "sub1",
        "reason": f"{one} is dead, and {other} takes its tours",
        "exchanged": True,
        "robots": [one, other],
    }


def test_a_wrong_order_is_refused_with_its_circuit() -> None:
    factory = plain(inserted(paper()))
    part2, part3 = (robot_of(factory, label) for label in ("part2", "part3"))
    right = Takeover(factory, part2, part3)
    deputy = next(r for r in right.after.robots if len(right.after.tours[r.index]) > 1)
    wrong = Takeover(factory, part2, part3)
    vars(wrong)["after"] = replace(right.after, net=swapped(right.after, deputy.index, 0, 1))
    nothing = [0] * len(factory.net.threaded.transitions)
    assert set(right.exchanged(nothing, 0.0)[0]) == {0}
    with pytest.raises(RunError) as caught:
        wrong.exchanged(nothing, 0.0)
    words = "\n".join(d.message for d in caught.value.diagnostics)
    assert {d.code for d in caught.value.diagnostics} == {"NotProved"}
    assert "circuit through" in words and "carries no token" in words
    order = deputy.operations[2:] + deputy.operations[:2]
    robots = (replace(r, operations=order) if r is deputy else r for r in right.after.robots)
    with pytest.raises(ValueError, match="do not ascend in the postorder"):
        deputies(replace(right.after, robots=tuple(robots)), catalogue())


# --- the command ----------------------------------------------------------------------------------


def test_check_of_branches(run: Terminal, tmp_path: Path) -> None:
    """The parts of both branches count, whether or not they have shapes."""
    text = "root = c; c = insert(p, b); b = insert(w, s); w = weld(a); a = insert(q, r);"
    file = tmp_path / "slow.pag"
    file.write_text(text + " ".join(f"{x} = atomic();" for x in "pqrs"))
    done = run("check", file, "--parallel", "b=2", "--json")
    assert done.status == 0, done.err
    found = done.json["deputies"]
    assert len(found) == 9
    assert len([robot for robot, row in found.items() if row]) == 4
