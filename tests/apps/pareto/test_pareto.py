"""The front: no point is as good as another, none is missing that must be there, and each can be
made again from its files."""

from __future__ import annotations

import io
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.few_robots.aim import Least
from factory.apps.pareto import Effort, FrontPoint, FrontSweep, ParetoFront, pareto
from factory.apps.pareto.chart import ChartAxis, cycle_chart
from factory.apps.pareto.front import Trial, commands_of, point_files, tried
from factory.apps.pareto.page import floor_plans, front_page
from factory.pipeline import Project, read
from factory.support import progress
from factory.support.progress import StepBar
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT, files_in
from tests.report_values import EVIL
from tests.screen import Screen
from tests.waiting import until

EXAMPLES = ROOT / "examples"
MESHES = """
root = s;
s = mate ( a, b );
a = atomic ( mesh = "../in/a.stl", pos = ( 0, 0, 0.02 ) );
b = atomic ( mesh = "../in/a.stl", pos = ( 0.1, 0, 0.02 ) );
"""


@pytest.fixture(scope="module")
def front() -> ParetoFront:
    """That of the paper's example."""
    return pareto(read(PAPER))


@pytest.fixture(scope="module")
def quick() -> Project:
    """A product with so many parts that there is something to choose."""
    return read(EXAMPLES / "balanced.pag")


def test_time_that_is_over_leaves_the_product_as_it_is_written(quick: Project) -> None:
    front = pareto(replace(quick), Effort(seconds=1e-6))
    assert front.points == (front.written,)
    assert front.ended == "seconds" and "--seconds" in front.ending


@pytest.mark.parametrize(("count", "numbers"), [(1, [0]), (9, [*range(5)])])
def test_runs_are_spread_over_the_front(front: ParetoFront, count: int, numbers: list[int]) -> None:
    five = replace(front, points=tuple(front.points[:1] * 5))
    assert five.spread(count) == numbers


def test_a_run_is_as_long_as_is_predicted(front: ParetoFront) -> None:
    trial = tried(front.points[0].project)
    assert trial.holds
    assert trial.error is not None
    assert abs(trial.error) < 0.02
    assert trial.ideal is not None


def read_back(file: Path) -> Project:
    """A project as the command line reads it."""
    from factory.commands.requests import ProjectOptions

    return ProjectOptions(file).project()


def test_files_stand_alone_and_stay_in_their_folder(out: Path, own_folder: Path) -> None:
    """Meshes and operations of the user's are copied, by names that lead nowhere else."""
    project = read(own_folder / "pag" / "s.pag", [own_folder / "ops"])
    front = pareto(project, Effort(factories=12))
    files = point_files(front, out / "a" / "b")
    assert all(out / "a" / "b" in path.parents and ".." not in path.parts for path in files)
    for path, content in files.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    assert {path.name for path in files} >= {"a.stl", "plan.json", "layout.json"}
    for name in own_folder.rglob("*.*"):
        name.unlink()
    for number, one in enumerate(front.points):
        again = read_back(out / "a" / "b" / f"p{number + 1:02d}" / "plan.json")
        assert again.laid is not None and again.layout.guidepaths == one.project.layout.guidepaths


@pytest.fixture
def own_folder(out: Path) -> Path:
    """A product with a mesh above it, and an operation of its own."""
    import trimesh

    folder = out / "own"
    for name in ("pag", "in", "ops"):
        (folder / name).mkdir(parents=True)
    trimesh.creation.box((0.04, 0.04, 0.04)).export(folder / "in" / "a.stl")
    mate = (ROOT / "templates" / "mate.op").read_text("utf-8")
    (folder / "ops" / "join.op").write_text(mate.replace("mate =", "join ="), "utf-8")
    text = MESHES.replace("mate", "join")
    (folder / "pag" / "s.pag").write_text(text, "utf-8")
    return folder


def test_the_page_refers_to_nothing_outside_itself(front: ParetoFront, tmp_path: Path) -> None:
    tried_ones = front.with_trial(0, Trial(4, 1.0, 1.01, 1.0)).with_trial(
        1, Trial(4, 1.0, None, None, (f"mujoco: Contact: {EVIL}",))
    )
    evil = replace(tried_ones, name=EVIL, ended="effort")
    plans = floor_plans(evil, tmp_path)
    commands = [f"factory run '{EVIL}'", *commands_of(evil, tmp_path)[1:]]
    text = front_page(evil, commands)
    assert EVIL not in text
    assert not re.search(r'(?:src|href)="(?!#|data:)', text)
    assert "default-src 'none'" in text
    assert text.count('class="plan"') == len(front.points) == len(plans)
    assert all(f'href="#p{n + 1:02d}"' in text for n in range(len(front.points)))
    assert "The search used up its effort after" in text
    assert text == front_page(evil, commands)


def test_a_page_without_layouts(front: ParetoFront) -> None:
    given = [
        replace(p, estimated=p.predicted, predicted=None, area=None, work=None)
        for p in front.points
    ]
    bare = replace(front, points=tuple(given), written=None)
    text = front_page(bare, ["x"] * len(given))
    assert "No layouts." in text
    assert "<img" not in text


def test_axes_have_enough_marks(front: ParetoFront) -> None:
    for values in ([3, 6], [3, 57], [2.5, 3.6], [0.2, 40.0], [7, 7], [1, 1000]):
        axis = ChartAxis.over(values, 0, 100)
        marks = axis.marks()
        assert marks == sorted(marks)
        assert all(0 <= axis.at(mark) <= 100 for mark in marks)
        assert len(marks) >= 1
    assert "<title>as written" in cycle_chart(front)


def test_a_failed_run_is_told(run: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = Trial(4, 1.0, 1.0, 1.0, ("mujoco: Contact: r1 meets r2",))
    monkeypatch.setattr("factory.apps.pareto.front.tried", lambda _: failed)
    done = run("pareto", PAPER, "--validate", 1)
    assert done.status == 1
    assert "failed" in done.out
    assert "r1 meets r2" in done.err


def test_without_layouts_there_is_nothing_to_run(run: Terminal) -> None:
    done = run("pareto", PAPER, "--no-layouts", "--validate", 2, "--json")
    assert done.status == 2
    assert done.codes == ["Usage"]
    done = run("pareto", PAPER, "--no-layouts", "--json")
    assert done.status == 0
    assert all(p["predicted_cycle_time_s"] is None for p in done.json["points"])
    assert all(p["estimated_cycle_time_s"] > 0 for p in done.json["points"])


def test_a_search_that_is_stopped_keeps_what_it_has(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(_: StepBar, what: str, done: int, *words: object) -> None:
        if what == "laying out" and done > 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(StepBar, "show", stop)
    words = "pareto", PAPER, "--validate", 1, "-o", out / "front", "--json"
    done = run(*words)
    assert done.status == 130, done.err
    assert done.codes == ["Interrupted"]
    assert done.json["points"]
    assert not done.json["complete"]
    written = files_in(out / "front")
    assert {str(out / "front" / name) for name in written} == set(done.json["files"])
    assert len(read_back(out / "front" / "p01" / "plan.json").plain.robots) >= 3


def test_a_search_that_is_stopped_at_once_writes_nothing(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(_: FrontSweep) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(FrontSweep, "look", stop)
    done = run("pareto", PAPER, "-o", out / "front", "--json")
    assert done.status == 130
    assert done.codes == ["Interrupted"]
    assert "points" not in done.json
    assert not (out / "front").exists()


def test_a_search_shows_how_far_it_is(run: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    with StepBar("looking") as steps:
        steps.show("laying out", 3, 12, "5 points")
        steps.show("running", 1, None)
        until(lambda: "running" in screen.getvalue())
    lines = io.StringIO()
    monkeypatch.setattr(sys, "stderr", lines)
    monkeypatch.setattr(progress, "LINES", 0.01)
    with StepBar("looking") as steps:
        steps.show("laying out", 3, 12, "5 points")
        until(lambda: "laying out: 3 of 12, 5 points, " in lines.getvalue())


def test_a_search_for_few_robots_can_be_stopped(run: Terminal, monkeypatch) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(StepBar, "show", stop)
    done = run("check", PAPER, "--robots", "least", "--json")
    assert done.status == 130
    assert done.codes == ["Interrupted"]


PROJECT = read(PAPER)


def point(robots: int, seconds: float, area: float | None) -> FrontPoint:
    return FrontPoint(PROJECT, robots, 0, None, seconds, area)


def test_a_page_says_how_many_runs_were_as_predicted() -> None:
    point = FrontPoint(PROJECT, 3, 0, None, 1.0, 1.0, 2.0)
    front = ParetoFront("x", (point, replace(point, robots=4)), Least(1, 0, (("x", 1),)))
    assert "Run in both worlds" not in front_page(front, ["x", "x"])
    tried_ones = front.with_trial(0, Trial(4, 1.0, 1.01, 1.0)).with_trial(
        1, Trial(4, 1.0, 1.04, 1.0)
    )
    card = '<h3>Run in both worlds</h3><p class="value"><span class="bad">1 of 2</span></p>'
    assert card in front_page(tried_ones, ["x", "x"])


def test_a_folder_that_cannot_be_written_is_refused_before_the_search(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def search(*words: object) -> None:
        raise AssertionError("a search began")

    monkeypatch.setattr("factory.apps.pareto.command_line.pareto._found", search)
    (tmp_path / "file").write_text("")
    done = run("pareto", PAPER, "-o", tmp_path / "file" / "front")
    assert done.status == 2 and "is a file, not a folder" in done.err
