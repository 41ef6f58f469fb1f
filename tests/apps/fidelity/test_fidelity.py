"""Every figure of fidelity against known values, and against planted faults."""

from __future__ import annotations

import json
from functools import cache, partial
from pathlib import Path

import pytest

import factory
from benches.fidelity.convergence import soften
from factory.apps.analyze.measured import operation_times
from factory.apps.fidelity import QUANTITIES, SeedRecord, measure, measure_seed
from factory.apps.fidelity.comparing import Alter, Case
from factory.apps.fidelity.record import Fidelity
from factory.floor.layout.layout import Layout
from factory.support.engine import mujoco
from factory.support.settings import Settings
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT


@cache
def layout(name: str = "paper") -> Layout:
    path = PAPER if name == "paper" else ROOT / "tests" / "baselines" / f"{name}.pag"
    return factory.lay_out(factory.compile(factory.load_pag(path)))


FINE = Settings(timestep=0.002)
"""Faults in welds and drives are planted at 2 ms: a weld is no stiffer than two timesteps."""


@cache
def good(name: str = "paper", settings: Settings = FINE) -> SeedRecord:
    return measure_seed(Case(layout(name), units=2, settings=settings), 1)


def altered(alter: Alter, units: int = 2) -> SeedRecord:
    return measure_seed(Case(layout(), units, settings=FINE, max_time=30, alter=alter), 1)


def figure(record: SeedRecord, key: str) -> float:
    value = record.figures[key]
    assert value is not None
    return value


@pytest.mark.parametrize("settings", [FINE, Settings()])
def test_a_good_run_keeps_every_limit(settings: Settings) -> None:
    for name in ("paper", "kary", "meshes", "unary"):
        record = good(name, settings)
        assert record.passed
        for key, quantity in QUANTITIES.items():
            assert not quantity.exceeded(record.figures[key]), (name, key, record.figures[key])


# --- planted in the engine -------------------------------------------------------------------


@pytest.mark.parametrize("metres", [1e-3, 5e-3])
def test_a_misplaced_grip_shows_in_the_gap(metres: float) -> None:
    """r3 holds part1 beside its place."""

    def misplaced(m: mujoco.MjModel) -> None:
        m.eq_data[m.equality("grip/r3/part1").id, 3] += metres

    record = altered(misplaced)
    assert figure(record, "handoff_gap_max_mm") == pytest.approx(1e3 * metres, abs=0.12)
    assert QUANTITIES["handoff_gap_max_mm"].exceeded(record.figures["handoff_gap_max_mm"])


def test_softer_welds_show_in_the_residual() -> None:
    """Once they give more under load than a hand-over leaves for a moment."""
    softer = altered(partial(soften, factor=16.0))
    assert figure(softer, "weld_residual_max_mm") > 8 * figure(good(), "weld_residual_max_mm")


def test_weak_drives_saturate_and_lag() -> None:
    def weak(m: mujoco.MjModel) -> None:
        m.actuator_forcerange[:] *= 0.3

    record = altered(weak)
    assert figure(good(), "force_saturated_percent") == 0
    assert figure(record, "force_saturated_percent") > 1
    assert figure(record, "force_peak_percent") == pytest.approx(100)
    assert figure(record, "tracking_error_max_mm") > 5 * figure(good(), "tracking_error_max_mm")


def test_slack_drives_track_badly() -> None:
    def slack(m: mujoco.MjModel) -> None:
        m.actuator_gainprm[:, 0] *= 0.25
        m.actuator_biasprm[:, 1] *= 0.25

    record = altered(slack)
    assert figure(record, "tracking_error_max_mm") > 1.2 * figure(good(), "tracking_error_max_mm")


def test_a_shifted_grip_of_the_output_robot_shows_in_the_product() -> None:
    def shift(m: mujoco.MjModel) -> None:
        m.eq_data[m.equality("grip/r1/part2").id, 3] += 1e-3
        m.eq_data[m.equality("hold/part2").id, 4] += 1e-3

    record = altered(shift)
    assert figure(record, "product_error_max_mm") > 0.9
    assert QUANTITIES["product_error_max_mm"].exceeded(record.figures["product_error_max_mm"])


def test_a_robot_beside_its_place_touches_and_fails() -> None:
    def beside(m: mujoco.MjModel) -> None:
        m.body_pos[m.body("r5/carriage").id, 0] -= 22e-3

    record = altered(beside)
    assert figure(record, "unintended_contacts") > 0
    assert not record.passed


def test_a_stalled_run_is_told_and_fails() -> None:
    def dead(m: mujoco.MjModel) -> None:
        m.actuator_forcerange[:] = [-0.01, 0.01]

    record = altered(dead)
    assert not record.passed
    codes = [one.code for one in record.trouble]
    assert codes[0] == "Altered", "the model is no longer the one that was compiled"
    assert codes[1] == "Contact", "the shutter falls onto the belt"
    assert {"Stalled", "Timeout"} & {*codes}
    assert record.figures["product_error_max_mm"] is None


# --- many seeds ------------------------------------------------------------------------------


def test_the_nth_time_of_an_operation_is_its_duration() -> None:
    factory = layout().factory
    a, b, c = factory.operations[:3]
    firings = [(a.start, 0.0), (b.start, 0.1), (a.end, 0.5), (a.start, 0.7), (a.end, 1.0)]
    spent = operation_times(factory, [*firings, (c.end, 1.1)])
    assert spent[:3] == [[0.5, pytest.approx(0.3)], [], []]


def test_processes_give_the_same_figures() -> None:
    finished: list[int] = []
    alone = measure(layout(), range(2), units=2)
    shared = measure(layout(), range(2), units=2, jobs=2, done=finished.append)
    assert [r.figures for r in alone.seeds] == [r.figures for r in shared.seeds]
    assert finished == [1, 2]
    assert alone.worst()["handoff_gap_max_mm"] == max(alone.values("handoff_gap_max_mm"))


# --- the command -----------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    ("units", "words"), [((4, 4), "2 seeds, 4 units"), ((9, 4, 61), "3 seeds, 4 to 61 units")]
)
def test_runs_are_counted_from_the_fewest_units_to_the_most(units, words: str) -> None:
    seeds = tuple(SeedRecord(seed, count, {}) for seed, count in enumerate(units))
    assert Fidelity("x", 3, 0.3, seeds).runs == words
