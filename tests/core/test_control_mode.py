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
        ({"gate": [-1, 0], "standoff": [0.0, 0.9]}, "robot 2: goal 0.2 with standoff 0.9"),
        ({"gate": [-1, 2], "standoff": [0.0, 0.1]}, "there are 2 robots"),
        ({"gate": [1, 0], "standoff": [0.1, 0.1]}, r"robots \[1, 2\] wait for each other"),
        ({"gate": [1, -1], "standoff": [0.1, 0.0]}, "robot 1 waits for a gate"),
        ({"touch": [R, R]}, "1 pairs, 1 meet, 2 touch"),
    ],
)
def test_refuses_what_is_no_mode(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        two(**changes)


@pytest.mark.parametrize("limits", [([np.inf], [1.0]), ([1.0, 1.0], [1.0])])
def test_limits_are_positive_and_complete(limits: tuple[list[float], list[float]]) -> None:
    with pytest.raises(ValueError, match=r"limits|speeds"):
        Limits(*map(np.array, limits))


def test_a_bundle_wants_limits_for_every_robot() -> None:
    with pytest.raises(ValueError, match="mode 1: 1 limits, 2 robots"):
        Bundle.of([two(), two()], [Limits(np.ones(2), np.ones(2)), Limits(np.ones(1), np.ones(1))])
