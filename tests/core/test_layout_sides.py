"""Inputs of a mate come from the side on which they lie: they never pass through each other."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

import factory.floor.layout.optimising as optimising
from factory.engine.record.state import State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.embedding import lay_out
from factory.floor.layout.layout import Layout
from factory.floor.layout.sides import admissible, admitted
from factory.floor.mating.mating import judged
from tests.pag_texts import PAPER, compiled

BALANCED = """root = r; r = mate(s, t); s = mate(a, b); t = mate(c, d);
a = atomic(); b = atomic(); c = atomic(); d = atomic()"""
STACKED = """root = r; r = mate(a, b); a = atomic(box = (0.05, 0.05, 0.05));
b = atomic(box = (0.05, 0.05, 0.05), pos = (0.02, 0.02, 0.06))"""


def laid_out(text: str) -> Layout:
    factory = compiled(text)
    return lay_out(factory, product_geometry(factory.pag))


def deepest(layout: Layout) -> float:
    """How deep any two parts of one product are in each other at any tick of its making [m]."""
    simulation = Simulation(layout, RunRequest(units=1))
    m, d = simulation.world.m, simulation.world.d
    parts = [m.geom(f"part/{o.label}#1").id for o in layout.factory.leaves]
    line, worst = np.zeros(6), [0.0]

    def observe(_: State) -> None:
        for i, one in enumerate(parts):
            for other in parts[:i]:
                worst.append(-mujoco.mj_geomDistance(m, d, one, other, 0.01, line))

    assert simulation.run([observe]).products == 1
    return max(worst)


@pytest.mark.parametrize("text", [PAPER, BALANCED, STACKED], ids=["paper", "balanced", "stacked"])
def test_parts_of_a_product_do_not_pass_through_each_other(text: str) -> None:
    assert deepest(laid_out(text)) < 1e-4


def test_inputs_from_the_wrong_sides_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: every robot on the other side. The parts run into each other for real."""

    def swapped(factory, sides):
        return {robot: -side for robot, side in admissible(factory, sides).items()}

    monkeypatch.setattr(optimising, "admissible", swapped)
    monkeypatch.setattr(optimising, "admitted", lambda *given: not admitted(*given))
    simulation = Simulation(laid_out(BALANCED), RunRequest(units=1))
    run = simulation.run()
    assert run.trouble is not None and run.trouble.code == "Stalled"
    assert run.physics.mating_force_max_n > 10


def test_sides_are_right_for_any_sides_to_begin_with() -> None:
    factory = judged(compiled(BALANCED), product_geometry(compiled(BALANCED).pag))
    guests = range(1, len(factory.robots))
    for chosen in range(2 ** len(guests)):
        sides = {g: 1 if chosen >> g - 1 & 1 else -1 for g in guests}
        for operation in factory.operations:
            pair = [r for r in operation.robots if r != operation.carrier]
            if len(pair) == 2:
                sides[pair[1]] = -sides[pair[0]]
        found = admissible(factory, sides)
        assert admissible(factory, found) == found
