"""Predicted times against the field and the governor, integrated."""

from __future__ import annotations

import pytest

from factory.theory.control.governed import Trajectory
from factory.theory.control.profile import SpeedProfile


def test_a_way_is_done_with_a_ramp_at_each_end() -> None:
    """0.25 s each, at half of 0.5 m/s; with a speed at the start the first one is shorter."""
    assert SpeedProfile().rest(1.0) == pytest.approx(2 * 0.25 + (1.0 - 2 * 0.0625) / 0.5)
    assert SpeedProfile().rest(1.0, 0.5) == pytest.approx(0.25 + (1.0 - 0.0625) / 0.5)


def test_an_axis_rests_once_it_is_both_near_and_slow() -> None:
    way = Trajectory((0.3, 0.1, 0.0, 0.0), (0.2, 0.1, 0.0, 0.0), (0.2, 0.2, 0.1, 0.0))
    assert (way.within(0.05), way.rests(0.05), way.rests(0.05, still=0.5)) == (2, 3, 2)
