"""Shared floor: order places of the run alone keep robots apart and never deadlock (Theorem 11)."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import replace

import pytest

from factory.theory.nets.exclusion import ORDER, excluding, ordered, times
from factory.theory.nets.marked import MarkedNet, stuck_circuit, token_free
from factory.theory.nets.petri import Place
from tests.state_space import Truth, explored
from tests.street_programs import Streets, stalls, streets

FEW, MANY = 120, 2000
"""Programs that are tried each time, and of the whole campaign."""

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
        assert not token_free(made.net).stuck
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
        if stuck := token_free(net).stuck:
            dead += 1
            circuit = stuck_circuit(net, stuck)
            assert not any(net.tokens[place] for place in circuit)
            ends = zip(circuit, circuit[1:] + circuit[:1], strict=True)
            assert all(net.right[a] == net.left[b] for a, b in ends)
        truth = explored(net, MARKINGS)
        assert truth is None or truth.live == (not stuck)
    return alone, seen, dead, tried


@pytest.mark.slow
def test_two_thousand_programs() -> None:
    alone, seen, dead, tried = try_programs(MANY)
    print(alone, seen, dead, tried)
    assert alone > 0.25 * MANY
    assert seen > 0.2 * MANY
    assert dead > 0.1 * tried
