"""One property of all switches that only make a run faster, or look at it: its trace is the same to
the last bit. Each way of running is tried on products and options that a seed draws."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

from factory.apps.deviations import Deviation, deviate
from factory.apps.fidelity.measuring import Measurement
from factory.apps.log import LogWriter
from factory.apps.monitor import beside
from factory.engine.record.figures import PhysicsFigures
from factory.engine.record.state import Event, State
from factory.engine.simulation import bundles
from factory.engine.simulation.active import Active
from factory.engine.simulation.mujoco import outfeed
from factory.engine.simulation.mujoco.courses import Follower
from factory.engine.simulation.mujoco.fast import neighbours, strides
from factory.engine.simulation.mujoco.parts import Parts
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support import compiling
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.theory.control.navigation import Bundle
from factory.theory.plant.operation import Operation
from tests.examples import with_hands
from tests.good_runs import random_marking
from tests.layout_values import random_layout
from tests.pag_values import SHAPES
from tests.simulation_values import FINE, layout_of, ready, stepping
from tests.slow import slow_but

LONG = 12.0
"""The simulated time [s] after which a trace ends."""


@pytest.fixture(autouse=True)
def _neighbours_in_small_factories_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "FEW", 0)


@dataclass(frozen=True)
class Trace:
    """Positions and speeds by timestep where they were looked at, what fired and when, and the
    figures."""

    states: dict[int, bytes]
    events: tuple[Event, ...]
    dropoffs: tuple[float, ...]
    figures: PhysicsFigures

    def differs(self, other: Trace) -> str:
        """What differs first, "" if nothing does. States count where both were looked at."""
        both = sorted(self.states.keys() & other.states.keys())
        if not both or both[-1] != max(self.states) or both[-1] != max(other.states):
            return "the end"
        for step in both:
            if self.states[step] != other.states[step]:
                return f"the state after step {step}"
        names = ("events", "dropoffs", "figures")
        return next((n for n in names if getattr(self, n) != getattr(other, n)), "")


Run = Callable[[Simulation, Sequence[Any], Sequence[Any]], object]


def plainly(simulation: Simulation, observers: Sequence[Any], glances: Sequence[Any]) -> object:
    """The run itself."""
    return simulation.run(observers, LONG, glances)


def traced(simulation: Simulation, run: Run = plainly, seen: bool = False) -> Trace:
    """The trace of a run, of every tick if it is `seen`."""
    world, states = simulation.physical, dict[int, bytes]()

    def look(_: State) -> None:
        step = round(world.time / world.m.opt.timestep)
        states[step] = world.d.qpos.tobytes() + world.d.qvel.tobytes()

    run(simulation, [look] if seen else [], [look])
    events = tuple(simulation.supervisor.events)
    return Trace(states, events, tuple(world.dropoffs), world.figures())


def one_by_one(m: mujoco.MjModel, d: mujoco.MjData, steps: int) -> None:
    """A call of several steps is taken for one in which contacts came and went, so it goes back."""
    mujoco.mj_step(m, d, steps)
    if steps > 1:
        d.maxuse_con = 1


@contextmanager
def going_back() -> Iterator[None]:
    with stepping(one_by_one):
        yield


@contextmanager
def forgetting() -> Iterator[None]:
    """Courses and bundles are planned anew each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strides, "ROOM", 0)
        patch.setattr(bundles, "KEPT", 3)
        yield


@contextmanager
def handing_over_singly() -> Iterator[None]:
    """What ends in one tick is handed over by one write each."""
    hand_over = Parts.hand_over

    def singly(self: Parts, ended: Sequence[tuple[Operation, int]]) -> None:
        for each in ended:
            hand_over(self, [each])

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Parts, "hand_over", singly)
        yield


@contextmanager
def in_pieces() -> Iterator[None]:
    """The engine reads the model piece by piece."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiling, "MANY", 0)
        patch.setattr(compiling, "PIECE", 100)
        yield


SWITCHES: dict[str, tuple[dict[str, Any], Callable[[], Any]]] = {
    "fast": ({"fast": True}, nullcontext),
    "unseen": ({"shown": False}, nullcontext),
    "in pieces": ({}, in_pieces),
    "going back": ({"fast": True}, going_back),
    "forgetting": ({"fast": True}, forgetting),
    "handing over singly": ({}, handing_over_singly),
}
"""Options of a request, and a context to make the simulation and run it in."""

QUICK = ("fast", "unseen", "in pieces")
ODD = ("going back", "forgetting", "handing over singly")


SETTINGS = (
    FINE,
    replace(FINE, stage=1),
    Settings(timestep=0.01, substeps=1, stage=1),
    Settings(timestep=0.004, substeps=5),
    Settings(timestep=0.001, substeps=12),
    Settings(timestep=0.005, substeps=11),
)
DISTURBANCES = (
    Deviation("gain", factor=0.5),
    Deviation("noise", metres=1e-4),
    Deviation("push", body="r1/carriage", force=(3.0, 3.0, 0.0), at=0.5, seconds=0.2),
)
PRODUCTS = ("paper", "truck", "chest", "lamp", "20", "shelf", "fence", "hands", "random")


@dataclass(frozen=True)
class Case:
    """What is made, in which way, and with which disturbances."""

    layout: Layout
    given: dict[str, Any]
    disturbed: tuple[Any, ...]

    def simulation(self, **more: Any) -> Simulation:
        asked = {"fast": False, "shown": True, **self.given, **more}
        simulation = ready(self.layout, **asked)
        if self.given.get("distributed"):
            return simulation
        return deviate(simulation, *self.disturbed, seed=1)


def drawn(seed: int) -> Case:
    """A case that a seed draws; each product comes with its turn."""
    rng, name = random.Random(seed), PRODUCTS[seed % len(PRODUCTS)]
    if name == "hands":
        layout = with_hands(rng.choice(["truck", "stool", "gearbox"]))
    elif name == "random":
        layout = random_layout(rng.randint(4, 9), seed, rng.choice(SHAPES), "mixed")
    else:
        layout = layout_of(name)
    given: dict[str, Any] = {
        "seed": rng.randrange(100),
        "jitter": rng.choice([0.0, 0.3]),
        "settings": rng.choice(SETTINGS),
        "fuse": rng.random() < 0.4,
        "distributed": rng.random() < 0.25 and len(layout.factory.robots) < 12,
    }
    if not given["distributed"] and rng.random() < 0.25:
        given["start"] = random_marking(layout, seed)
    elif rng.random() < 0.2:
        given["wip"] = 1
    return Case(layout, given, tuple(d for d in DISTURBANCES if rng.random() < 0.15))


def trace(case: Case, switches: Sequence[str], run: Run = plainly, seen: bool = False) -> Trace:
    """The trace of a case with these switches on, all others off."""
    with ExitStack() as stack:
        given = dict[str, Any]()
        for name in switches:
            options, context = SWITCHES[name]
            given |= options
            stack.enter_context(context())
        return traced(case.simulation(**given), run, seen)


def blamed(case: Case, plain: Trace, switches: Sequence[str]) -> dict[str, str]:
    """What differs by each switch alone."""
    return {name: trace(case, [name]).differs(plain) for name in switches}


@pytest.mark.parametrize("seed", slow_but([0, 4], range(60)))
def test_a_trace_is_the_same_however_it_is_run(seed: int, tmp_path: Path) -> None:
    """At full speed; and step by step with a log, a monitor and measurements beside it."""
    case = drawn(seed)

    def watched(simulation: Simulation, observers: Sequence[Any], glances: Sequence[Any]) -> None:
        measured, monitor = Measurement(simulation), beside(simulation)
        with (
            LogWriter(tmp_path / "run.log", simulation, command=["factory"]) as log,
            measured.steps.sampled(),
        ):
            every = [*observers, measured.observe, monitor.observe, log.observe]
            simulation.run(every, LONG, glances)

    plain = trace(case, [], seen=True)
    assert plain.events
    quick, odd = trace(case, QUICK), trace(case, ODD, watched)
    assert not quick.differs(plain), blamed(case, plain, QUICK)
    assert not odd.differs(plain), blamed(case, plain, ODD)
    settings, distributed = case.given["settings"], case.given["distributed"]
    if settings.stride > 1 and not (distributed or case.disturbed):
        assert len(quick.states) < 0.7 * len(plain.states), "one tick a call"


@contextmanager
def replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(owner, name, value)
        yield


class Forgetful:
    """The engine, but what goes back forgets something."""

    def __init__(self, forget: Callable[[mujoco.MjData], None]) -> None:
        self._forget = forget

    def mj_copyData(self, to: Any, m: Any, since: Any) -> None:
        goes_back = to.time > since.time
        mujoco.mj_copyData(to, m, since)
        if goes_back:
            self._forget(to)

    def __getattr__(self, name: str) -> Any:
        return getattr(mujoco, name)


def _warmstart(d: mujoco.MjData) -> None:
    d.qacc_warmstart[:] = 0.0


def _time(d: mujoco.MjData) -> None:
    d.time += 0.002


def _setpoints(d: mujoco.MjData) -> None:
    d.history[len(d.history) // 2 :] *= 1.001


FAULTS: dict[str, tuple[str, Any, str, Any]] = {
    "a pass that comes unseen": ("chest", Follower, "until", lambda self, past: self.left),
    "a tray that comes unseen": ("chest", outfeed, "CLOSE", 0.0),
    "a clock's end that comes unseen": ("paper", Active, "ticks_left", lambda *_: 1),
    "a goal that comes unseen": ("paper", Bundle, "near_goal", lambda *_: False),
    **{
        f"going back forgets {forget.__name__[1:]}": ("paper", strides, "mujoco", Forgetful(forget))
        for forget in (_warmstart, _time, _setpoints)
    },
}


@pytest.mark.parametrize(
    "fault", slow_but(["a goal that comes unseen", "going back forgets setpoints"], FAULTS)
)
def test_a_planted_fault_makes_another_trace(fault: str) -> None:
    name, *what = FAULTS[fault]
    case = Case(layout_of(name), {"fast": True}, ())
    plain = trace(case, [], seen="comes" in fault)
    with replaced(*what):
        if fault.startswith("a goal"):
            with replaced(Follower, "near", property(lambda self: not self.left)):
                assert trace(case, []).differs(plain)
        else:
            assert trace(case, ["going back"] if "back" in fault else []).differs(plain)
