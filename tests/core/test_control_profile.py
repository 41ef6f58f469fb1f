"""Predicted times against the field and the governor, integrated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from factory.theory.control.governed import GovernedAxis, mode_ticks, trajectories
from factory.theory.control.mode import Limits, Mode


def test_waiting_takes_a_tick_or_its_dwell() -> None:
    limits, drive = Limits(np.ones(2), np.ones(2)), GovernedAxis(1.0, 1.0, 0.01)
    ways = trajectories(Mode.still(2), np.zeros(2), limits, drive)
    assert mode_ticks(Mode.still(2), ways, 0.01) == 1
    assert mode_ticks(replace(Mode.still(2), dwell=0.25), ways, 0.01) == 25
