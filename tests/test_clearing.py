"""Robots that stand while what was lost lies in their way, as the timed net foresees them."""

from __future__ import annotations

from dataclasses import replace
from random import Random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.control.profile import mode_time, places_after
from factory.layout.sweeping import APART, SweptFloor
from factory.plant.factory import Operation
from factory.simulation.recovery import Campaign, WorldFault, recover
from factory.simulation.request import RunRequest
from factory.simulation.simulation import Simulation
from factory.study.analysis import Timing
from factory.study.analysis.clearing import clearing_of
from factory.study.analysis.failing import failing_net
from factory.study.analysis.timed import timed_net
from factory.timing.failing import (
    Chance,
    Clearing,
    FailingNet,
    Mishap,
    Near,
    Rates,
    drawn,
    failing_run,
)
from tests.fold_values import random_fold
from tests.layout_values import paper_layout
from tests.test_failures import plain_net

SECONDS = 7.5


def once(label: str, lost: str, after: int = 10) -> Chance:
    """A label is lost once, at an operation that has ended so many times."""
    left = [Mishap((lost,))]

    def chance(operation: Operation, ended: int) -> Mishap | None:
        due = operation.label == label and ended == after
        return left.pop() if due and left else None

    return chance


def standing(subject: FailingNet, robots: frozenset[int], seconds: float = SECONDS) -> FailingNet:
    """The net in which the same robots stand, whatever is lost."""
    return replace(subject, clearing=Clearing(lambda *_: robots, seconds))


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_where_nothing_lies_in_the_way_all_is_as_without(seed: int) -> None:
    subject = plain_net(random_fold(seed))
    runs = [
        failing_run(net, drawn(Rates(0.1, 0.05), seed), 40)
        for net in (subject, standing(subject, frozenset()))
    ]
    assert runs[0] == runs[1]


@given(st.integers(0, 10_000), st.data())
@settings(max_examples=20)
def test_where_all_robots_stand_all_comes_so_much_later(seed: int, data: st.DataObject) -> None:
    subject = plain_net(random_fold(seed))
    factory = subject.factory
    operation = data.draw(st.sampled_from([o for o in factory.operations if o.inputs]))
    lost = data.draw(st.sampled_from(operation.inputs))
    every = frozenset(range(len(factory.robots)))
    plain, later = (
        failing_run(net, once(operation.label, lost, 3), 24).dates
        for net in (subject, standing(subject, every))
    )
    gap = np.subtract(later, plain)
    assert gap[-1] == pytest.approx(SECONDS)
    assert ((np.abs(gap) < 1e-9) | (np.abs(gap - SECONDS) < 1e-9)).all()
    assert (np.diff(gap) > -1e-9).all()


@given(st.integers(0, 10_000))
@settings(max_examples=20)
def test_robots_that_stand_bring_nothing_forward(seed: int) -> None:
    """More robots that stand, or longer, make no product come sooner where one thing is lost."""
    subject, draw = plain_net(random_fold(seed)), Random(seed)
    factory = subject.factory
    operation = draw.choice([o for o in factory.operations if o.inputs])
    chosen = frozenset(r.index for r in factory.robots if draw.random() < 0.5)
    more = chosen | {draw.randrange(len(factory.robots))}
    nets = [
        standing(subject, chosen, 0.5 * SECONDS),
        standing(subject, chosen),
        standing(subject, more),
    ]
    dates = [failing_run(n, once(operation.label, operation.inputs[0], 3), 24).dates for n in nets]
    assert all(a <= b + 1e-9 for a, b in zip(dates[0], dates[1], strict=True))
    assert all(a <= b + 1e-9 for a, b in zip(dates[1], dates[2], strict=True))


def test_robots_stand_side_by_side_or_one_after_the_other() -> None:
    """Two that stand for a thing each do so at once; where both stand for the first thing, the
    second is lost only later, and they stand again."""
    here, seconds = timing(), 100.0
    subject = failing_net(here, timed_net(here))
    robot = {o.label: o.carrier for o in here.factory.leaves}
    both = frozenset({robot["part1"], robot["part2"]})

    def last(near: Near | None) -> float:
        first, second = once("part1", "part1"), once("part2", "part2")
        net = subject if near is None else replace(subject, clearing=Clearing(near, seconds))
        return failing_run(net, lambda o, n: first(o, n) or second(o, n), 30).dates[-1]

    apart = last(lambda _, label, share: frozenset({robot[label]})) - last(None)
    together = last(lambda *_: both) - last(None)
    assert 0.9 * seconds < apart < 1.1 * seconds
    assert 1.9 * seconds < together < 2.1 * seconds


def timing() -> Timing:
    return Timing(paper_layout())


# What lies where


@given(st.integers(0, 1_000_000))
@settings(max_examples=50)
def test_robots_are_near_as_a_look_at_every_box_says(seed: int) -> None:
    draw = np.random.default_rng(seed)
    low = draw.uniform(-1, 1, (30, 2))
    high = low + draw.uniform(0, 0.3, (30, 2))
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    swept = SweptFloor(boxes, np.arange(30) // 3)
    places, radii = draw.uniform(-1, 1, (4, 2)), draw.uniform(0, 0.2, 4)
    near = {
        robot
        for robot, (xlo, xhi, ylo, yhi) in zip(swept.robots.tolist(), boxes, strict=True)
        for (x, y), radius in zip(places, radii, strict=True)
        if np.hypot(x - np.clip(x, xlo, xhi), y - np.clip(y, ylo, yhi)) < radius + APART
    }
    assert swept.near(places, radii) == near


def test_robots_are_at_their_goals_when_their_mode_is_over() -> None:
    here = timing()
    for number, (mode, start) in enumerate(zip(here.modes, here.starts, strict=True)):
        limits = here.limits.of(here.factory.axes[number])
        whole = mode_time(mode, start, limits)
        assert places_after(mode, start, limits, whole) == pytest.approx(mode.goals)
        assert places_after(mode, start, limits, 0.0) == pytest.approx(start)
        ways = [
            np.abs(places_after(mode, start, limits, share * whole) - mode.goals)
            for share in np.linspace(0, 1, 20)
        ]
        assert (np.diff(ways, axis=0) < 1e-12).all()


@pytest.mark.parametrize(("label", "operation"), [("part1", "sub1"), ("part3", "sub3")])
def test_the_robots_that_stand_in_a_run_are_foreseen(label: str, operation: str) -> None:
    layout = paper_layout()
    made = Simulation(layout, RunRequest(units=2, recovers=True))
    fault = WorldFault("drop", label=label, unit=1)
    recovery = recover(made, Campaign((fault,), seed=1, clear=3.0))
    made.run(max_time=60.0)
    stood = frozenset(recovery.stood[0][1])
    clearing = clearing_of(timing(), 3.0)
    assert clearing is not None
    names = [robot.name for robot in layout.factory.robots]
    foreseen = {
        frozenset(names[r] for r in clearing.near(layout.factory.by_label[operation], label, s))
        for s in np.linspace(0, 1, 9)
    }
    assert stood in foreseen


def test_nothing_lies_about_in_the_ideal_world() -> None:
    assert clearing_of(Timing(paper_layout(), world="ideal"), 10.0) is None
    assert clearing_of(timing(), 0.0) is None
