"""Faults that are planted in a cell fail its run by name."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

from factory.apps.arms.curves import LegTable
from factory.apps.arms.joint_way import JointWay
from factory.apps.runs.watched import watched
from factory.engine.simulation.ordering import Ordering
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.floor.modes.modes import operation_modes, robot_limits
from factory.theory.control.mode import Limits, Mode
from tests.arm_cells import cell, chains, project

Changes = Callable[[Layout], Layout]
Patches = dict[str, Callable[..., Any]]


@dataclass(frozen=True)
class Fault:
    """A fault of a cell, and the codes of the failures of a run that has it.

    Attributes:
        name: what it is.
        codes: of which a run with it has all; none for a run that succeeds.
        layout: what it changes of the layout.
        acts: what it changes of the simulation.
        arm: the arms, or `beside` for the cell of a part beside another.
        patches: what a simulation uses in place of functions of these names.
        every_tick: whether the monitor looks after every tick.
    """

    name: str
    codes: tuple[str, ...]
    layout: Changes = lambda layout: layout
    acts: Callable[[Simulation], None] = lambda simulation: None
    arm: str = "six"
    patches: Patches = field(default_factory=dict)
    every_tick: bool = False

    def __str__(self) -> str:
        return self.name


def with_chains(layout: Layout, **changed: Any) -> Layout:
    """The cell whose arms are told other things."""
    return replace(layout, chains=replace(chains(layout), **changed))


def without_orders(simulation: Simulation) -> None:
    """No operation waits for an arm to have gone."""
    simulation.supervisor.ordering = Ordering()  # type: ignore[attr-defined]


BESIDE = """root = x;
x = mate ( a, b );
a = atomic ( box = (0.08, 0.07, 0.04), pos = (0, 0, 0.02) );
b = atomic ( box = (0.03, 0.03, 0.03), pos = (-0.0552, 0, 0.025) )"""
"""A block, and one that comes down beside it, on the side on which the carrier leaves."""


@cache
def beside() -> Layout:
    """Its cell."""
    return project(BESIDE, "six").layout


def slow(robot: int, share: float) -> Patches:
    """A robot (index) that goes at a share of its speed."""

    def limits(*given: Any) -> tuple[Limits, Any]:
        all_limits, gains = robot_limits(*given)
        speed = all_limits.speed.copy()
        speed[robot] *= share
        return Limits(speed, all_limits.acceleration), gains

    return {"robot_limits": limits}


def without_gates(layout: Layout, eps: float) -> tuple[Mode, ...]:
    """No arm waits above the station."""
    return tuple(
        replace(mode, gate=np.full_like(mode.gate, -1), standoff=0.0 * mode.standoff)
        for mode in operation_modes(layout, eps)
    )


def too_near(layout: Layout) -> Layout:
    """Arms wait for each other where they wait for the carrier."""
    return with_chains(layout, private=chains(layout).standoffs)


BESIDE_IT = 3
"""So many knots on either side of one that is moved: an arm passes them in more than a tick."""


def bent(share: float, seen: bool) -> Changes:
    """A knot of the way that brings 'motor', at a share of it, is moved by 0.05 rad, with those
    beside it; the monitor knows of it or not."""

    def change(layout: Layout) -> Layout:
        told = chains(layout)
        join = layout.factory.parents[layout.factory.by_label["motor"].index]
        row = told.row(join, 1)
        legs = list(told.curves.legs)
        way = legs[row].way
        places = way.places.copy()
        knot = int(share * (len(places) - 1))
        places[max(knot - BESIDE_IT, 0) : knot + BESIDE_IT + 1, 1] += 0.05
        moved = JointWay(way.knots, places, way.off, way.hover)
        legs[row] = replace(legs[row], way=moved)
        made = with_chains(layout, curves=LegTable(legs))
        if not seen:
            vars(made.chains)["sought"] = told.sought
        return made

    return change


def heavy(layout: Layout) -> Layout:
    """Parts are twenty times as heavy as the cell knows."""
    solids = {
        label: replace(solid, mass=20 * solid.mass, inertia=20 * solid.inertia)
        for label, solid in layout.product.solids.items()
    }
    return replace(layout, product=replace(layout.product, solids=solids))


FAULTS = (
    Fault("nothing", ()),
    Fault(
        "an arm is slow, no order places",
        ("Contact",),
        acts=without_orders,
        arm="six=2",
        patches=slow(1, 0.2),
    ),
    Fault(
        "an arm is slow, the other waits above the station",
        ("Contact",),
        layout=too_near,
        arm="six=2",
        patches=slow(1, 0.2),
    ),
    Fault(
        "the carrier is slow, no gates",
        ("Contact",),
        arm="beside",
        patches={"operation_modes": without_gates, **slow(0, 0.2)},
    ),
    Fault("the last knot of a way is off", ("Dropped", "Contact"), layout=bent(1.0, True)),
    Fault("a knot in the middle is off", ("Astray",), layout=bent(0.5, False), every_tick=True),
    Fault("parts are twenty times as heavy", ("Dropped",), layout=heavy),
)


@pytest.mark.parametrize("fault", FAULTS, ids=str)
def test_a_planted_fault_fails_by_name(fault: Fault) -> None:
    layout = fault.layout(beside() if fault.arm == "beside" else cell(fault.arm))
    with ExitStack() as stack:
        for name, other in fault.patches.items():
            stack.enter_context(patch(f"factory.engine.simulation.simulation.{name}", other))
        simulation = Simulation(layout, RunRequest(units=1, shown=False))
    fault.acts(simulation)
    run = watched(simulation, every_tick=fault.every_tick)
    if not fault.codes:
        assert run.succeeded
    codes = [failure.code for failure in run.verdict.failures]
    assert {*fault.codes} <= {*codes}
