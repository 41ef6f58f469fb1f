"""The front: no point is as good as another, none is missing that must be there, and each can be
made again from its files."""

from __future__ import annotations

import io
import re
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from factory.apps.few_robots.aim import Least, least_robots
from factory.apps.pareto import Effort, FrontPoint, FrontSweep, ParetoFront, pareto, sweeping
from factory.apps.pareto.chart import ChartAxis, cycle_chart
from factory.apps.pareto.front import Trial, commands_of, point_files, tried, undominated
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


PROJECT = read(PAPER)


def point(robots: int, seconds: float, area: float | None) -> FrontPoint:
    return FrontPoint(PROJECT, robots, 0, None, seconds, area)


figures = st.tuples(st.integers(1, 5), *[st.sampled_from([1.0, 2.0, 3.0])] * 2)


@given(st.lists(figures, max_size=12))
def test_points_are_kept_that_no_other_is_as_good_as(given: list[tuple[int, float, float]]) -> None:
    points = [point(*one) for one in given]
    kept = undominated(points)
    for one in kept:
        assert not any(other.beats(one) for other in kept if other is not one)
    for one in points:
        assert any(other.beats(one) for other in kept)
    assert [p.robots for p in kept] == sorted(p.robots for p in kept)


def test_a_front_has_what_it_must_have(front: ParetoFront) -> None:
    written = front.written
    assert written is not None
    assert written.robots == 6
    assert any(point.beats(written) for point in front.points)
    assert {point.robots for point in front.points} >= {3, 4, 5, 6}
    for one in front.points:
        assert not any(other.beats(one) for other in front.points if other is not one)
        assert one.certified
        assert one.bound is not None
        assert one.seconds >= one.bound - 1e-9
        assert one.robots >= front.least.total
    assert front.ended == "complete" and not front.ending


def test_no_point_is_worse_than_the_form_of_the_paper(quick: Project) -> None:
    front = pareto(quick, Effort(factories=8))
    paper = front.written
    assert paper is not None
    assert {node.operation for node in quick.pag.nodes} == {"mate", "atomic"}
    assert not any(
        point.robots >= paper.robots and point.seconds > paper.seconds for point in front.points
    )
    assert min(point.robots for point in front.points) < paper.robots
    assert len(front.points) >= 4


def test_estimates_alone_take_no_layout(quick: Project, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Project, "layout", property(lambda _: pytest.fail("a layout")))
    fresh = replace(quick)
    front = pareto(fresh, Effort(layouts=False, factories=12))
    assert front.written is None
    assert front.laid_out == 0
    assert all(p.predicted is p.area is p.bound is None for p in front.points)
    robots = [p.robots for p in front.points]
    assert robots == sorted(set(robots))
    assert not any(p.certified for p in front.points)


def test_time_that_is_over_leaves_the_product_as_it_is_written(quick: Project) -> None:
    front = pareto(replace(quick), Effort(seconds=1e-6))
    assert front.points == (front.written,)
    assert front.ended == "seconds" and "--seconds" in front.ending


@pytest.mark.parametrize(("count", "numbers"), [(0, []), (1, [0]), (2, [0, 4]), (9, [*range(5)])])
def test_runs_are_spread_over_the_front(front: ParetoFront, count: int, numbers: list[int]) -> None:
    five = replace(front, points=tuple(front.points[:1] * 5))
    assert five.spread(count) == numbers


def test_a_run_is_as_long_as_is_predicted(front: ParetoFront) -> None:
    trial = tried(front.points[0].project)
    assert trial.holds
    assert trial.error is not None
    assert abs(trial.error) < 0.02
    assert trial.ideal is not None


def test_a_run_that_fails_or_is_off_does_not_hold() -> None:
    assert Trial(4, 1.0, 1.01, 1.0).holds
    assert not Trial(4, 1.0, 1.04, 1.0).holds
    assert not Trial(4, 1.0, None, 1.0).holds
    assert not Trial(4, 1.0, 1.0, 1.0, ("mujoco: Contact: r1 - r2",)).holds


# --- files ----------------------------------------------------------------------------------------


def test_each_point_is_made_again_by_its_command(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = run("pareto", PAPER, "-o", out / "front", "--speed", 0.4, "--json")
    assert done.status == 0, done.err
    monkeypatch.chdir(out)  # beside which nothing is configured
    for one in done.json["points"]:
        program, *words = shlex.split(one["command"])
        assert program == "factory"
        again = run(*words, "--world", "ideal", "--json").json
        assert again["robots"] == one["robots"]
        built = run("check", *words[1:], "--json").json
        assert built["gear_train"]
        assert sum(g["type"] == "tool" for g in built["gears"]) == one["tools"]
        project = read_back(Path(words[1]))
        again_point = FrontPoint.laid_out(sweeping.Candidate(project, {}))
        assert again_point.predicted == pytest.approx(one["predicted_cycle_time_s"], abs=1e-9)
        assert again_point.area == pytest.approx(one["area_m2"], abs=1e-9)


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


# --- the command ----------------------------------------------------------------------------------


def test_the_command_tells_its_points(run: Terminal, out: Path) -> None:
    words = "pareto", PAPER, "--validate", 2, "-o", out / "front"
    done = run(*words, "--json")
    assert done.status == 0, done.err
    document = done.json
    keys = {"robots", "tools", "cycle_time_s", "predicted_cycle_time_s", "area_m2", "lines"}
    keys |= {"relays", "parallel", "certified", "validated", "command"}
    assert all(keys <= set(p) for p in document["points"])
    assert document["least_robots"] == 3
    assert document["bound"] > 0
    tried_ones = [p for p in document["points"] if p["validation"] is not None]
    assert len(tried_ones) == 2
    assert all(p["validated"] and abs(p["validation"]["error"]) <= 0.02 for p in tried_ones)
    written = files_in(out / "front")
    assert set(document["files"]) == {str(out / "front" / name) for name in written}
    names = {"p01/plan.json", "p01/layout.json", "p01/floor.svg"}
    assert {"pareto.html", *names} <= set(written)
    assert not any(p["validated"] for p in document["points"] if p["validation"] is None)
    told = run("pareto", PAPER, "-o", out / "front")
    count = len(document["points"])
    assert f"{count} points" in told.out
    said = f"{count} of {count} points were not run: their cycle times are predictions"
    assert said in told.out and said in (out / "front" / "pareto.html").read_text()
    assert "lower bound: 3 robots, tools included" in told.out
    assert "pareto.html" in told.out


def test_what_fits_a_floor_is_found_where_the_product_as_written_does_not(run: Terminal) -> None:
    done = run("pareto", PAPER, "--floor", "0.72x0.34", "--json")
    assert done.status == 0, done.err
    assert done.json["written"] is None
    assert {p["robots"] for p in done.json["points"]} == {5}
    none = run("pareto", PAPER, "--floor", "0.1x0.1", "--json")
    assert none.status == 1
    assert none.codes == ["Layout"]


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


@pytest.mark.parametrize("after", ["laying out", "running in both worlds"])
def test_a_search_that_is_stopped_keeps_what_it_has(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch, after: str
) -> None:
    def stop(_: StepBar, what: str, done: int, *words: object) -> None:
        if what == after and (done > 1 or "running" in what):
            raise KeyboardInterrupt

    monkeypatch.setattr(StepBar, "show", stop)
    words = "pareto", PAPER, "--validate", 1, "-o", out / "front", "--json"
    done = run(*words)
    assert done.status == 130, done.err
    assert done.codes == ["Interrupted"]
    assert done.json["points"]
    assert done.json["complete"] == ("running" in after)
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


# --- progress -------------------------------------------------------------------------------------


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


def test_a_search_for_few_robots_shows_the_best(
    run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(StepBar, "show", lambda _, what, *words: told.append(f"{what} {words}"))
    assert run("check", PAPER, "--robots", "least").status == 0
    assert "searching for few robots" in told[-1]
    assert re.search(r"best: 3 robots, \d\.\d\d s", told[-1])
    assert run("check", PAPER, "--cycle", "3", "--effort", "1").status == 0
    assert "searching for few robots (1, 1," in told[-1]


def test_a_search_for_few_robots_can_be_stopped(run: Terminal, monkeypatch) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(StepBar, "show", stop)
    done = run("check", PAPER, "--robots", "least", "--json")
    assert done.status == 130
    assert done.codes == ["Interrupted"]


def test_the_least_number_is_that_of_the_tree(front: ParetoFront) -> None:
    project = read(PAPER)
    assert front.least == least_robots(project.pag, project.templates)


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
