"""Courses: what references do, planned ahead; kept or planned anew, cut short or followed to their
end."""

from __future__ import annotations

import numpy as np
import pytest

from factory.engine.simulation.mujoco.courses import Course
from factory.engine.simulation.mujoco.fast import strides
from factory.engine.simulation.mujoco.fast.strides import Strides
from tests.simulation_values import ready


def test_there_is_room_for_so_many_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strides, "ROOM", 42)
    cache = ready("paper").physical.motion.stepping
    assert isinstance(cache, Strides)
    still = np.zeros((2, 1))
    for number in range(100):
        course = cache.course(number % 7, lambda: Course(still, still, np.zeros((1, 4, 3)), False))
        again = cache.course(number % 7, lambda: pytest.fail("it was forgotten"))
        assert again is course
        assert 1 <= len(cache._courses) <= 42 // 16
