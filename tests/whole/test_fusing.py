"""Parts joined for good as one rigid body: momentum, product error, times; the monitor sees it."""

from __future__ import annotations

from collections.abc import Iterable

import pytest

from factory.apps.monitor import beside
from factory.engine.mjcf.masks import robot_code
from factory.engine.simulation.mujoco.fusing import Fusion
from factory.engine.simulation.mujoco.holdings import Holdings
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from tests.simulation_values import layout_of, ready


def test_the_monitor_catches_a_body_made_of_another_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: the product appears in the output robot's hands, but one input stays there."""
    simulation = Simulation(layout_of("paper"), RunRequest(units=2, fuse=True))
    parts, put_away = simulation.physical.parts, Holdings.put_away
    kept: list[str] = []

    def faulty(self: Holdings, bodies: Iterable[int]) -> None:
        bodies = [*bodies]
        labels = [parts.holdings.of(body).label for body in bodies]
        put_away(self, bodies)
        if "part1" in labels and not kept:
            kept.append("part1")
            robot = simulation.layout.factory.by_label["sub1"].carrier
            grip = parts.holdings.weld[robot_code(robot), "part1"]
            parts.welds.open([parts.holdings.parking[parts.holdings.free["part1"][0]][0]])
            parts.welds.close({grip: int(simulation.physical.m.eq_obj2id[grip])})

    monkeypatch.setattr(Holdings, "put_away", faulty)
    monitor = beside(simulation)
    simulation.run([monitor.observe], max_time=20)
    assert kept and not monitor.report().refines_net


def test_a_misfit_is_part_of_the_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted: parts are 3 mm out of place when they become one body."""
    misfits = Fusion.misfits
    monkeypatch.setattr(Fusion, "misfits", lambda self, groups: misfits(self, groups) + 3e-3)
    simulation = ready("paper", fuse=True, units=1)
    run = simulation.run()
    assert run.physics is not None
    assert run.physics.product_error_max_mm == pytest.approx(3.0, abs=0.01)
