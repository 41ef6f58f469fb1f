"""Bins: clear of all regions, and what is scrap falls into them for real."""

from __future__ import annotations

from dataclasses import replace

import pytest

import factory.engine.simulation.modelling as modelling
from factory.apps.deviations import Deviation
from factory.commands.summaries import say_failures
from factory.engine.record.failures import Failures
from factory.engine.simulation.request import RunRequest
from factory.floor.layout import bins
from factory.floor.layout.bins import Bin, bins_of
from factory.floor.layout.certificate import BIN_BODY, Region
from factory.floor.layout.crowding import Crowding
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import piles, regions
from tests.apps.recovery.test_recovery import assert_recovered, run_with
from tests.simulation_values import layout_of


def bin_regions(layout: Layout, made: tuple[Bin, ...]) -> list[Region]:
    """The floor that bins take, and the ways of things into them."""
    by_label = piles(layout.factory, layout.product)
    result = list[Region]()
    for one in made:
        held = bins._held(layout, one.robot, by_label, frozenset())
        flown = [each for each in held if each[0] in one.labels]
        result += [*bins._stands(one), *bins._flights(one, flown)]
    return result


def unsettled(layout: Layout, made: tuple[Bin, ...]) -> list[tuple[Region, Region]]:
    """Pairs of regions that are too near, one of a bin or of what flies into it."""
    others = regions(layout, piles(layout.factory, layout.product))
    added = bin_regions(layout, made)
    mine, swept = {id(region) for region in added}, [*others, *added]
    return [
        (one, other)
        for one, other in Crowding(layout).crowded(swept)
        if not mine.isdisjoint((id(one), id(other))) and not {id(one), id(other)} <= flights(added)
    ]


def flights(added: list[Region]) -> set[int]:
    """What flies: two robots that throw things away at once are each other's fallen things."""
    return {id(region) for region in added if region.kind != BIN_BODY}


@pytest.mark.parametrize("name", ["paper", "chest"])
def test_bins_are_clear_of_everything(name: str) -> None:
    layout = layout_of(name)
    made = bins_of(layout)
    assert made and unsettled(layout, made) == []
    assert len({one.robot for one in made}) == len(made)


def test_a_bin_elsewhere_is_found() -> None:
    layout = layout_of("paper")
    one, *others = bins_of(layout)
    x, y = layout.guidepaths[one.robot].carriage(layout.guidepaths[one.robot].length)
    on_the_lane = replace(one, box=(x - 0.03, x + 0.03, y - 0.03, y + 0.03))
    assert unsettled(layout, (on_the_lane, *others))


def test_runs_without_faults_have_none() -> None:
    layout = layout_of("paper")
    plain, recovering = (
        modelling.modelled(layout, RunRequest(recovers=recovers), {}).xml
        for recovers in (False, True)
    )
    assert "bin/" not in plain and recovering.count('name="bin/r6"') == 1


SLIPS = tuple(Deviation("bad_joint", label="sub1", unit=2, metres=2e-3) for _ in range(3))
"""Done again twice, then the inputs are scrapped."""


@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_scrap_falls_into_its_bin(jitter: float) -> None:
    run, failures = run_with(*SLIPS, jitter=jitter)
    assert_recovered(run, failures, {"bad_joint": 3})
    assert failures.found[-1].scrapped == ("part1", "part2")
    assert (failures.binned, failures.spilled) == (2, ())


def test_where_there_is_no_bin_the_run_says_so() -> None:
    slips = [replace(slip, label="sub3") for slip in SLIPS]
    run, failures = run_with(*slips)
    assert_recovered(run, failures, {"bad_joint": 3})
    assert (failures.binned, failures.spilled) == (1, ("r3",))


def test_a_robot_that_touches_a_bin_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    layout = layout_of("paper")
    one, *others = bins_of(layout)
    path = layout.guidepaths[one.robot]
    x, y = path.carriage(path.length - 0.06)
    planted = replace(one, box=(x - 0.01, x + 0.01, y - 0.02, y + 0.02))
    monkeypatch.setattr(modelling, "bins_of", lambda layout: (planted, *others))
    run, _ = run_with(layout=layout, max_time=3.0)
    assert run.physics is not None and run.physics.unintended_contacts
    assert any("bin/" in pair for pair in run.physics.contacts)


@pytest.mark.parametrize(
    ("spilled", "words"),
    [
        ((), "scrap in bins: 3\n"),
        (("r1", "r4"), "scrap in bins: 3; no bin for the scrap of r1, r4\n"),
    ],
)
def test_bins_are_told_in_words(
    capsys: pytest.CaptureFixture[str], spilled: tuple[str, ...], words: str
) -> None:
    say_failures(replace(Failures(), binned=3, spilled=spilled), False)
    assert words in "".join(capsys.readouterr())
