"""Regression: the figures of some products against what is kept in tests/baselines. `make golden`,
or pytest --update-golden, renews them: review the diff. Every figure of fidelity against known
values, and against planted faults."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

import factory
from factory.apps.fidelity import QUANTITIES, SeedRecord, measure_seed
from factory.apps.fidelity.comparing import Alter, Case
from factory.apps.fidelity.hidden import HiddenPenetrations
from factory.apps.fidelity.record import Fidelity, Figures
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.paths import PAPER, TESTS
from tests.slow import slow_but

FOLDER = TESTS / "baselines"
EXAMPLES = FOLDER.parent.parent / "examples"
PRODUCTS = {
    "paper": EXAMPLES / "paper.pag",
    "gearbox": EXAMPLES / "gearbox.pag",
    **{
        name: FOLDER / f"{name}.pag"
        for name in ("chain", "tree", "unary", "kary", "meshes", "fence")
    },
}
SEED, JITTER, DIGITS = 1, 0.3, 9
SETTINGS = Settings(timestep=0.002)
"""The figures are those of 2 ms, whatever the factory would choose."""

UNITS = {"gearbox": 2}
"""Units of the large products, to save time; 4 of all others, which gives a cycle time."""


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far a figure may be from its baseline: absolute + relative x |baseline|; and why."""

    reason: str
    absolute: float = 0.0
    relative: float = 0.0

    def of(self, value: float) -> float:
        return self.absolute + self.relative * abs(value)


TOLERANCES = {
    key: Tolerance(**entry)
    for key, entry in tomllib.loads((FOLDER / "tolerances.toml").read_text("utf-8")).items()
}


def deviations(found: Figures, expected: Figures) -> dict[str, str]:
    """For each figure outside its tolerance: the expected value, the found one, the difference."""
    told: dict[str, str] = {}
    for key, tolerance in TOLERANCES.items():
        one, other = found.get(key), expected.get(key)
        if one is None or other is None:
            if one is not other:
                told[key] = f"{key}: expected {other}, found {one}"
            continue
        off, allowed = one - other, tolerance.of(other)
        if not abs(off) <= allowed:
            told[key] = (
                f"{key}: expected {other:.6g}, found {one:.6g} {QUANTITIES[key].unit}; "
                f"off by {off:+.3g}, {allowed:.3g} is allowed since {tolerance.reason}"
            )
    return told


@cache
def layout(name: str) -> Layout:
    return factory.lay_out(factory.compile(factory.load_pag(PRODUCTS[name])))


def figures(name: str, alter: Alter | None = None, settings: Settings | None = None) -> Figures:
    case = Case(
        layout(name), UNITS.get(name, 4), JITTER, settings or SETTINGS, max_time=120, alter=alter
    )
    return measure_seed(case, SEED).figures


def rounded(value: float | None) -> float | None:
    """A figure as it is kept: nine digits, and 0 below what can be measured."""
    return None if value is None else round(float(f"{value:.{DIGITS}g}"), 12)


def kept(name: str) -> Mapping[str, float | None]:
    path = FOLDER / f"{name}.json"
    assert path.is_file(), f"{path} is missing: run pytest --update-golden and look at it"
    return dict(json.loads(path.read_text("utf-8"))["figures"])


@pytest.mark.parametrize("name", slow_but(["paper", "unary"], PRODUCTS))
def test_figures_stay_within_tolerance(name: str, request: pytest.FixtureRequest) -> None:
    found = {key: rounded(value) for key, value in figures(name).items()}
    if request.config.getoption("--update-golden"):
        head = {"product": name, "seed": SEED, "units": UNITS.get(name, 4), "jitter": JITTER}
        text = json.dumps({**head, "figures": found}, indent=1) + "\n"
        (FOLDER / f"{name}.json").write_text(text, encoding="utf-8", newline="\n")
    told = deviations(found, kept(name))
    assert not told, f"{name}:\n  " + "\n  ".join(told.values())


def test_every_figure_has_a_tolerance_with_its_reason() -> None:
    assert list(TOLERANCES) == list(QUANTITIES)
    for key, tolerance in TOLERANCES.items():
        assert len(tolerance.reason.split()) >= 4, key
        assert 0 <= tolerance.relative <= 0.15, key


def test_a_deviation_is_told_in_full() -> None:
    expected = dict(kept("paper"))
    found = {**expected, "handoff_gap_max_mm": (expected["handoff_gap_max_mm"] or 0.0) + 0.5}
    told = deviations(found, expected)
    assert list(told) == ["handoff_gap_max_mm"]
    message = told["handoff_gap_max_mm"]
    assert "handoff_gap_max_mm: expected 0.0" in message
    assert "off by +0.5" in message
    assert "allowed since where exactly a drive comes to rest" in message
    assert deviations({**expected, "cycle_time_s": None}, expected)
    assert deviations({**expected, "cycle_time_s": float("nan")}, expected)
    assert not deviations(expected, expected)


def softer_welds(m: mujoco.MjModel) -> None:
    m.eq_solref[:, 0] *= 1.5


def softer_impedance(m: mujoco.MjModel) -> None:
    m.eq_solimp[:, :2] = 0.8, 0.9


def shifted_site(m: mujoco.MjModel) -> None:
    """Where r1 holds the first part."""
    m.eq_data[next(i for i in range(m.neq) if m.equality(i).name.startswith("grip/r1/")), 3] += 2e-4


def shifted_robot(m: mujoco.MjModel) -> None:
    m.body_pos[m.body("r2/carriage").id, :2] += 1e-3


def wrong_mass(m: mujoco.MjModel) -> None:
    part = next(i for i in range(m.nbody) if m.body(i).name.startswith("part/"))
    m.body_mass[part] *= 1.02
    m.body_inertia[part] *= 1.02
    mujoco.mj_setConst(m, mujoco.MjData(m))


def implicit(m: mujoco.MjModel) -> None:
    m.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


def weaker_drives(m: mujoco.MjModel) -> None:
    m.actuator_forcerange[:] *= 0.95


FAULTS: dict[str, tuple[Alter, set[str]]] = {
    "softer welds": (softer_welds, {"weld_residual_max_mm"}),
    "softer impedance": (softer_impedance, {"weld_residual_max_mm"}),
    "a shifted site": (shifted_site, {"handoff_gap_max_mm"}),
    "a shifted robot": (shifted_robot, {"handoff_gap_max_mm"}),
    "a wrong mass": (wrong_mass, {"moved_mass_kg"}),
    "an implicit method": (implicit, {"drive_work_J", "force_peak_percent"}),
    "weaker drives": (weaker_drives, {"force_peak_percent"}),
}


@pytest.mark.parametrize("name", slow_but(["paper"], ["paper", "meshes"]))
@pytest.mark.parametrize("fault", slow_but(["a shifted site", "a wrong mass"], FAULTS))
def test_a_planted_fault_is_caught(name: str, fault: str) -> None:
    alter, expected = FAULTS[fault]
    told = deviations(figures(name, alter), kept(name))
    assert expected <= set(told), told


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


@pytest.mark.parametrize(
    ("units", "words"), [((4, 4), "2 seeds, 4 units"), ((9, 4, 61), "3 seeds, 4 to 61 units")]
)
def test_runs_are_counted_from_the_fewest_units_to_the_most(units, words: str) -> None:
    seeds = tuple(SeedRecord(seed, count, {}) for seed, count in enumerate(units))
    assert Fidelity("x", 3, 0.3, seeds).runs == words
