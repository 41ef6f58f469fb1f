"""All operations of a factory at once, against one operation at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import factory
from benches.fidelity.products import file_of, is_here
from benches.tables import table
from factory.engine.record.state import Event, State
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.theory.plant.operation import Operation

NAMES = (
    *("paper", "lamp", "stool", "truck", "chair", "gearbox"),
    *("30023-1-Lighthouse", "6966-1-JediStarfighter-Mini", "889-1-RadarTruck"),
)


UNITS = 4
"""Units of a run: the cycle time is that of the last two."""


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """Some units, both ways, on one layout."""
    rows: list[dict[str, Any]] = []
    for name in NAMES[:2] if quick else filter(is_here, NAMES):
        layout = factory.lay_out(file_of(name))
        row = {"product": name, "robots": len(layout.factory.robots)}
        row["operations"] = len(layout.factory.operations)
        row["together"], row["alone"] = made(layout), made(layout, alone=True)
        rows.append(row)
        print(".", end="", flush=True)
        yield {"rows": rows}
    print()


def made(layout: Layout, alone: bool = False) -> dict[str, Any]:
    """What a run of some units takes; if `alone` with one operation at a time, unit by unit, in the
    order in which a single unit is made."""
    simulation = Simulation(layout, RunRequest(units=UNITS, shown=False))
    order, transitions = layout.factory.order, layout.factory.net.threaded.transitions
    ends = {transitions[2 * number + 1].name for number in order}
    seen = ended = 0

    def gate(operation: Operation, unit: int) -> bool:
        return operation.index == order[ended % len(order)]

    def look(state: State) -> None:
        nonlocal seen, ended
        fired = [event.transition for event in state.events[seen:] if isinstance(event, Event)]
        seen, ended = len(state.events), ended + sum(name in ends for name in fired)
        simulation.world.supplied = True

    if alone:
        simulation.world.hooks.gates.append(gate)
    run = simulation.run([look] if alone else [])
    first = simulation.world.dropoffs[0] if run.products else None
    return {"first_s": first, "cycle_s": run.cycle_time_s, "succeeded": run.succeeded}


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("product", "robots", "operations", "first unit: one at a time [s]", "together [s]"),
        *("less", "further units: one at a time [s]", "together [s]", "less", "clean"),
    )
    rows, less = [], dict[str, list[float]]()
    for row in results["rows"]:
        alone, together = row["alone"], row["together"]
        cells: list[object] = [row["product"], row["robots"], row["operations"]]
        for key in ("first_s", "cycle_s"):
            one, all_ = alone[key], together[key]
            less.setdefault(key, []).append(1 - all_ / one)
            cells += [f"{one:.2f}", f"{all_:.2f}", f"{100 * (1 - all_ / one):.0f} %"]
        rows.append([*cells, alone["succeeded"] and together["succeeded"]])
    mean = {key: f"{100 * sum(some) / len(some):.0f} %" for key, some in less.items()}
    last = f"Mean: {mean['first_s']} less for the first unit, {mean['cycle_s']} for further ones."
    return "\n\n".join(["## Concurrency", TEXT, table(head, rows), last])


TEXT = f"""\
`python -m benches.compare concurrency`, in MuJoCo, {UNITS} units, jitter 0. *Together*: as `factory
run FILE --units {UNITS}`, where an operation starts as soon as the net allows. *One at a time*: the
same layout and robots; an operation starts when the one before has ended, unit by unit, in the
order in which a single unit is made. Robots go home meanwhile in both. *First unit*: from an empty
factory until it has left. *Further units*: mean interval between the last ones. *Clean*: both runs
succeed.

The operations of one unit of a chain follow each other anyway; most of the gain is that several
units are inside at once.

APEX-MR reports for two arms that build with LEGO bricks 48 % less execution time than sequential
planning, and 36 % less than synchronous planning, on average (P. Huang, R. Liu, S. Aggarwal,
C. Liu, J. Li, *APEX-MR: Multi-Robot Asynchronous Planning and Execution for Cooperative Assembly*,
RSS 2025, [arXiv 2503.15836](https://arxiv.org/abs/2503.15836), abstract). Two arms share all tasks
of one product there; here each robot has its own, so this is the same effect, not the same
problem."""
