"""Factories, runs and states for the tests of simulations."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

from benches.speed.factories import balanced
from benches.speed.factories import laid_out as floor_of
from factory.apps.few_robots.parallel import in_parallel
from factory.engine.simulation.mujoco.stepping import SingleSteps
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from factory.support.settings import Settings
from factory.theory.lang import read_pag
from factory.theory.lang.template_reader import all_templates
from tests.examples import without_hands
from tests.paths import ROOT

FENCE = (ROOT / "tests" / "baselines" / "fence.pag").read_text("utf-8")
"""A small product with lifts."""

BAR = """root = cell; cell = place ( base, bar );
base = atomic ( box = (0.24, 0.24, 0.02), pos = (0, 0, 0.01) );
bar = atomic ( box = (0.2, 0.02, 0.03), pos = (0, 0, 0.0351), fed = 1.2 )"""
"""A long part that a manipulator turns."""


@cache
def laid_out_with_lifts(text: str) -> Layout:
    """The factory of a PAG's text on its floor, with lifts for what must be lowered."""
    templates = all_templates()
    return Project(read_pag(text, templates), templates).layout


@cache
def layout_of(name: str) -> Layout:
    """The factory of an example, of a balanced product of so many parts, of the fence, of the bar,
    or of the paper with a tee, on its floor."""
    if name.isdigit():
        return floor_of(balanced(int(name)))
    if name == "fence":
        return laid_out_with_lifts(FENCE)
    if name == "bar":
        return laid_out_with_lifts(BAR)
    if name == "tee":
        paper = read(ROOT / "examples" / "paper.pag")
        return paper.with_plan(in_parallel(paper.planned, [("part3", 2)])).layout
    return without_hands(name)


FINE = Settings(timestep=0.002, substeps=5)
"""Five timesteps a tick, whatever a factory would choose."""


def ready(made: str | Layout, **given: Any) -> Simulation:
    """A run of two units in MuJoCo, whose robots differ, ready to go: of a layout, or of a factory
    by its name."""
    asked: dict[str, Any] = {"units": 2, "seed": 3, "jitter": 0.3, "settings": FINE, **given}
    return Simulation(layout_of(made) if isinstance(made, str) else made, RunRequest(**asked))


def state(simulation: Simulation) -> bytes:
    """Where everything is and how fast, to the last bit, and how many contacts there have been."""
    world = simulation.physical
    d, seen = world.d, len(world.inspection.unintended)
    return d.qpos.tobytes() + d.qvel.tobytes() + bytes([d.ncon % 256, seen % 256])


@contextmanager
def stepping(step: Callable[..., object]) -> Iterator[None]:
    """The engine is stepped by this function (m, d, steps) meanwhile."""
    own = SingleSteps.step

    def instead(self: SingleSteps, steps: int) -> None:
        step(self.m, self.d, steps)

    SingleSteps.step = instead  # type: ignore[method-assign]
    try:
        yield
    finally:
        SingleSteps.step = own  # type: ignore[method-assign]


def reproduced(units: int = 2) -> Simulation:
    """A run that is made more than once, here or in another process."""
    return ready("paper", units=units, seed=5)


def digest(simulation: Simulation, observers: Sequence[Any] = ()) -> str:
    """Of the model, all events and the engine's last state, to the bit."""
    run = simulation.run(observers)
    assert run.refines_net and simulation.model is not None
    found = hashlib.sha256(simulation.model.xml.encode())
    found.update(repr([(e.t.hex(), e.transition) for e in run.events]).encode())
    d = simulation.physical.d
    for state in (d.qpos, d.qvel, d.qacc):
        found.update(state.tobytes())
    return found.hexdigest()
