"""Factories of a given size, from the empty factory on or in steady production."""

from __future__ import annotations

import hashlib
import os
import pickle
import tempfile
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from benches.fidelity.products import EXAMPLES
from factory.engine.record.replay import replay
from factory.engine.record.verdict import RunVerdict
from factory.engine.simulation.mujoco.courses import Course
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import entries_of
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.layout import Layout
from factory.floor.layout.request import Ground
from factory.pipeline import read
from factory.support.settings import MOST, Settings

LAYOUTS = "FACTORY_BENCH_LAYOUTS"
"""The environment's name of a folder in which a bench keeps layouts for all of its processes."""

ENDLESS = 1000
"""Units asked for: more than the pool of parts ever needs, so that it is the whole pool."""

PATIENCE = 8
"""Cycles that production is given to repeat itself."""

DEFAULT = Settings()

SEEN = 3
"""Products that the ideal world makes to tell when production is steady."""


def balanced(parts: int) -> str:
    """A PAG without geometry: a balanced binary tree of mates, 2 parts - 1 robots."""
    level = [f"p{i + 1}" for i in range(parts)]
    lines = [f"{name} = atomic()" for name in level]
    while len(level) > 1:
        pairs = zip(level[::2], level[1::2], strict=False)
        odd = level[len(level) - len(level) % 2 :]
        level = []
        for one, other in pairs:
            name = f"n{len(lines)}"
            lines.append(f"{name} = mate ( {one}, {other} )")
            level.append(name)
        level += odd
    return f"root = {level[0]};\n" + ";\n".join(lines) + "\n"


def cube(parts: int, side: float = 0.3, mass: float = 3.0) -> str:
    """A PAG of boxes that fill a cube of a side [m] and a mass [kg] together: a balanced binary
    tree of mates, whose parts are halves of halves, the axes by turns. `parts`: a power of two."""
    lines: list[str] = []
    _halved(lines, "n", [(0.0, side)] * 3, parts, mass)
    return "root = n;\n" + ";\n".join(lines) + "\n"


def _halved(
    lines: list[str], name: str, room: list[tuple[float, float]], parts: int, mass: float
) -> None:
    if parts == 1:
        box = ", ".join(f"{0.96 * (high - low):.6g}" for low, high in room)
        pos = ", ".join(f"{(low + high) / 2:.6g}" for low, high in room)
        lines.append(f"{name} = atomic ( box = ({box}), pos = ({pos}), mass = {mass:.6g} )")
        return
    lines.append(f"{name} = mate ( {name}a, {name}b )")
    axis = (len(name) - 1) % 3
    low, high = room[axis]
    for letter, half in zip("ab", ((low, (low + high) / 2), ((low + high) / 2, high)), strict=True):
        inside = [half if n == axis else edges for n, edges in enumerate(room)]
        _halved(lines, name + letter, inside, parts // 2, mass / 2)


def robots_at_least(robots: int) -> str:
    """The balanced product with so many robots, or one more."""
    return balanced(robots // 2 + 1)


def laid_out(text: str) -> Layout:
    """A PAG's factory on its floor: laid out once by all processes of a bench."""
    with tempfile.TemporaryDirectory() as folder:
        digest = hashlib.sha256(text.encode()).hexdigest()
        kept = Path(os.environ.get(LAYOUTS, folder)) / f"{digest}.pickle"
        if not kept.is_file():
            file = Path(folder) / "product.pag"
            file.write_text(text)
            kept.write_bytes(pickle.dumps(of_file(file)))
        return cast(Layout, pickle.loads(kept.read_bytes()))


def of_file(file: Path, settings: Settings = DEFAULT) -> Layout:
    """The factory of the PAG in a file on its floor."""
    plan = read(file).plain
    return Ground().lay_out(plan, product_geometry(plan.pag), settings)


@dataclass(frozen=True)
class Case:
    """A factory in MuJoCo that is neither filmed nor logged: so many robots or one more, the
    engine's timestep [s] (None: that of DEFAULT), units let in at once (None: any number), whether
    parts that are joined become one body, how many units it makes from the empty factory (None: it
    is measured in steady production), and the example that it makes (None: a balanced product)."""

    robots: int
    timestep: float | None
    wip: int | None = None
    fuse: bool = False
    units: int | None = None
    example: str | None = None

    def layout(self) -> Layout:
        """Its factory on its floor."""
        if self.example is None:
            return laid_out(robots_at_least(self.robots))
        return of_file(EXAMPLES / f"{self.example}.pag")

    def simulation(self, layout: Layout, shown: bool = False) -> Simulation:
        """A run of it, ready to go; `shown` as in a RunRequest."""
        settings = DEFAULT if self.timestep is None else Settings(timestep=self.timestep)
        units = self.units or ENDLESS
        request = RunRequest(
            units=units, settings=settings, wip=self.wip, fuse=self.fuse, shown=shown
        )
        return Simulation(layout, request)


@dataclass(frozen=True)
class Steady:
    """When production is steady and how long a cycle takes then [s], by the ideal world: from the
    second product on its products come at even times."""

    since: float
    cycle: float

    @classmethod
    def of(cls, layout: Layout, wip: int | None) -> Steady:
        """Asks the ideal world, which takes seconds."""
        simulation = Simulation(layout, RunRequest("ideal", units=ENDLESS, wip=wip))
        while len(simulation.world.dropoffs) < SEEN:
            simulation.supervisor.step()
        times = simulation.world.dropoffs
        return cls(times[-2], times[-1] - times[-2])


def run_in(simulation: Simulation, steady: Steady) -> float:
    """Tick until production repeats itself, or for `PATIENCE` cycles since it is steady; gives the
    time [s]. It repeats itself when a cycle has gone by in which no course was planned."""
    world, planned = simulation.physical, list[float]()
    stepping = world.motion.stepping
    course = stepping.course

    def counted(begin: Hashable, make: Callable[[], Course]) -> Course:
        def made() -> Course:
            planned.append(world.time)
            return make()

        return course(begin, made)

    run_until(simulation, steady.since)
    stepping.course = counted  # type: ignore[method-assign]
    for _ in range(PATIENCE):
        planned.clear()
        run_until(simulation, world.time + steady.cycle)
        if not planned:
            break
    del stepping.course
    return world.time


def run_until(simulation: Simulation, time: float) -> None:
    """Tick until this simulated time [s], as a run does that has no observers."""
    while simulation.world.time < time:
        _step(simulation)


def produce(simulation: Simulation, units: int) -> None:
    """Tick until so many units are delivered, as a run does that has no observers."""
    while simulation.world.delivered() < units:
        _step(simulation)


def judge(simulation: Simulation) -> None:
    """End the program, with what is wrong, where what has been run is no run that succeeds so
    far."""
    world = simulation.physical
    supervisor, factory = simulation.supervisor, simulation.layout.factory
    entries = entries_of(supervisor.events)
    refines = replay(factory.net, entries, simulation.start, factory.joins).refines
    require(RunVerdict.of(None, refines, RunVerdict.kept_figures(world.figures()), None))


def require(verdict: RunVerdict) -> None:
    """End the program, with what is wrong, where a run has not succeeded."""
    if not verdict.succeeded:
        raise SystemExit("\n".join(["a run has not succeeded:", *map(str, verdict.gathered)]))


def _step(simulation: Simulation) -> None:
    """Some ticks. Ends the program where the run stalls, or a hand drops what it holds."""
    simulation.supervisor.step(MOST)
    trouble = simulation.ends()
    if trouble is not None:
        require(RunVerdict.of(trouble, True, None, None))
