"""Disturbances: what a factory survives, and what it costs.

A run survives when all its units are made, the replay refines the net, nothing touches that should
not, and no vertex of a product is farther than `ERROR_MM` from its place when it is dropped off.
The largest survived magnitude of a kind is found on a grid, by doubling and bisection: every seed
(each with speeds and gains of its own, jitter 0.3) survives it, and one fails the next point."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benches.fidelity.products import SMALL, layout, over_cores
from benches.tables import table
from factory.apps.deviations import Deviation, deviate
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.support.settings import Settings

ERROR_MM = 0.5
"""The largest product error [mm] of a good product."""

UNITS = 2
"""Products made in a run."""

SETTINGS = Settings(timestep=0.002)
"""Noise and delay act in every timestep: they mean something for one that is known."""

SEEDS = 2
JITTER = 0.3

PUSH = 0.1
"""How long a push lasts [s]."""

BETWEEN = 0.5
"""From one push to the next [s]."""

Make = Callable[[Simulation, float, int], Sequence[Deviation]]
"""The deviations of a simulation at a magnitude; the seed chooses bodies, or is a robot."""


def factor_of(kind: str, inverse: bool = False) -> Make:
    """Makes a deviation of a kind that has a factor: a magnitude, or the inverse of one."""
    return lambda _, times, seed: [Deviation(kind, factor=1 / times if inverse else times)]


def robot_by(kind: str) -> Make:
    """Makes a deviation of a kind of one robot: its factor is the inverse of a magnitude."""
    return lambda s, times, robot: [Deviation(kind, robot=_robots(s)[robot], factor=1 / times)]


@dataclass(frozen=True)
class Kind:
    """A kind of disturbance: what a magnitude means, the magnitudes to try, in rising order of
    harm, and how to make it. `each`: one trial for each robot instead of one for each seed."""

    name: str
    unit: str
    grid: tuple[float, ...]
    make: Make
    each: bool = False


@dataclass(frozen=True)
class Trial:
    """One run: "" or why it was not survived, products made, time [s], gap and error [mm]."""

    failure: str
    products: int
    seconds: float
    gap_mm: float
    error_mm: float | None


def geometric(first: float, last: float, ratio: float = 2**0.5) -> tuple[float, ...]:
    """A grid of magnitudes from first to last, each `ratio` times the one before."""
    count = round(np.log(last / first) / np.log(ratio))
    return tuple(float(first * ratio**n) for n in range(count + 1))


def pushes(bodies: Sequence[str], newtons: float, seed: int, until: float) -> list[Deviation]:
    """A push every BETWEEN seconds on a body drawn at random, along x and y at once with random
    signs, so that it acts along any guidepath."""
    draw = np.random.default_rng(seed)
    found = []
    for at in np.arange(BETWEEN, until, BETWEEN):
        x, y = newtons * draw.choice([-1.0, 1.0], size=2)
        body = bodies[draw.integers(len(bodies))]
        force, start = (float(x), float(y), 0.0), float(at + draw.uniform(0, 0.2))
        found.append(Deviation("push", body=body, force=force, at=start, seconds=PUSH))
    return found


def _robots(simulation: Simulation) -> list[str]:
    return [robot.name for robot in simulation.layout.factory.robots]


def _push_robots(simulation: Simulation, newtons: float, seed: int) -> Sequence[Deviation]:
    bodies = [f"{robot}/carriage" for robot in _robots(simulation)]
    return pushes(bodies, newtons, seed, 60.0)


def _push_parts(simulation: Simulation, newtons: float, seed: int) -> Sequence[Deviation]:
    m = simulation.world.m
    bodies = [name for n in range(m.nbody) if (name := m.body(n).name).startswith("part/")]
    return pushes(bodies, newtons, seed, 60.0)


KINDS = (
    Kind("pushes on robots", "N for 0.1 s", geometric(1, 512), _push_robots),
    Kind("pushes on parts", "N for 0.1 s", geometric(1, 512), _push_parts),
    Kind("heavier parts", "times", geometric(1, 32)[1:], factor_of("mass")),
    Kind("lighter parts", "times", geometric(1, 128)[1:], factor_of("mass", inverse=True)),
    Kind("stronger drives", "times", geometric(1, 16)[1:], factor_of("gain")),
    Kind("weaker drives", "times", geometric(1, 32)[1:], factor_of("gain", inverse=True)),
    Kind(
        "dry friction",
        "N",
        geometric(0.25, 64),
        lambda s, newtons, seed: [Deviation("friction", newtons=newtons)],
    ),
    Kind(
        "noise of position",
        "mm",
        geometric(0.0125, 3.2),
        lambda s, mm, seed: [Deviation("noise", metres=mm / 1e3)],
    ),
    Kind(
        "noise of speed",
        "mm/s",
        geometric(1, 256),
        lambda s, mm, seed: [Deviation("noise", speed=mm / 1e3)],
    ),
    Kind(
        "delay",
        "ms",
        tuple(2.0 * n for n in range(1, 26)),
        lambda s, ms, seed: [Deviation("delay", seconds=ms / 1e3)],
    ),
    Kind("a robot slowed", "times", geometric(2, 64), robot_by("slow"), True),
    Kind("a robot held back", "times", geometric(2, 64), robot_by("drag"), True),
)

REQUIRED: tuple[tuple[str, float], ...] = (
    ("heavier parts", 1.5),
    ("lighter parts", 2.0),
    ("stronger drives", 1.3),
    ("weaker drives", 1 / 0.7),
    ("a robot slowed", 10.0),
    ("a robot held back", 10.0),
)
"""What must be survived: parts of 1.5 and 0.5 times their mass, drives of 1.3 and 0.7 times their
force, a robot at a tenth of its speed."""


def judge(run: Run) -> str:
    """Why a run was not survived, or ""."""
    physics = run.physics
    assert physics is not None
    error = physics.product_error_max_mm
    if run.trouble is not None:
        return run.trouble.code.lower()
    if run.products < run.units:
        return f"{run.products} of {run.units} products"
    if not run.refines_net:
        return "does not refine the net"
    if physics.unintended_contacts:
        return f"contact: {physics.contacts[0]}"
    if error is None or error > ERROR_MM:
        return f"product error {error} mm"
    return ""


def trial(plan: Layout, make: Make | None, magnitude: float, seed: int, each: bool) -> Trial:
    """One run; `seed` is a robot's number where there is a trial for each."""
    seed_of_run = 0 if each else seed
    request = RunRequest(units=UNITS, seed=seed_of_run, jitter=JITTER, settings=SETTINGS)
    simulation = Simulation(plan, request)
    deviate(simulation, *(make(simulation, magnitude, seed) if make else ()), seed=seed)
    run = simulation.run()
    assert run.physics is not None
    return Trial(
        judge(run),
        run.products,
        run.sim_time_s,
        run.physics.handoff_gap_max_mm,
        run.physics.product_error_max_mm,
    )


def trials(plan: Layout, kind: Kind, magnitude: float, seeds: Iterable[int]) -> list[Trial]:
    """A kind at a magnitude, for all seeds; up to the first that is not survived."""
    found = []
    for seed in seeds:
        found.append(trial(plan, kind.make, magnitude, seed, kind.each))
        if found[-1].failure:
            break
    return found


def largest(survives: Callable[[float], bool], grid: Sequence[float]) -> int:
    """The number of the last point of a grid that is survived, -1 for none: by doubling and
    bisection, so if harm does not grow with magnitude, there may be a worse point below."""
    low, high, step = -1, 0, 1
    while high < len(grid) and survives(grid[high]):
        low, high, step = high, min(high + step, len(grid)), 2 * step
        if low == len(grid) - 1:
            return low
        high = min(high, len(grid) - 1)
    while high - low > 1:
        middle = (low + high) // 2
        if survives(grid[middle]):
            low = middle
        else:
            high = middle
    return low


def search(plan: Layout, kind: Kind, seeds: Sequence[int], bases: Sequence[Trial]) -> dict:
    """The largest survived magnitude of a kind, what it costs, and what ended the next."""
    seen: dict[float, list[Trial]] = {}

    def survives(magnitude: float) -> bool:
        seen[magnitude] = trials(plan, kind, magnitude, seeds)
        return not any(t.failure for t in seen[magnitude])

    found = largest(survives, kind.grid)
    worst = kind.grid[found] if found >= 0 else None
    beyond = kind.grid[found + 1] if found + 1 < len(kind.grid) else None
    failed = next((t.failure for t in seen.get(beyond or 0.0, []) if t.failure), None)
    return {
        "kind": kind.name,
        "unit": kind.unit,
        "survived": worst,
        "next": beyond,
        "failure": failed,
        **cost(seen[worst] if worst is not None else [], bases),
    }


def cost(found: Sequence[Trial], bases: Sequence[Trial]) -> dict:
    """Products made, and against the undisturbed runs the most time lost; largest gap and error."""
    lost = [1e2 * (t.seconds / b.seconds - 1) for t, b in zip(found, bases, strict=False)]
    errors = [t.error_mm for t in found if t.error_mm is not None]
    return {
        "products": sum(t.products for t in found),
        "of": UNITS * len(found),
        "time_lost_percent": max(lost, default=None),
        "gap_mm": max((t.gap_mm for t in found), default=None),
        "error_mm": max(errors, default=None),
    }


def measure(quick: bool = False) -> dict:
    """Every product under every kind: what must be survived, and the most that is."""
    names = SMALL[:1] if quick else SMALL
    cases = [(name, number, quick) for name in names for number in range(len(KINDS))]
    products = {name: {"required": [], "largest": []} for name in names}
    for (name, *_), (required, most) in zip(cases, over_cores(tried, cases), strict=True):
        products[name]["required"] += required
        products[name]["largest"] += most
    return {"units": UNITS, "seeds": 1 if quick else SEEDS, "products": products}


def tried(case: tuple[str, int, bool]) -> tuple[list[dict], list[dict]]:
    """A product under a kind, by their name and number: what must be survived, and, unless `quick`,
    the most that is."""
    name, number, quick = case
    plan, kind = layout(name), KINDS[number]
    chosen = range(len(plan.factory.robots)) if kind.each else range(1 if quick else SEEDS)
    seeds = [0] * len(chosen) if kind.each else chosen
    base = {seed: trial(plan, None, 0.0, seed, False) for seed in sorted(set(seeds))}
    bases, required = [base[seed] for seed in seeds], []
    for wanted, magnitude in REQUIRED:
        if wanted == kind.name:
            found = [trial(plan, kind.make, magnitude, s, kind.each) for s in chosen]
            required.append(_required(kind, magnitude, found, bases))
    return required, [] if quick else [search(plan, kind, chosen, bases)]


def _required(kind: Kind, magnitude: float, found: list[Trial], bases: Sequence[Trial]) -> dict:
    failures = [t.failure for t in found if t.failure]
    return {
        "kind": kind.name,
        "magnitude": magnitude,
        "unit": kind.unit,
        "survived": not failures,
        "failure": failures[0] if failures else None,
        **cost(found, bases),
    }


COSTS = ("time_lost_percent", "gap_mm", "error_mm")


def section(results: dict) -> str:
    """The report."""
    must = [
        (
            name,
            *(r[key] for key in ("kind", "magnitude", "unit")),
            f"{r['products']} of {r['of']}",
            *(r[key] for key in COSTS),
            r["failure"] or r["survived"],
        )
        for name, product in results["products"].items()
        for r in product["required"]
    ]
    most = [
        (name, *(r[key] for key in ("kind", "survived", "next", "unit", *COSTS, "failure")))
        for name, product in results["products"].items()
        for r in product["largest"]
    ]
    good = all(r["survived"] for p in results["products"].values() for r in p["required"])
    costs = ("time lost, %", "gap, mm", "error, mm")
    return "\n\n".join(
        [
            "## Disturbances",
            f"Runs of {results['units']} units at jitter {JITTER}, {results['seeds']} seeds, or one"
            " run for each robot where a single robot is disturbed. Survived: all units made,"
            " the replay refines the net, no unintended contact, product error at most"
            f" {ERROR_MM} mm. Time is lost against the same run undisturbed; the worst seed"
            " counts. The factory does not know of the disturbance, except for a slowed robot,"
            " whose drive is set to be slow; the drive of a robot held back is not.",
            "Disturbances that must be survived: "
            + ("**all are.**" if good else "**not all are.**"),
            table(
                ("product", "disturbance", "magnitude", "", "products", *costs, "survived"), must
            ),
            "The largest disturbance of each kind that is survived, on a grid (the next point is"
            " not, for the reason given). Pushes come every half second, on a robot or part drawn"
            " at random. Noise is white, 500 times a second, its standard deviation given; noise"
            " and delay are in what the supervisor sees and in the drive's own loop.",
            table(
                ("product", "disturbance", "survived", "next", "", *costs, "what ends the next"),
                most,
            ),
        ]
    )
