"""`factory make`: from a folder of CAD to a film and a page, and where it stops."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh

from tests.command_line import Terminal
from tests.paths import ROOT

BROKEN = "root = a;\na = mate ( b, b );\nb = atomic ();\n"


def test_a_pag_becomes_a_film_and_a_page(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FACTORY_SIZE", "64x48")
    monkeypatch.setenv("FACTORY_FPS", "2")
    folder = tmp_path / "made"
    done = run("make", ROOT / "examples" / "paper.pag", "-o", folder, "--units", 2)
    assert done.status == 0, done.err
    commands = [line.split()[2] for line in done.out.splitlines() if line.startswith("$ factory")]
    assert commands == ["check", "run", "render", "report"]
    assert {path.name for path in folder.iterdir()} == {"paper.log", "paper.mp4", "paper.html"}
    assert "2 of 2 products" in done.out


@pytest.mark.slow
def test_a_folder_of_cad_becomes_a_running_cell(run: Terminal, tmp_path: Path) -> None:
    """That of the tutorial: one driver for four screws, at most 13 robots."""
    cad = tmp_path / "gadget"
    subprocess.run([sys.executable, ROOT / "examples" / "make_gadget.py", cad], check=True)
    done = run("make", cad, "-o", tmp_path / "made", "--units", 2, "--unit", "mm", "--json")
    assert done.status == 0
    assert [step["status"] for step in done.json["steps"]] == [0] * 5
    names = {Path(file).name for file in done.json["files"]}
    assert {"gadget.pag", "gadget-exploded.png", "gadget.log", "gadget.mp4"} <= names
    checked = run("check", tmp_path / "made" / "gadget.pag", "--json").json
    assert checked["robots"] <= 13
    assert [gear["type"] for gear in checked["gears"]].count("tool") == 1


def test_it_stops_where_a_person_has_to_decide(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "broken.pag"
    file.write_text(BROKEN)
    done = run("make", file, "-o", tmp_path / "made")
    assert done.status == 2
    assert done.out.splitlines()[-1] == (
        f"stopped at `factory check`: correct {file}, or allow what it names; then"
        f" factory make {file} -o {tmp_path / 'made'}"
    )
    assert "PagNotTree" in done.err
    assert not (tmp_path / "made").exists()
    found = run("make", file, "-o", tmp_path / "made", "--json")
    assert (found.status, found.json["stopped"], found.json["files"]) == (2, "check", [])
    assert found.json["steps"][0]["errors"][0]["code"] == "PagNotTree"


def test_it_goes_on_from_the_plan_that_was_just_written(run: Terminal, tmp_path: Path) -> None:
    """Whatever else is in the folder."""
    folder = tmp_path / "made"
    folder.mkdir()
    (folder / "zzz.pag").write_text(BROKEN)
    os.utime(folder / "zzz.pag", (0, 0))
    cad = tmp_path / "two"
    cad.mkdir()
    for name, at in (("base", 0.0), ("block", 10.0)):
        solid = trimesh.creation.box((30.0, 30.0, 10.0))
        solid.apply_translation((0.0, 0.0, at))
        solid.export(cad / f"{name}.stl")
    done = run("make", cad, "-o", folder, "--unit", "mm", "--units", 1, "--json")
    assert (done.status, done.json["stopped"]) == (0, None)
    assert f"factory check {folder / 'two.pag'}" in {step["command"] for step in done.json["steps"]}


def test_what_is_missing_ends_with_plan(run: Terminal, tmp_path: Path) -> None:
    done = run("make", tmp_path / "nothing", "-o", tmp_path / "made")
    assert (done.status, "stopped at `factory plan`" in done.out) == (2, True)
