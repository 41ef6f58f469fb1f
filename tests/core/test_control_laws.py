"""The table of control laws: from a template and its guidepaths to a mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from factory.support.errors import InputError
from factory.theory.control.laws import LAWS, Setting, law_of
from factory.theory.control.mode import Mode
from factory.theory.problem.template import Law, Point, Template

MATE = Template(
    name="mate",
    robots=("dot",) * 3,
    carrier=3,
    identifications=((Point("A", 1), Point("A", 2), Point("B", 3)),),
    before=("LAB1", "LAB2", "nopart"),
    after=("nopart", "nopart", "LAB3"),
    law=Law("navigation", (Point("A", 1, 2.0), Point("A", 2, 2.0), Point("B", 3))),
)
SETTING = Setting(
    lower=np.zeros(3),
    upper=np.array([1.0, 1.2, 0.8]),
    r=np.array([0.05, 0.05, 0.1]),
    eps=1e-3,
    station=np.full(3, np.nan),
    width=np.array([0.05, 0.05, 0.1]),
    dwell=0.0,
    gate=np.full(3, -1),
    standoff=np.zeros(3),
)


def mode_of(template: Template, setting: Setting) -> Mode:
    """The mode that a template's F gives."""
    return law_of(template)(template, setting)


def test_stations_gates_width_and_dwell() -> None:
    insert = Template(
        name="insert",
        robots=("dot", "dot"),
        carrier=1,
        identifications=((Point("S", 1, -2.0), Point("A", 2)),),
        before=("LAB1", "LAB2"),
        after=("LAB3", "nopart"),
        law=Law("navigation", (Point("S", 1), Point("A", 2, 2.0))),
    )
    setting = Setting(
        lower=np.zeros(2),
        upper=np.ones(2),
        r=np.full(2, 0.05),
        eps=1e-3,
        station=np.array([0.5, np.nan]),
        width=np.full(2, 0.04),
        dwell=2.0,
        gate=np.array([-1, 0]),
        standoff=np.array([0.0, 0.3]),
    )
    mode = mode_of(insert, setting)
    assert np.allclose(mode.goals, [0.5, 0.1]) and np.allclose(mode.meet, [[0.4, 0.0]])
    assert np.allclose(mode.touch, [0.04]) and mode.dwell == 2.0
    assert mode.gate.tolist() == [-1, 0] and mode.trapped == ()
    with pytest.raises(InputError, match="S1 - 2r names a station, but the guidepath of robot 1"):
        mode_of(insert, replace(setting, station=np.full(2, np.nan)))


@pytest.mark.parametrize("name", ["wait"])
def test_waiting_is_a_law_too(name: str) -> None:
    mode = mode_of(replace(MATE, law=replace(MATE.law, name=name)), SETTING)
    assert mode.is_still and mode.size == 3


def test_goals_that_touch_are_not_prepared() -> None:
    law = replace(MATE.law, goals=(Point("A", 1), Point("A", 2), Point("B", 3)))
    with pytest.raises(InputError) as caught:
        mode_of(replace(MATE, law=law), SETTING)
    assert caught.value.diagnostics[0].code == "NotPrepared"
    assert "mate: robots 1 and 2 at their goals touch" in str(caught.value)


def test_an_unknown_law_is_named_with_the_nearest() -> None:
    law = replace(MATE.law, name="navigaton")
    with pytest.raises(InputError, match="unknown control law 'navigaton'") as caught:
        mode_of(replace(MATE, law=law), SETTING)
    assert caught.value.diagnostics[0].hint == "did you mean 'navigation'?"
    assert next(iter(LAWS)) == "navigation"
