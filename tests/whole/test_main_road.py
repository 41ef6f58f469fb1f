"""The main road (compile, verify, simulate) never enters the room for nets from elsewhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.house import this_house
from tests.paths import PAPER, ROOT

ASIDE = ("factory.apps.foreign_nets", "networkx")
"""What the main road does without."""

OFF_THE_ROAD = {"apps.foreign_nets", "apps.exports", "apps.analyze", "commands"}
"""Rooms that may import `foreign_nets`: commands when they are given a net in PNML, and studies of
nets."""

PLANTED = "import factory.apps.foreign_nets.behaviour"


def entered(words: list[str], first: str = "") -> set[str]:
    """What of `ASIDE` a process has loaded that runs `first` and then a command."""
    code = (
        f"{first}\nimport json, sys\nfrom factory.commands import run_command\n"
        "assert run_command(sys.argv[1:]) == 0\n"
        "print(json.dumps(sorted(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=True,
    )
    modules = json.loads(done.stderr.splitlines()[-1])
    assert "factory.theory.nets.petri" in modules
    return {aside for aside in ASIDE for name in modules if f"{name}.".startswith(f"{aside}.")}


@pytest.mark.parametrize("command", ["check", "build", "run"])
def test_the_main_road_does_not_enter(command: str, tmp_path: Path) -> None:
    words = {
        "check": ["check", str(PAPER), "--certificate", str(tmp_path / "proof.json")],
        "build": ["build", str(PAPER), "-o", str(tmp_path / "out"), "--json"],
        "run": ["run", str(PAPER), "--world", "ideal", "--units", "3", "--wip", "2", "--json"],
    }
    assert entered(words[command]) == set()


def test_a_net_from_elsewhere_does(tmp_path: Path) -> None:
    net = tmp_path / "paper.pnml"
    assert entered(["export", str(PAPER), "--format", "pnml", "-o", str(net)]) == set()
    assert entered(["check", str(net)]) == set(ASIDE)


def test_a_planted_import_shows() -> None:
    assert entered(["check", str(PAPER)], PLANTED) == set(ASIDE)


def test_which_rooms_import_it() -> None:
    house = this_house()
    rooms = {
        module.room
        for module in house.modules.values()
        if any(house.modules[other].room == "apps.foreign_nets" for other in house.imports(module))
    }
    assert {"apps.foreign_nets", "apps.exports"} <= rooms <= OFF_THE_ROAD
