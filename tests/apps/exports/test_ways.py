"""No two machines ever meet: by a checker that knows the MJCF, the ways and the circuits alone; and
faults that are planted are refused by it, by name."""

from __future__ import annotations

from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

from factory.apps.exports import stock
from factory.apps.exports.ways import ways
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import build_model
from factory.engine.simulation.ordering import Ordering
from factory.floor.layout.layout import Layout
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import read
from factory.support.settings import Settings
from factory.theory.nets.coordinated import Order
from tests.clearance_values import check
from tests.random_products import random_product
from tests.slow import slow_but

Json = dict[str, Any]

ORDER = "order:past:r8:2:s1/5:s1/4"
"""What a carrier waits for with its next unit: a hand that has gone from its station."""

SEEDS = (39014, 39018)
"""Random products: a fetch that a carrier waits for; lifts."""


@cache
def laid_out(seed: int) -> Layout:
    """A random product, laid out; the paper's for 0."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "product.pag"
        file.write_text(random_product(seed))
        return read(file if seed else "examples/paper.pag").layout


@cache
def _written(seed: int) -> tuple[mujoco.MjModel, Json, Json]:
    layout = laid_out(seed)
    copies = {leaf.label: 1 for leaf in layout.factory.leaves}
    settings = Settings(timestep=0.002)
    model = build_model(layout, load_catalogue(), copies, settings, finish=stock.write)
    assert layout.certificate is not None
    return load(model), ways(model), layout.certificate.as_json()


def written(seed: int) -> tuple[mujoco.MjModel, Json, Json]:
    """What `build` writes of a product, to be changed."""
    m, machines, clearance = _written(seed)
    return m, deepcopy(machines), deepcopy(clearance)


def refused(faults: list[str], *words: str) -> None:
    """Some fault says all the words."""
    assert any(all(word in fault for word in words) for fault in faults), faults


@pytest.mark.parametrize("seed", slow_but([0], [0, *SEEDS]))
def test_what_comes_near_has_its_circuit(seed: int) -> None:
    m, machines, clearance = written(seed)
    assert clearance["excluded"]
    assert check(m, machines, clearance) == []


def test_a_wait_that_is_taken_out_is_refused() -> None:
    m, machines, clearance = written(39014)
    gone = next(row for row in machines["places"] if row["place"] == ORDER)
    machines["places"].remove(gone)
    refused(check(m, machines, clearance), "r1 and r8", "not of the net", ORDER)


def test_an_operation_waits_for_another() -> None:
    fired = [0] * 6
    ordering = Ordering([Order(3, 4, 0)])

    def waits() -> bool:
        return ordering.hold_up(4, fired.__getitem__, lambda: np.zeros(1))

    assert waits() and ordering.lacking == {3}
    fired[3] = 1
    ordering.ask_anew()
    assert not waits() and not ordering.lacking
    fired[4] = 1
    assert waits()
    ordering.keep_passes()
    assert not waits()
