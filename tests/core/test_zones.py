"""Shared floor: order places of the run alone keep robots apart and never deadlock (Theorem 11)."""

from __future__ import annotations

import random
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import pytest

from factory.theory.nets.exclusion import ORDER, excluding, ordered, times
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import PetriNet, Place, Transition
from tests.slow import slow_but
from tests.state_space import Truth, explored

Cell = tuple[int, int]

GRIDS = ((3, 5), (4, 4), (2, 7), (1, 9))


@dataclass(frozen=True)
class Streets:
    """A program: its net without order places, the transitions in the order of the run alone, and
    for each place the cell of its robot, and the robot."""

    net: MarkedNet
    alone: tuple[int, ...]
    cells: tuple[Cell, ...]
    robots: tuple[int, ...]

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The places of different robots in one cell."""
        places = range(len(self.cells))
        return [
            (p, q)
            for p, q in combinations(places, 2)
            if self.cells[p] == self.cells[q] and self.robots[p] != self.robots[q]
        ]


def streets(rng: random.Random, most: int = 6) -> Streets | None:
    """A random program of 2 to `most` robots; None where it cannot be run alone."""
    n, m = rng.choice(GRIDS)
    count = rng.randint(2, min(most, n * m // 3))
    cells = [(i, j) for i in range(n) for j in range(m)]
    homes = rng.sample(cells, count)
    goals = []
    for _ in range(rng.randint(count, 2 * count)):
        robots = rng.sample(range(count), rng.choice((1, 1, 2)))
        goals.append([*zip(robots, rng.sample(cells, len(robots)), strict=True)])
    goals += [[(robot, home)] for robot, home in enumerate(homes)]
    at, alone, gears = [*homes], 0, [[] for _ in range(count)]  # type: ignore[var-annotated]
    for goal in goals:
        for robot, end in goal:
            others = {at[other] for other in range(count) if other != robot}
            way = _way((n, m), at[robot], end, others)
            if way is None:
                return None
            for cell in way:
                gears[robot].append((alone, cell))
                alone += 1
            at[robot] = end
        for robot, _ in goal:
            gears[robot].append((alone, at[robot]))
        alone += 1
    if min(map(len, gears)) < 2:
        return None  # a robot that goes nowhere
    places, tokens, where, whose = list[Place](), list[int](), list[Cell](), list[int]()
    for robot, gear in enumerate(gears):
        for number, (event, cell) in enumerate(gear):
            then = gear[(number + 1) % len(gear)][0]
            places.append(Place(f"r{robot + 1}:{number}", (event,), (then,)))
            tokens.append(int(number == len(gear) - 1))
            where.append(cell)
            whose.append(robot)
    net = PetriNet(tuple(Transition(f"t{n}") for n in range(alone)), tuple(places))
    return Streets(MarkedNet(net, tuple(tokens)), (*range(alone),), (*where,), (*whose,))


def _way(grid: Cell, start: Cell, end: Cell, blocked: set[Cell]) -> list[Cell] | None:
    """The cells of a shortest way after the first one."""
    before: dict[Cell, Cell | None] = {start: None}
    todo = deque([start])
    while todo:
        x, y = cell = todo.popleft()
        for there in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            inside = 0 <= there[0] < grid[0] and 0 <= there[1] < grid[1]
            if inside and there not in before and there not in blocked:
                before[there] = cell
                todo.append(there)
    if end not in before:
        return None
    way, cell_ = list[Cell](), end
    while (earlier := before[cell_]) is not None:
        way.append(cell_)
        cell_ = earlier
    return way[::-1]


def stalls(program: Streets, net: MarkedNet, rng: random.Random, rounds: int = 4) -> bool:
    """Whether robots that move as they like, one at a time into cells that are free, come to a
    standstill within so many rounds of a net of the program."""
    tokens = [*net.tokens]
    for _ in range(rounds * len(net.net.transitions)):
        here = {program.cells[p]: program.robots[p] for p in range(len(program.cells)) if tokens[p]}
        ready = [e for e in program.alone if _may(program, net, tokens, here, e)]
        if not ready:
            return True
        net.fire(tokens, rng.choice(ready))
    return False


def _may(
    program: Streets, net: MarkedNet, tokens: list[int], here: dict[Cell, int], event: int
) -> bool:
    stays = [p for p in net.net.postset[event] if p < len(program.cells)]
    free = all(here.get(program.cells[p], program.robots[p]) == program.robots[p] for p in stays)
    return free and all(tokens[p] for p in net.net.preset[event])


MARKINGS = 2000
"""Nets with more markings are played, not explored."""


def programs(count: int, seed: int = 1) -> Iterator[tuple[random.Random, Streets]]:
    """Random programs that can be run alone."""
    rng, made = random.Random(seed), 0
    while made < count:
        program = streets(rng)
        if program is not None and program.pairs:
            made += 1
            yield rng, program


def swapped(program: Streets, pair: tuple[int, int]) -> MarkedNet:
    """The net of a program in which all visits are in the order of the run alone, but those of one
    pair, which come in the other."""
    net = program.net
    when = times(net, program.alone)
    places, tokens = [*net.net.places], [*net.tokens]
    for p, q in program.pairs:
        for one, other in ((p, q), (q, p)):
            before, after = net.right[one], net.left[other]
            late = when[before] > when[after]
            places.append(Place(f"{ORDER}:{one}:{other}", (before,), (after,), ORDER, size=0))
            tokens.append(int(late != ((p, q) == pair)))
    return MarkedNet(replace(net.net, places=(*places,)), (*tokens,))


def meet(program: Streets, truth: Truth) -> bool:
    """Whether some marking has two robots in one cell."""
    return any(marking[p] and marking[q] for marking in truth.markings for p, q in program.pairs)


def try_programs(count: int) -> tuple[int, int, int, int]:
    """How many programs stall with free cells alone; how many nets were explored; how many of the
    swapped ones are dead, and of how many."""
    alone = seen = dead = tried = 0
    for rng, program in programs(count):
        made = ordered(program.net, program.alone, program.pairs)
        assert {*made.places} == {*program.pairs}, "the run alone never has two robots in one cell"
        assert not made.net.token_free.stuck
        for (p, q), circuit in zip(program.pairs, excluding(made.net, program.pairs), strict=True):
            assert circuit is not None
            assert {p, q} <= {*circuit}
        truth = explored(made.net, MARKINGS)
        if truth is not None:
            seen += 1
            assert truth.behaviour == (True, True, True)
            assert not meet(program, truth)
        assert not stalls(program, made.net, rng)
        alone += stalls(program, program.net, rng)
        net = swapped(program, rng.choice(program.pairs))
        tried += 1
        if stuck := net.token_free.stuck:
            dead += 1
            circuit = net.stuck_circuit(stuck)
            assert not any(net.tokens[place] for place in circuit)
            ends = zip(circuit, circuit[1:] + circuit[:1], strict=True)
            assert all(net.right[a] == net.left[b] for a, b in ends)
        truth = explored(net, MARKINGS)
        assert truth is None or truth.live == (not stuck)
    return alone, seen, dead, tried


@pytest.mark.parametrize("count", slow_but([60], [60, 2000]))
def test_the_certificate_of_shared_floor_agrees_with_all_its_markings(count: int) -> None:
    alone, seen, dead, tried = try_programs(count)
    assert alone > 0.25 * count, "without order places many stall, so the test could fail"
    assert seen > 0.2 * count
    assert dead > 0.1 * tried
