"""What runs is what is proved: every run over the engine is a run of the coordinated net, and each
robot is, in every tick, where its presences say for what is marked."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from factory.layout.coordinating import with_machines
from factory.layout.exclusions import kept
from factory.layout.hands.leaving import SPARE
from factory.layout.layout import Layout
from factory.layout.machines import presences
from factory.layout.presence import Presence
from factory.pipeline import read
from factory.simulation.ordering import Ordering
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.simulation.watched import watched
from factory.study.allocation.aim import Aim
from factory.study.allocation.search import allocated
from factory.support.settings import LEAST
from tests.random_products import random_blocks, random_product

OFF = SPARE
"""A robot is no further outside its presences: lifts that are to be up, and robots that are to be
at home, count as there a millimetre before [m]."""

DAY = int(os.environ.get("TEST_DAY", "261126"))


class CoordinatedGame:
    """The token game of a layout's coordinated net beside a run. Transitions of the compiled net
    fire as the supervisor says, passes as soon as the engine has an axis beyond their point, those
    of a magazine as its slider comes down with another part. `faults`: what fired without being
    enabled, and where a robot was in none of its presences."""

    def __init__(self, layout: Layout) -> None:
        exclusions = kept(layout)
        orders = [order for order in exclusions.orders if order.kept]
        self.coordinated = with_machines(layout, exclusions.passes, orders)
        self.layout, self.net, self.faults = layout, self.coordinated.net, list[str]()
        self.tokens = np.array(self.net.tokens)
        names = [transition.name for transition in self.net.net.transitions]
        self.number = {name: number for number, name in enumerate(names)}
        places = enumerate(zip(self.net.left, self.net.right, strict=True))
        self.inputs: list[list[int]] = [[] for _ in names]
        self.outputs: list[list[int]] = [[] for _ in names]
        for place, (before, after) in places:
            self.outputs[before].append(place)
            self.inputs[after].append(place)
        passes = self.coordinated.passes.items()
        self.passes = {self.net.right[place]: past for past, (place, _) in passes}
        self.robots: dict[int, list[Presence]] = {}
        for presence in presences(layout, self.coordinated, dict(exclusions.backs)):
            if presence.places and not presence.bears:
                self.robots.setdefault(presence.robot, []).append(presence)
        self.seen, self.shown = 0, dict[str, int]()

    def look(self, world: Any, supervisor: Any) -> None:
        """After a tick."""
        x, _ = world.sense()
        for event in supervisor.events[self.seen :]:
            self.fire(self.number[event.transition])
        self.seen = len(supervisor.events)
        self.pass_on(x)
        shown = world.parts.feeders.shown()
        if self.shown:
            self.show(shown)
        self.shown |= shown
        self.pass_on(x)
        self.locate(x)

    def show(self, shown: Mapping[str, int]) -> None:
        """Sliders that have set out with the part for another unit have been up before."""
        for label, unit in shown.items():
            leaf = self.layout.factory.by_label[label].index
            if self.shown.get(label, -1) != unit and leaf in self.coordinated.served:
                served = self.coordinated.served[leaf]
                for event in (self.net.right[served.up], self.net.right[served.top]):
                    if event != self.net.right[served.up] or self.is_enabled(event):
                        self.fire(event)

    def pass_on(self, x: np.ndarray) -> None:
        """Fire the passes that have come."""
        ready = [True]
        while ready:
            ready = [
                self.fire(event)
                for event, past in self.passes.items()
                if self.is_enabled(event) and past.holds(float(x[past.axis]))
            ]

    def locate(self, x: np.ndarray) -> None:
        """Look for each robot in its presences whose places are marked."""
        lifts = self.layout.factory.lift_axis
        for robot, here in self.robots.items():
            at = float(x[robot]), float(x[lifts[robot]]) if robot in lifts else 0.0
            marked = (p for p in here if self.tokens[[*p.places]].all())
            sweeps = (spans for presence in marked for spans in presence.sweeps)
            if not any(all(map(_within, at, spans)) for spans in sweeps):
                self.faults.append(f"{self.layout.factory.robots[robot].name} at {at}")

    def is_enabled(self, event: int) -> bool:
        return bool(self.tokens[self.inputs[event]].all())

    def fire(self, event: int) -> bool:
        lacking = [p for p in self.inputs[event] if not self.tokens[p]]
        names = [self.net.net.places[place].name for place in lacking]
        if names:
            self.faults.append(f"{self.net.net.transitions[event].name} without {names}")
        self.tokens[self.inputs[event]] -= 1
        self.tokens[self.outputs[event]] += 1
        return True


def _within(x: float, span: tuple[float, float]) -> bool:
    return min(span) - OFF <= x <= max(span) + OFF


def played(layout: Layout, seed: int, distributed: bool = False, ordered: bool = True) -> list[str]:
    """What is wrong in a run of three units, each robot with a speed of its own."""
    request = RunRequest(units=3, seed=seed, jitter=0.3, distributed=distributed)
    simulation, game = Simulation(layout, request), CoordinatedGame(layout)
    if not ordered:
        simulation.supervisor.ordering = Ordering()
    watched(simulation, [game.look], 600.0)
    assert game.seen > 2 * len(layout.factory.operations)
    return game.faults


@pytest.mark.parametrize(
    ("name", "distributed"), [("paper", True), ("stool", False), ("gearbox", False)]
)
def test_examples(name: str, distributed: bool) -> None:
    assert not played(read(f"examples/{name}.pag").layout, 1, distributed)


@pytest.mark.parametrize("seed", [1000 * DAY + 500 + number for number in range(5)])
def test_random_products(seed: int, tmp_path: Path) -> None:
    """The last with as few robots as can be."""
    file = tmp_path / "product.pag"
    file.write_text(random_blocks(seed) if seed % 4 == 0 else random_product(seed))
    project = read(file)
    if seed % 1000 == 504:
        project = allocated(project, Aim(LEAST, effort=12))
    assert not played(project.layout, seed)


def test_a_run_that_keeps_no_orders_is_none_of_the_net() -> None:
    faults = played(read("examples/gearbox.pag").layout, 1, ordered=False)
    assert any("without ['order:" in fault for fault in faults), faults


def test_a_lift_that_is_2_mm_low_is_in_no_presence(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = read("examples/stool.pag").layout
    locate, robots = CoordinatedGame.locate, len(layout.guidepaths)

    def lower(game: CoordinatedGame, x: np.ndarray) -> None:
        locate(game, x - 0.002 * (np.arange(len(x)) >= robots))

    monkeypatch.setattr(CoordinatedGame, "locate", lower)
    assert played(layout, 1)
