"""What runs is what is proved: every run over the engine is a run of the coordinated net, which
makes all its passes, and each robot is, in every tick, where its presences say for what is marked.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from factory.apps.runs.watched import watched
from factory.engine.record.state import Event, State
from factory.engine.simulation.mujoco.strokes import NEVER
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.exclusions import awaited_positions, coordinated
from factory.floor.layout.hands.leaving import SPARE
from factory.floor.layout.layout import Layout
from factory.floor.layout.machines import presences
from factory.floor.layout.presence import Presence
from factory.pipeline import read
from tests.slow import slow_but
from tests.whole import test_tees

OFF = SPARE
"""A robot is no further outside its presences: lifts that are to be up, and robots that are to be
at home, count as there a millimetre before [m]."""

AFTERWARDS = 6.0
"""So long after its last unit robots may still be on their ways home [s]."""


class CoordinatedGame:
    """The token game of a layout's coordinated net beside a run. Transitions of the compiled net
    fire as the supervisor says, passes as soon as the engine has an axis beyond their point, those
    of a magazine as its slider comes down with another part. `faults`: what fired without being
    enabled, and where a robot was in none of its presences."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation, layout = simulation, simulation.layout
        self.coordinated = coordinated(layout)
        self.layout, self.net, self.faults = layout, self.coordinated.net, list[str]()
        self.tokens = list(self.net.tokens)
        transitions = enumerate(self.net.net.transitions)
        self.number = {transition.name: number for number, transition in transitions}
        passes = self.coordinated.passes.items()
        self.passes = {self.net.right[place]: past for past, (place, _) in passes}
        self.robots: dict[int, list[Presence]] = {}
        for presence in presences(layout, self.coordinated, awaited_positions(layout)):
            if presence.places and not presence.bears:
                self.robots.setdefault(presence.robot, []).append(presence)
        self.seen, self.shown = 0, dict[str, int]()

    def look(self, state: State) -> None:
        """After a tick."""
        world = self.simulation.physical
        x, _ = world.sense()
        for event in state.events[self.seen :]:
            assert isinstance(event, Event)
            self.fire(self.number[event.transition])
        self.seen = len(state.events)
        self.rise()
        self.pass_on(x)
        shown = world.parts.feeders.shown()
        if self.shown:
            self.show(shown)
        self.shown |= shown
        self.pass_on(x)
        self.locate(x)

    @property
    def unmade(self) -> list[str]:
        """The passes that are still to come."""
        places, passes = self.net.net.places, self.coordinated.passes.values()
        return [places[place].name for place, _ in passes if self.tokens[place]]

    def rise(self) -> None:
        """Fire what sliders do that have come up without a part."""
        operations, feeders = self.layout.factory.operations, self.simulation.physical.parts.feeders
        for served in self.coordinated.served.values():
            number, event = (
                feeders._number[operations[served.before].label],
                self.net.right[served.up],
            )
            rests = feeders._sliders.ends[number] == NEVER and feeders._sliders.is_up(number)
            if rests and self.is_enabled(event):
                self.fire(event)

    def show(self, shown: Mapping[str, int]) -> None:
        """Sliders that have set out with the part for another unit have been up before."""
        for label, unit in shown.items():
            leaf = self.layout.factory.by_label[label].index
            if self.shown.get(label, -1) != unit and leaf in self.coordinated.served:
                served = self.coordinated.served[leaf]
                if self.is_enabled(self.net.right[served.up]):
                    self.fire(self.net.right[served.up])
                self.fire(self.net.right[served.top])

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
        for robot, here in self.robots.items():
            up = self.layout.factory.up(robot)
            at = float(x[robot]), 0.0 if up is None else float(x[up])
            marked = (p for p in here if all(self.tokens[place] > 0 for place in p.places))
            sweeps = (spans for presence in marked for spans in presence.sweeps)
            if not any(all(map(_within, at, spans)) for spans in sweeps):
                self.faults.append(f"{self.layout.factory.robots[robot].name} at {at}")

    def is_enabled(self, event: int) -> bool:
        return not self.lacking(event)

    def lacking(self, event: int) -> list[str]:
        """The places that a transition needs, and that are not marked."""
        places = self.net.net.preset[event]
        return [self.net.net.places[place].name for place in places if self.tokens[place] <= 0]

    def fire(self, event: int) -> bool:
        if names := self.lacking(event):
            self.faults.append(f"{self.net.net.transitions[event].name} without {names}")
        self.net.fire(self.tokens, event)
        return True


def _within(x: float, span: tuple[float, float]) -> bool:
    return min(span) - OFF <= x <= max(span) + OFF


Change = Callable[[Simulation], object]
"""What is done to a run before it begins."""


def played(
    layout: Layout, seed: int, change: Change = lambda run: None, **asked: object
) -> list[str]:
    """What is wrong in a run of three units, each robot with a speed of its own, and until the
    passes after the last unit are made."""
    values = {"units": 3, "seed": seed, "jitter": 0.3, **asked}
    simulation = Simulation(layout, RunRequest(**values))  # type: ignore[arg-type]
    game = CoordinatedGame(simulation)
    change(simulation)
    run = watched(simulation, [game.look], 600.0)
    assert run.trouble is None or game.faults, run.trouble
    assert game.faults or game.seen > 2 * len(layout.factory.operations)
    over = simulation.world.time + AFTERWARDS
    while game.unmade and simulation.world.time < over:
        simulation.supervisor.step()
        game.look(simulation.state())
    return game.faults + [f"{name} is not made" for name in game.unmade]


@pytest.mark.parametrize(
    ("name", "distributed"), slow_but([("paper", True)], [("paper", True), ("stool", False)])
)
def test_examples(name: str, distributed: bool) -> None:
    assert not played(read(f"examples/{name}.pag").layout, 1, distributed=distributed)


def tee() -> Layout:
    """Two branches that come to one place over a stem: each waits for passes of the other."""
    return test_tees.project(2).layout


def test_a_pass_that_nobody_makes_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Robots that are awaited wait where they have delivered."""
    layout = tee()
    monkeypatch.setattr("factory.floor.modes.staging.awaited_positions", lambda layout: {})
    monkeypatch.setattr(Ordering, "hold_up", lambda *_: False)
    faults = played(layout, 1, units=2)
    assert any(fault.endswith("is not made") for fault in faults), faults
