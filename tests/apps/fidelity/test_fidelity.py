"""Every figure of fidelity against known values, and against planted faults."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from factory.apps.fidelity import QUANTITIES
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.support.engine import mujoco
from tests.command_line import Terminal
from tests.paths import PAPER


def test_the_command_prints_figures(run: Terminal, out: Path) -> None:
    words = (PAPER, "--seeds", 1, "--jobs", 1)
    done = run("fidelity", *words, "--json", "-o", out / "figures.json")
    assert done.status == 0
    assert done.json["passed"] is True
    assert done.json["figures"]["handoffs"]["worst"] == 44
    assert {**json.loads((out / "figures.json").read_text()), "warnings": []} == done.json
    told = run("fidelity", *words, "--units", 1, "-v")
    assert told.status == 0
    assert "handoff_gap_max_mm" in told.out
    assert "all runs passed" in told.out
    for key, quantity in QUANTITIES.items():
        assert f"{key} [{quantity.unit}]: {quantity.definition}" in told.out


def test_a_run_that_fails_gives_status_1(run: Terminal) -> None:
    done = run("fidelity", PAPER, "--seeds", 1, "--jobs", 1, "--units", 1, "--max-time", 1)
    assert done.status == 1
    assert "Timeout" in done.err
    assert "SOME RUN FAILED" in done.out


def test_what_cannot_be_written_is_refused_before_anything_runs(run: Terminal, out: Path) -> None:
    done = run("fidelity", PAPER, "-o", out, "--json")
    assert done.status == 2
    assert done.codes == ["BadFile"]
    assert run("fidelity", PAPER, "--seeds", 0).status == 2


MASKS = 'contype="0" conaffinity="0"'
EXCLUDE = '<exclude body1="r1/head" body2="part/a#1"/>'
SCENE = """<mujoco><worldbody>
 <geom name="floor" type="plane" size="1 1 1"/>
 <geom name="r1/rail" type="box" size=".1 .01 .004" pos="0 0 .004"/>
 <geom name="r2/rail" type="box" size=".1 .01 .004" pos="0 {rail} .004"/>
 <body name="r1/carriage" pos="0 0 {height}"><joint type="slide"/>
  <geom name="r1/carriage" type="box" size=".03 .03 .02" {masks}/>
  <body name="r1/shell"><geom name="r1/lid" size=".01" group="1" {masks}/></body>
  <body name="r1/head" pos="{head} 0 0"><joint type="slide" axis="0 0 1"/>
   <geom name="r1/plate" type="cylinder" size=".01 .02" {masks}/></body></body>
 <body name="part/a#1" pos="{x} 0 {height}"><freejoint/>
  <geom name="part/a#1" type="box" size=".02 .02 .02" group="1" {masks}/>
  <geom name="part/a#1/1" type="box" size=".02 .01 .02" group="3" {masks}/></body>
 <body name="part/b#1" pos=".4 .4 -1"><freejoint/><geom name="part/b#1" size=".05"/></body>
 <body name="part/b#2" pos=".4 .4 -1"><freejoint/><geom name="part/b#2" size=".05"/></body>
</worldbody><contact>{exclude}</contact></mujoco>"""
"""A carriage with a lid in it and a head ahead, beside whose plate is a part; two spare parts in
one place below the floor."""


def told(
    x: float = 0.25,
    rail: float = 0.1,
    height: float = 0.1,
    head: float = 0.2,
    masks: str = "",
    exclude: str = "",
) -> dict[tuple[str, str], tuple[float, bool]]:
    """The depths [mm] by pairs, and whether one of them moves."""
    text = SCENE.format(x=x, rail=rail, height=height, head=head, masks=masks, exclude=exclude)
    m = mujoco.MjModel.from_xml_string(text)
    hidden = HiddenPenetrations(m, {})
    hidden.look(m.qpos0, 0.5)
    return {p.geoms: (pytest.approx(p.depth_mm, abs=1e-3), p.moves) for p in hidden.found()}


def test_a_planted_overlap_is_seen_whatever_the_masks_are() -> None:
    """A part's pieces count, and not what is drawn in their place."""
    mm = 0.2
    for masks in ("", MASKS):
        for exclude in ("", EXCLUDE):
            found = told(0.23 - mm * 1e-3, masks=masks, exclude=exclude)
            assert found == {("part/a#1/1", "r1/plate"): (mm, True)}


def test_the_deepest_of_all_times_and_copies_is_kept() -> None:
    m = mujoco.MjModel.from_xml_string(
        SCENE.format(x=1, rail=1, height=0.1, head=0.2, masks="", exclude="")
    )
    hidden = HiddenPenetrations(m, {})
    assert (hidden.found(), hidden.deepest()) == ((), 0.0)
    for time, copies, apart in ((0.1, "12", 0.01), (0.2, "21", 0.03), (0.3, "12", 0.02)):
        qpos = m.qpos0.copy()
        for copy, x in zip(copies, (0.0, apart), strict=True):
            at = int(m.jnt_qposadr[m.body_jntadr[m.body(f"part/b#{copy}").id]])
            qpos[at : at + 3] = 1.0 + x, 1.0, 1.0
        hidden.look(qpos, time)
    (found,) = hidden.found()
    assert (found.geoms, found.time_s) == (("part/b#1", "part/b#2"), 0.1)
    assert found.depth_mm == hidden.deepest() == pytest.approx(90, abs=0.01)
    assert str(found) == "90.000 mm: part/b#1 - part/b#2, at 0.10 s"
