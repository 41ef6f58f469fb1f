"""What is written of a cell, and what does not go with one yet: no command gives a traceback, or a
file that says something else."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from factory.api import FactoryError, Layout, Project, RunRequest, Simulation
from factory.apps.arms import planning
from factory.apps.arms.ground import with_arm
from factory.apps.arms.joint_table import legs_of
from factory.apps.arms.legs import NoWay
from factory.apps.exports import exporters
from factory.apps.exports.chain_rest import joints_at_rest
from factory.apps.exports.stock import write
from factory.apps.exports.writing import export, exporter
from factory.apps.live.page import stage_of
from factory.apps.recovery import recover
from factory.engine.mjcf.loading import load
from factory.engine.simulation.modelling import physical_model
from factory.pipeline import read
from tests.command_line import Terminal
from tests.paths import ROOT

DRIVE = ROOT / "examples" / "cells" / "drive.pag"

SMALL = """
root = unit;
unit = mate ( filled, lid );
filled = mate ( tub, motor );
tub = atomic ( box = (0.12, 0.08, 0.03), pos = (0, 0, 0.015), density = 1200 );
motor = atomic ( box = (0.05, 0.03, 0.024), pos = (-0.028, 0.018, 0.0421), density = 2500 );
lid = atomic ( box = (0.12, 0.08, 0.006), pos = (0, 0, 0.0573), density = 1200 )
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Project:
    file = tmp_path_factory.mktemp("cell") / "small.pag"
    file.write_text(SMALL)
    return with_arm(read(file), "six")


def laid(project: Project) -> Layout:
    return project.layout


def test_the_program_tells_each_leg_and_that_it_is_not_certified(small: Project) -> None:
    text, _ = export(exporter("arm-program"), small.file, small)
    assert isinstance(text, str) and "is not\n# certified" in text
    assert re.findall(r"^  # (\w+)", text, re.M) == ["fetch", "place"] * 2
    assert text.count("set_vacuum(True)") == text.count("set_vacuum(False)") == 2
    assert text.count("wait_part") == text.count("wait_carrier") == 2
    (past,) = re.findall(r"when_past\(x=([\d.]+)\)  # then dropoff", text)
    path = laid(small).guidepaths[1]
    assert path.reach < float(past) < path.length
    last = re.findall(r"movel\(\[(.*?)\]\)", text)[-1]
    assert np.allclose(
        [*map(float, last.split(","))], legs_of(laid(small), 1)[-1].way.places[-1], atol=1e-4
    )


def test_a_folder_gets_a_file_for_every_arm(small: Project, tmp_path: Path) -> None:
    for form, name in (("joints", "small.r2.joints.csv"), ("arm-program", "small.r2.program.txt")):
        _, files = export(exporter(form), small.file, small, tmp_path)
        assert [*files] == [tmp_path / name]
    with pytest.raises(FactoryError, match="--of 'r1' is none of the arms"):
        export(exporter("joints", "r1"), small.file, small, of="r1")


def test_the_written_model_stands_still_in_its_keyframe(small: Project) -> None:
    """Each arm is held where a run starts, against gravity, by the setpoints of the keyframe."""
    model = physical_model(laid(small), 1, small.settings, small.catalogue, finish=write)
    m, rests = load(model), joints_at_rest(laid(small))
    d = mujoco.MjData(m)
    mujoco.mj_resetDataKeyframe(m, d, m.key("home").id)
    begin = legs_of(laid(small), 1)[0].way.places[-1]
    assert np.allclose([d.joint(rest.joint).qpos[0] for rest in rests], begin, atol=1e-6)
    for _ in range(250):
        mujoco.mj_step(m, d)
    off = [d.joint(rest.joint).qpos[0] - rest.position for rest in rests]
    assert np.abs(off).max() < 1e-4
    assert all(abs(rest.setpoint - rest.position) < 0.05 for rest in rests)
    assert max(abs(rest.setpoint - rest.position) for rest in rests) > 1e-4


def test_each_format_is_right_for_a_cell_or_refused(small: Project) -> None:
    """A format that tells of guidepaths is refused by name; all others are written."""
    for one in exporters().values():
        if one.takes == "log":
            continue
        if one.rails:
            with pytest.raises(FactoryError, match=f"format {one.format} cannot be combined"):
                export(one, small.file, small)
        else:
            assert export(one, small.file, small)[0]
    assert {one.format for one in exporters().values() if one.rails} == {"dxf", "urdf"}


def test_no_way_names_what_is_in_the_way(small: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the search for a way gives up; both places and the line of the PAG are told."""
    monkeypatch.setattr(planning, "leg", lambda *_, **__: NoWay(1, 0.004, 9))
    with pytest.raises(FactoryError) as caught:
        with_arm(read(small.file), "six").layout  # noqa: B018
    (told,) = caught.value.diagnostics
    assert told.code == "NoWay" and told.position and told.position.line == 6
    assert re.fullmatch(
        r"r2 finds no way from 'lid' to 'motor': .+ and .+ come 4.0 mm nearer to each other than"
        " they may",
        told.message,
    )
    assert told.hint == "leave out --arm: rails make it"


def test_a_page_shows_where_an_arm_places(small: Project) -> None:
    """Both parts are placed where the carrier stands in a run."""
    made = Simulation(laid(small), RunRequest(units=1))
    ((place, labels),) = stage_of(made).stations.items()
    assert sorted(labels) == ["filled", "unit"]
    while not any(event.transition == "filled_e" for event in made.supervisor.events):
        made.supervisor.step()
    assert made.physical.d.site("r1/nest").xpos[:2] == pytest.approx(place, abs=1e-3)


REFUSED = [(("view",), ("--spares", "1", "--port", "0"), "--spares")]


@pytest.mark.parametrize(("command", "options", "what"), REFUSED)
def test_what_does_not_go_with_a_cell_is_refused_at_once(
    command: tuple[str, ...],
    options: tuple[str, ...],
    what: str,
    run: Terminal,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In one message, before anything is laid out; nothing is written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Project, "layout", property(lambda _: pytest.fail("it is laid out")))
    Path("faults.toml").write_text('[[fault]]\nkind = "drop"\nlabel = "motor"\nunit = 1\n')
    done = run(*command, DRIVE, "--arm", "six", *options)
    assert done.status == 2
    (said,) = [line for line in done.err.splitlines() if line.startswith("Usage ")]
    assert f"{what} cannot be combined with --arm yet: r2 is a 'six'" in said
    assert not [path for path in tmp_path.iterdir() if path.name.startswith("made")]


@pytest.mark.parametrize("command", ["check", "run", "build", "view"])
@pytest.mark.parametrize("option", ["--relay", "--platen", "--robots=4", "--floor=3x3"])
def test_options_of_rails_are_refused(command: str, option: str, run: Terminal) -> None:
    if option in ("--platen", "--floor=3x3") and command == "check":
        pytest.skip("check lays nothing out")
    done = run(command, DRIVE, "--arm", "six", option)
    assert (
        done.status == 2 and f"--arm cannot be combined with {option.partition('=')[0]}" in done.err
    )


def test_a_table_of_joints_needs_arms(run: Terminal) -> None:
    for form in ("joints", "arm-program"):
        done = run("export", DRIVE, "--format", form)
        assert done.status == 2 and "is about arms" in done.err and "--arm six" in done.err


def test_no_recovery_of_a_cell_is_made_from_python(small: Project) -> None:
    """Whoever asks: it is refused where it is made."""
    made = Simulation(laid(small), RunRequest("ideal", 1, recovers=True))
    with pytest.raises(FactoryError, match=r"recovery .* cannot be combined"):
        recover(made)
