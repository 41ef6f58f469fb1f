"""Regression: the figures of some products against what is kept in tests/baselines.

`make golden`, or pytest --update-golden, renews them: review the diff.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import pytest

import factory
from factory.apps.fidelity import QUANTITIES, measure_seed
from factory.apps.fidelity.comparing import Alter, Case
from factory.apps.fidelity.record import Figures
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.settings import Settings
from tests.paths import TESTS

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


LARGE = {"gearbox": pytest.param("gearbox", marks=pytest.mark.slow)}


@pytest.mark.parametrize("name", [LARGE.get(name, name) for name in PRODUCTS])
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


@pytest.mark.parametrize("name", ["paper", pytest.param("meshes", marks=pytest.mark.slow)])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_caught(name: str, fault: str) -> None:
    alter, expected = FAULTS[fault]
    told = deviations(figures(name, alter), kept(name))
    assert expected <= set(told), told
