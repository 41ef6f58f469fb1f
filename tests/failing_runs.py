"""Runs of the paper's example in which something fails, for tests of what is shown of them."""

from __future__ import annotations

from pathlib import Path

from factory.apps.deviations import Campaign, Deviation
from factory.apps.log import Log, LogWriter, read_log
from factory.apps.recovery import recover
from factory.engine.simulation.request import RunRequest, WorldName
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from tests.paths import PAPER

CAMPAIGN = Campaign(
    (
        Deviation("bad_part", label="part1", unit=1),
        Deviation("drop", label="part2", unit=2),
        Deviation("bad_joint", label="sub1", unit=3, metres=2e-3),
        Deviation("dead", robot="r2", unit=3),
    ),
    clear=2.0,
    spares=1,
    swap=3.0,
)
"""The same, with a spare."""


def paper_layout() -> Layout:
    """The paper's example, laid out."""
    return read(PAPER).layout


def failing(
    path: Path, world: WorldName = "mujoco", units: int = 4, campaign: Campaign = CAMPAIGN
) -> Log:
    """The log of a run in which all of a campaign happens."""
    request = RunRequest(world, units=units, recovers=True)
    made = Simulation(paper_layout(), request)
    recover(made, campaign)
    with LogWriter(path, made) as log:
        made.run([log.observe])
    return read_log(path)
