"""Layouts of all kinds that are spoiled: a machine that is in another's way is refused by name, and
what is not refused runs without a contact."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from factory.apps.platen import compacting
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.certificate import Certificate
from factory.floor.layout.clearance import certify
from factory.floor.layout.layout import Layout, branch_of, carriers
from factory.floor.layout.presence import ALONG, ROUNDING
from factory.floor.layout.request import Ground
from factory.pipeline import read
from tests.layout_values import along, random_layout
from tests.mix_values import LITTLE
from tests.whole.test_manipulator import TWO
from tests.whole.test_tees import project


def written(text: str) -> Layout:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "product.pag"
        path.write_text(text)
        return read(path).layout


KINDS: dict[str, Callable[[], Layout]] = {
    "rails": lambda: read("examples/paper.pag").layout,
    "relay": lambda: read("examples/paper.pag", ground=Ground(relay=True)).layout,
    "platen": lambda: read("examples/lamp.pag", ground=Ground(tile=0.24)).layout,
    "tee": lambda: project(2).layout,
    "mix": lambda: written(LITTLE),
    "manipulators": lambda: written(TWO),
    "bare": lambda: random_layout(12, 3, "any", "medium"),
}


def spoiled(layout: Layout) -> Iterator[tuple[int, Layout, Certificate]]:
    """Layouts in which one robot has been moved along its carrier, with all that come to it."""
    on = carriers(layout.factory)
    for guest, carrier in enumerate(on):
        if carrier >= 0 and not layout.guidepaths[carrier].bends:
            for by in (-0.04, 0.004):
                moved = along(layout, guest, by)
                yield guest, moved, certify(moved)


@pytest.mark.parametrize("kind", KINDS)
def test_who_is_in_the_way_is_named_and_who_is_not_refused_meets_nobody(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any layout will do, also one that was searched for shortly."""
    if kind == "platen":
        monkeypatch.setattr(compacting, "TRIES", 20)
    every = [*spoiled(KINDS[kind]())]
    for guest, moved, found in every:
        on = carriers(moved.factory)
        names = {moved.factory.robots[r].name for r in (on[guest], *branch_of(on, guest))}
        assert found.holds or any(names & {*fault.robots} for fault in found.faults)
    clear = [(moved, found) for _, moved, found in every if found.holds]
    assert len(every) - len(clear) >= len(every) / 4
    for moved, found in clear[:: max(1, len(clear) // 2)]:
        request = RunRequest("mujoco", 4, seed=3, jitter=0.3)
        run = Simulation(replace(moved, certificate=found), request).run()
        assert run.trouble is None and run.physics is not None
        assert run.physics.unintended_contacts == 0, run.physics.contacts


def test_the_margin_is_the_clearance() -> None:
    """r4 works beside r5, exactly a clearance from it."""
    layout = read("examples/paper.pag").layout
    assert certify(along(layout, 3, 0.0)).holds
    found = certify(along(layout, 3, -0.001))
    fault = found.faults[0]
    assert "carriage of r4" in fault.message and "carriage of r5" in fault.message
    assert fault.lacking == pytest.approx(0.001 - 2 * (ALONG + ROUNDING), abs=1e-9)
