"""Tees: two branches come to one place from one side, over a stem that they share."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from factory.apps.few_robots.parallel import in_parallel
from factory.apps.few_robots.sharing import with_branches, with_tees
from factory.apps.runs.watched import watched
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import Run
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.clearance import certify
from factory.floor.layout.layout import Layout
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import Project
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.compiler.tees import on_stems
from factory.theory.lang.template_reader import all_templates
from factory.theory.nets.verify import verify
from factory.theory.problem.pag import PAG, Parameter
from factory.theory.problem.template import Template
from tests.command_line import Terminal
from tests.fold_values import branched, plain, table_of
from tests.pag_values import paper

SLOW = 4.0
"""How long a feeder takes, or a branch [s]."""

FED = (
    ("sub2", "mate", ("sub1", "part3")),
    ("sub1", "mate", ("part1", "part2")),
    ("part1", "atomic", ()),
    ("part2", "atomic", ()),
    ("part3", "feed", ()),
)


def feed() -> Template:
    """A feeder that takes its time."""
    atomic = all_templates()["atomic"]
    return replace(atomic, name="feed", law=replace(atomic.law, dwell=SLOW))


@cache
def project(branches: int, label: str = "part3", rows: tuple[object, ...] = FED) -> Project:
    """A product whose slow part comes to a mate, in so many branches."""
    pag: PAG = table_of(rows)  # type: ignore[arg-type]
    nodes = tuple(
        replace(node, parameters=(Parameter("dwell", SLOW),)) if node.operation == "glue" else node
        for node in pag.nodes
    )
    templates = {**all_templates(), "feed": feed()}
    made = Project(replace(pag, nodes=nodes), templates, load_catalogue(), Settings())
    return with_branches(made, [(label, branches)])


def carried_out(layout: Layout, units: int = 10, **more: object) -> Run:
    """A run in the engine, with its monitor."""
    request = RunRequest("mujoco", units, **more)  # type: ignore[arg-type]
    return watched(Simulation(layout, request), every_tick=True)


def test_the_factory_on_stems_is_that_of_one_branch_unit_by_unit() -> None:
    """With each operation where it was, its net live."""
    factory = branched(plain(paper()), ("sub2", 2))
    stems, place = on_stems(factory)
    assert len(stems.robots) == len(plain(paper()).robots)
    assert verify(stems.net).holds
    for one, other in zip(factory.operations, stems.operations, strict=True):
        assert (one.label, tuple(place[r] for r in one.robots)) == (other.label, other.robots)
    assert [len(tours) for tours in stems.tours] == [2] * len(stems.robots)


def on_stem(layout: Layout) -> tuple[int, int]:
    """The robots (index) that share a stem."""
    one, other = sorted(layout.stems)
    return one, other


def test_a_short_arm_is_found() -> None:
    """The planted fault: the robot that waits is in the way of the one that rounds the corner."""
    made = project(2)
    layout = made.layout
    one, other = on_stem(layout)
    paths = list(layout.guidepaths)
    paths[one] = replace(paths[one], travel=round(paths[one].travel - 0.08, 3))
    length = paths[one].length
    visits = {
        (number, robot): replace(visit, at=min(visit.at, length)) if robot == one else visit
        for (number, robot), visit in layout.visits.items()
    }
    certificate = certify(replace(layout, guidepaths=tuple(paths), visits=visits))
    assert any("come" in fault.message or "apart" in fault.message for fault in certificate.faults)
    assert not certificate.holds and other


def test_logs_and_plans_keep_bends(run: Terminal, tmp_path: Path) -> None:
    """What is recorded is explained and rendered again; a plan makes the same layout."""
    log, folder = tmp_path / "tee.log", tmp_path / "made"
    asked = "examples/paper.pag", "--parallel", "part3=2"
    made = run("run", *asked, "--units", 2, "--log", log, "--json").json
    assert made["refines_net"] and made["unintended_contacts"] == 0
    seen = run("monitor", log, "--json")
    assert seen.status == 0
    run("build", *asked, "-o", folder, "-q")
    again = run("run", folder / "plan.json", "--units", 2, "--json").json
    assert again["events"] == made["events"]


def test_a_branch_of_a_tee_is_not_replicated_itself() -> None:
    with pytest.raises(InputError, match="is in the branch of 'sub2', which comes over a tee"):
        in_parallel(plain(paper()), (("sub2", 2), ("part1", 2)))


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (("part3", "part1"), "cannot share a stem: they deliver to different robots"),
        (("part1", "part2", "part3"), "has room for 2 robots"),
    ],
)
def test_bad_tees(labels: tuple[str, ...], words: str) -> None:
    made = Project(paper(), all_templates(), load_catalogue(), Settings())
    with pytest.raises(InputError, match=words) as error:
        with_tees(made, [labels])
    assert error.value.diagnostics[0].code == "BadTee"


def check_jitter(seeds: range, units: int) -> None:
    """Robots whose speeds differ by 30 % never stall, nor touch."""
    for seed in seeds:
        made = carried_out(project(2).layout, units, seed=seed, jitter=0.3)
        assert made.succeeded and made.units == units


@pytest.mark.slow
def test_twenty_seeds() -> None:
    check_jitter(range(20), 20)
