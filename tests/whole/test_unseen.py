"""A run that is not shown lacks what is only there to be seen, and is the same to the last bit."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from factory.apps.log import read_log
from factory.engine.mjcf import loading
from factory.engine.mjcf.unseen import leave_out_what_is_shown
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.simulation import Simulation
from tests.command_line import Terminal
from tests.paths import PAPER
from tests.simulation_values import gone_wild, layout_of, ready, states


@pytest.mark.parametrize("seed", range(3))
def test_all_that_collides_is_there(seed: int) -> None:
    seen, unseen = (ready("20", shown=shown, distributed=True) for shown in (True, False))
    expected = states(seen, gone_wild(seen, seed), 150)
    assert states(unseen, gone_wild(unseen, seed), 150) == expected
    touched = [simulation.physical.inspection.unintended for simulation in (seen, unseen)]
    assert touched[0] and touched[0] == touched[1]


def test_nothing_that_weighs_or_touches_is_left_out() -> None:
    """Whatever a robot type calls its classes."""
    text = """<mujoco>
      <default>
        <default class="shown"><geom contype="0" conaffinity="0" mass="0" group="1"/></default>
        <default class="x/shown"><geom contype="1" conaffinity="0" mass="0" group="1"/></default>
      </default>
      <worldbody>
        <geom name="gone" class="shown"/><geom name="heavy" class="shown" mass="1"/>
        <geom name="touches" class="shown" contype="1"/><geom name="theirs" class="x/shown"/>
        <body name="shell"><body name="inner"><geom name="gone too" class="shown"/></body></body>
        <body name="kept"><site name="there"/><geom name="none" class="shown"/></body>
      </worldbody>
    </mujoco>"""
    root = ElementTree.fromstring(text)
    leave_out_what_is_shown(root)
    left = {element.get("name") for tag in ("geom", "body", "site") for element in root.iter(tag)}
    assert left - {None} == {"heavy", "touches", "theirs", "kept", "there"}


def test_only_meshes_that_are_drawn_are_left_out() -> None:
    full, bare = (physical_model(layout_of("gearbox"), 1, shown=shown) for shown in (True, False))
    assert loading.load(bare).nmesh < loading.load(full).nmesh


def test_what_is_logged_can_be_looked_at(run: Terminal, tmp_path: Path) -> None:
    log = tmp_path / "run.log"
    assert run("run", PAPER, "--log", log, "-q").status == 0
    assert "r1/rail" in read_log(log).xml
    assert "r1/rail" in Simulation(layout_of("paper")).model.xml  # type: ignore[union-attr]
    assert "r1/rail" not in physical_model(layout_of("paper"), 1, shown=False).xml
