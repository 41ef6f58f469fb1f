"""Hands that once met something: each product here is the smallest found of its kind."""

from __future__ import annotations

from pathlib import Path

import pytest

from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read

BOX = """root = r; r = mate ( a, b ); a = mate ( low, left, right, front, rear, lid );
low = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.005) );
left = atomic ( box = (0.01, 0.06, 0.03), pos = (-0.025, 0, 0.025) );
right = atomic ( box = (0.01, 0.06, 0.03), pos = (0.025, 0, 0.025) );
front = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, -0.025, 0.025) );
rear = atomic ( box = (0.0398, 0.01, 0.03), pos = (0, 0.025, 0.025) );
lid = atomic ( box = (0.06, 0.06, 0.01), pos = (0, 0, 0.045) );
b = atomic ( box = (0.03, 0.03, 0.02), pos = (0.06, 0, 0.01) )"""
"""Walls that are lowered one after the other, by robots from either side."""


def laid_out(text: str, folder: Path) -> Layout:
    """A product laid out with hands."""
    file = folder / "product.pag"
    file.write_text(text)
    return read(file).layout


@pytest.mark.parametrize("distributed", [False])
def test_hands_from_either_side_wait_for_each_other(distributed: bool, tmp_path: Path) -> None:
    asked = RunRequest(units=2, jitter=0.3, seed=1, distributed=distributed)
    run = watched(Simulation(laid_out(BOX, tmp_path), asked), (), 60.0)
    assert run.succeeded, run.verdict.failures
    assert run.products == 2
