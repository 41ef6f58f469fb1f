"""Modes: what is refused, what is derived."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from factory.theory.control.mode import Limits, Mode
from factory.theory.control.navigation import Bundle

R = 0.1


def two(**changes: Any) -> Mode:
    """Two robots; robot 1's guidepath ends at 0.5 of robot 0's."""
    values: dict[str, Any] = {
        "goals": [0.5 + 2 * R, 2 * R],
        "lower": [0.0, 0.0],
        "upper": [1.0, 1.0],
        "eps": 1e-3,
        "pairs": [[0, 1]],
        "meet": [[0.5, 0.0]],
        "touch": [R],
    }
    return Mode(**(values | changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"goals": []}, "shape"),
        ({"eps": 0.0}, "eps 0"),
        ({"dwell": -1.0}, "dwell -1"),
        ({"goals": [0.5, 1.5]}, r"robot 2: goal 1.5 with standoff 0 is not inside \[0, 1\]"),
        ({"goals": [float("nan"), 0.2]}, "robot 1: goal nan"),
        ({"gate": [-1, 0], "standoff": [0.0, 0.9]}, "robot 2: goal 0.2 with standoff 0.9"),
        ({"gate": [-1, 2], "standoff": [0.0, 0.1]}, "there are 2 robots"),
        ({"gate": [1, 0], "standoff": [0.1, 0.1]}, r"robots \[1, 2\] wait for each other"),
        ({"gate": [1, -1], "standoff": [0.1, 0.0]}, "robot 1 waits for a gate"),
        ({"pairs": [[0, 5]]}, "pairs"),
        ({"touch": [R, R]}, "1 pairs, 1 meet, 2 touch"),
        ({"touch": [4 * R]}, "robots 1 and 2 at their goals touch"),
        ({"touch": [4 * R - 1.5e-3]}, "the goal ball needs more than 0.002"),
        ({"pairs": [[1, 1]]}, "robots 2 and 2"),
        ({"lower": [0.0]}, r"lower of shape \(1,\), expected \(2,\)"),
    ],
)
def test_refuses_what_is_no_mode(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        two(**changes)


@pytest.mark.parametrize("limits", [([1.0], [0.0]), ([np.inf], [1.0]), ([1.0, 1.0], [1.0])])
def test_limits_are_positive_and_complete(limits: tuple[list[float], list[float]]) -> None:
    with pytest.raises(ValueError, match=r"limits|speeds"):
        Limits(*map(np.array, limits))


def test_a_bundle_wants_limits_for_every_robot() -> None:
    with pytest.raises(ValueError, match="mode 1: 1 limits, 2 robots"):
        Bundle.of([two(), two()], [Limits(np.ones(2), np.ones(2)), Limits(np.ones(1), np.ones(1))])
