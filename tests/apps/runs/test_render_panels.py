"""The net and the modes over time beside the 3-D: what they show is what the log says, calmly, and
in the picture's own colours."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import imageio.v3 as iio
import numpy as np
import pytest

import factory
from factory.apps.log import Log, LogWriter, read_log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.apps.runs.pictures import render_log
from factory.engine.record.state import State
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import Film, Picture, Still, camera_named, panels_named
from factory.film.action import Snapshot
from factory.film.camerawork import Moment, Panels
from factory.film.caption import FADES, SHOWN, draw_title, strength
from factory.film.following import Followed
from factory.film.gantt_panel import GanttPanel
from factory.film.history import History, OperationProgress, depths, followed
from factory.film.ink import GROUND, Ink, fitted, operation_colours, robot_colours, width
from factory.film.net_panel import NetPanel
from factory.film.picture import PANELS, shared
from factory.film.reel import Completions, Poster
from factory.film.sheet import (
    BOTTOM,
    CLOSE,
    EASY,
    FOOT,
    OUTSIDE,
    ROOM,
    TALLEST,
    Rows,
    neighbourhood,
)
from factory.film.shot import Shot, moment_of, recorded_take
from factory.pipeline import all_templates
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from tests.command_line import Terminal
from tests.examples import without_hands
from tests.opengl import needs_gl
from tests.pag_texts import TEMPLATES
from tests.paths import PAPER, files_in
from tests.strategies import random_pag_text

SIZE = (560, 360)


def laid_out(name: str):
    return without_hands(name)


def kept(layout, path: Path, world: str = "mujoco", units: int = 2, **options) -> Log:
    """The log of a run."""
    simulation = Simulation(layout, RunRequest(world, units=units, **options))
    with LogWriter(path, simulation) as log:
        simulation.run([log.observe])
    return read_log(path)


def told(log: Log) -> History:
    """All that happened in a log."""
    history = History(recorded_subject(log.header))
    history.catch_up(log.timed_entries, np.inf)
    return history


def marking(history: History, time: float) -> frozenset[int]:
    """The marked places at a time."""
    return frozenset(
        gear.places[history.at(robot, time).step]
        for robot, gear in enumerate(history.factory.net.gears)
    )


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return kept(laid_out("paper"), tmp_path_factory.mktemp("paper") / "log", units=3)


@pytest.fixture(scope="module")
def balanced(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return kept(laid_out("balanced"), tmp_path_factory.mktemp("balanced") / "log", "ideal")


def net_panel(history: History, size=SIZE) -> NetPanel:
    return NetPanel(size, 1.0, history, Rows(history))


# What is shown is what happened.


@pytest.mark.parametrize("seed", range(4))
def test_tokens_are_where_the_log_has_its_marking(seed: int, tmp_path: Path) -> None:
    pag = read_pag(random_pag_text(9 + seed, seed), all_templates())
    layout = factory.lay_out(factory.compile(pag))
    log = kept(layout, tmp_path / "log", "ideal", 1)
    history = told(log)
    panel = net_panel(history)
    gears = history.factory.net.gears
    for row in range(0, len(log), max(1, len(log) // 40)):
        time = float(log.time[row])
        marked = set(log.marking[row].tolist())
        assert marking(history, time) == marked
        active = dict(panel._active(time, log.qpos[row]))
        places = {
            gear.places[int(panel.target(robot, time, active)) % len(gear.places)]
            for robot, gear in enumerate(gears)
            if not history.at(robot, time).operation
        }
        assert places | set(active) == marked
        assert all(0.0 <= done <= 1.0 for done, _ in active.values())


def test_a_firing_left_out_would_be_noticed(paper: Log) -> None:
    history = History(recorded_subject(paper.header))
    entries = paper.timed_entries
    history.catch_up(entries[:5] + entries[6:], np.inf)
    shown = [marking(history, t) for t in paper.time[1:].tolist()]
    assert shown != [frozenset(paper.marking[row].tolist()) for row in range(1, len(paper))]


def test_operations_go_on_and_reach_their_end(paper: Log) -> None:
    history = told(paper)
    progress = OperationProgress(history.subject)
    slides = [0, 1, 2, 3, 4, 5]
    weld = history.factory.by_label["sub2"]
    spell = next(s for s in history.spells[2] if s.operation and s.step // 2 == 1)
    rows = [r for r in range(len(paper)) if spell.start < paper.time[r] <= spell.end]
    done = [
        progress.of(weld, paper.qpos[row][slides], float(paper.time[row]) - spell.start)
        for row in rows
    ]
    assert done[0] < 0.1 and done[-1] > 0.95
    assert (np.diff(done) > -1e-3).all()
    half = done[len(done) // 2]
    assert 0.3 < half < 0.8


def test_every_token_is_drawn_in_its_robots_paint(paper: Log) -> None:
    history = told(paper)
    panel, paints = net_panel(history), robot_colours(history.factory)
    for row in (0, len(paper) // 3, len(paper) // 2, len(paper) - 1):
        pixels = panel.draw(float(paper.time[row]), paper.qpos[row][:6], 0.0)
        for shown in panel.rows.shown:
            x, y = panel._at(shown)
            assert tuple(pixels[int(y), int(x)]) == pytest.approx(paints[shown.robot], abs=2)


def test_tokens_glide_and_never_go_back(paper: Log) -> None:
    panel = net_panel(told(paper))
    steps = []
    for row in range(0, len(paper), 8):
        before = dict(panel.tokens)
        panel.draw(float(paper.time[row]), paper.qpos[row][:6], 1 / 30 if before else 0.0)
        steps += [panel.tokens[r] - at for r, at in before.items()]
    assert max(steps) < 1.2 and min(steps) > -0.02
    assert sum(step > 0.5 for step in steps) < 0.1 * len(steps)


def test_the_modes_of_the_last_seconds_end_at_the_right(paper: Log) -> None:
    history = told(paper)
    panel = GanttPanel(SIZE, 1.0, history, Rows(history))
    weld = history.factory.by_label["sub2"]
    colour = operation_colours(history.factory)[weld.index]
    spell = next(s for s in history.spells[3] if s.operation)
    now = (spell.start + spell.end) / 2
    y = int(panel.sheet.height(panel.rows.shown[3])) + 5
    pixels = panel.draw(now, paper.qpos[0][:6], 0.0)
    assert tuple(pixels[y, int(panel.right) - 4]) == pytest.approx(colour, abs=2)
    assert tuple(pixels[y, int(panel.at(spell.start, now)) - 4]) == GROUND
    later = panel.draw(spell.end + 0.5, paper.qpos[0][:6], 0.0)
    assert tuple(later[y, int(panel.right) - 4]) == GROUND
    assert tuple(later[y, int(panel.at(spell.end, spell.end + 0.5)) - 4]) == pytest.approx(
        colour, abs=2
    )


# Many robots.


def test_without_room_for_all_robots_the_neighbourhood_of_the_product_is_shown(
    balanced: Log,
) -> None:
    history = told(balanced)
    rows = Rows(history)
    assert rows.reduced
    for time in np.arange(0.0, balanced.time[-1], 0.5):
        rows.advance(float(time), 0.0)
        shown = [row.robot for row in rows.shown]
        assert rows.focus is not None and shown == sorted(shown)
        assert len(shown) == rows.named == rows.count <= ROOM / EASY
        assert set(rows.focus.robots) <= set(shown)
        after = history.factory.parents[rows.focus.index]
        assert after < 0 or set(history.factory.operations[after].robots) <= set(shown)


def test_all_robots_are_shown_where_there_is_room(balanced: Log) -> None:
    history = told(balanced)
    robots = len(history.factory.robots)
    rows = Rows(history, CLOSE * robots)
    rows.advance(1.0, 0.0)
    assert not rows.reduced and [row.robot for row in rows.shown] == list(range(robots))
    assert Rows(history, CLOSE * robots - 1).reduced


@pytest.fixture(scope="module", params=["balanced", "truck"])
def many(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Log:
    """The log of a factory of 31 robots, or 23."""
    return kept(laid_out(request.param), tmp_path_factory.mktemp("many") / "log", "ideal", 1)


@pytest.mark.parametrize("tall", [150.0, 250.0, ROOM, 652.0])
def test_no_row_is_empty_and_rows_fill_the_panel(many: Log, tall: float) -> None:
    """Every robot that has a row has an operation in sight."""
    history = told(many)
    rows = Rows(history, tall)
    panel = NetPanel((564, int(tall + OUTSIDE)), 1.0, history, rows)
    assert tall < 600 or not rows.reduced
    for time in np.arange(0.0, many.time[-1], 1.0):
        rows.advance(float(time), 0.0)
        for row in rows.shown:
            spans = map(panel.rings.span, history.factory.robots[row.robot].operations)
            assert any(left >= panel.sheet.gutter - 1 and right <= 564 for left, right in spans)
        last = panel.sheet.height(rows.shown[-1]) + panel.sheet.pitch / 2
        assert panel.sheet.pitch == TALLEST or last > panel.sheet.size[1] - FOOT - 2 * BOTTOM


def test_panels_are_legible_and_use_their_width(many: Log) -> None:
    """Beside each other at 960 pixels, with two panels and with one."""
    history, size = told(many), (960, 540)
    m = SimpleNamespace(joint=lambda _: SimpleNamespace(qposadr=[0]))
    for names in (("net", "gantt"), ("net",)):
        panels = Panels(m, size, shared(size, names)[1], history)
        net = panels.shown[0][1]
        assert isinstance(net, NetPanel)
        for time in np.arange(0.0, many.time[-1], 1.0):
            panels.rows.advance(float(time), 0.0)
            sheet = net.rings.sheet
            assert min(sheet.small, sheet.name_points) >= 10 and sheet.pitch > 13
            assert net.rings.pitch > 25
            ends = [net.rings.ends(row.robot) for row in panels.rows.shown]
            left, right = min(start for start, _ in ends), max(end for _, end in ends)
            assert right - left > 0.65 * sheet.size[0]


def test_what_a_robot_does_is_said_beside_its_ring(paper: Log) -> None:
    """Where its operation has no name of its own: the welding robot's in the paper's example."""
    history = told(paper)
    panel = net_panel(history)
    spell = next(s for s in history.spells[3] if s.operation)
    time = (spell.start + spell.end) / 2
    y = int(panel.sheet.height(panel.rows.shown[3]))
    left, right = (int(end) for end in panel.rings.ends(3))
    beside = slice(left - 50, left - 4), slice(right + 4, right + 50)
    before = panel.draw(spell.start - 0.05, paper.qpos[0][:6], 0.0)[y - 6 : y + 6]
    during = panel.draw(time, paper.qpos[0][:6], 0.0)[y - 6 : y + 6]
    changed = np.abs(during.astype(int) - before).max(axis=2) > 60
    assert max(changed[:, side].mean() for side in beside) > 0.05


def test_rows_come_and_go_calmly(balanced: Log) -> None:
    rows, before = Rows(told(balanced)), {}
    changes = 0
    for time in np.arange(0.0, balanced.time[-1], 1 / 30):
        rows.advance(float(time), 1 / 30)
        now = {row.robot: row for row in rows.shown}
        both = [(before[r], now[r]) for r in before.keys() & now.keys()]
        assert all(abs(a.at - b.at) < 2.0 and abs(a.alpha - b.alpha) < 0.2 for a, b in both)
        gone = [before[r] for r in before.keys() - now.keys()]
        assert all(row.alpha < 0.05 for row in gone)
        changes += len(gone)
        before = now
    assert changes


@pytest.mark.parametrize("seed", range(5))
def test_a_neighbourhood_is_never_too_large(seed: int) -> None:
    pag = read_pag(random_pag_text(20 + 9 * seed, seed), all_templates())
    made = factory.compile(pag)
    for operation in made.operations:
        found = neighbourhood(made, operation, 5, range(len(made.operations)))
        assert 0 < len(found) <= max(5, len(operation.robots)) and found == sorted(set(found))
        assert set(operation.robots[:5]) <= set(found)
    depth = depths(made)
    assert followed(made, {}) in made.leaves and depth[made.dropoff.index] == 0
    assert followed(made, {made.dropoff.start: 1}) == made.dropoff


# Which product cameras follow.


def test_the_product_followed_is_the_same_when_parts_become_one_body(tmp_path: Path) -> None:
    layout = laid_out("paper")
    found = []
    for fuse in (False, True):
        simulation = Simulation(layout, RunRequest("mujoco", units=2, fuse=fuse))
        followed = Followed(simulation.world.m, MonitorSubject.of_run(simulation))
        track: list[np.ndarray] = []

        def look(state: State, d=simulation.world.d, followed=followed, track=track) -> None:
            now = state.observation
            seen = followed.furthest(d, Snapshot.of(now.qpos, now.welds))
            track.append(np.full(3, np.nan) if seen is None else followed.origin(d, seen[0]))

        simulation.run([look])
        found.append((np.array(track), simulation, followed))
    (apart, one, first), (fused, other, second) = found
    assert other.world.figures().fused and not one.world.figures().fused
    assert np.allclose(first.box, second.box, atol=1e-3)
    ticks = min(len(apart), len(fused))
    near = np.linalg.norm(apart[:ticks] - fused[:ticks], axis=1) < 0.01
    assert near.mean() > 0.97


@pytest.mark.parametrize("fuse", [False, True])
def test_a_part_is_followed_from_its_feeder_to_the_dropoff(fuse: bool) -> None:
    simulation = Simulation(laid_out("paper"), RunRequest("mujoco", units=2, fuse=fuse))
    followed = Followed(simulation.world.m, MonitorSubject.of_run(simulation), "part1")
    ranks, labels = [], []

    def look(state: State) -> None:
        now = state.observation
        seen = followed.furthest(simulation.world.d, Snapshot.of(now.qpos, now.welds))
        if seen is not None:
            ranks.append(seen[1])
            labels.append(followed.labels[seen[0]])

    simulation.run([look])
    back = [k for k in range(1, len(ranks)) if ranks[k] < ranks[k - 1]]
    assert len(back) == 1 and ranks[back[0] - 1] == 3.0  # r1 carries three: it drops off
    assert set(labels) == ({"part1", "sub1", "sub3"} if fuse else {"part1"})
    assert ranks[0] == 0.0


# Cameras, areas, words.


BOX = read_pag("root = all; all = mate(lid, box); lid = atomic(); box = atomic()", TEMPLATES)


def test_cameras_may_look_where_a_label_is_taken() -> None:
    for label in ("lid", "all"):
        assert camera_named(f"handover:{label}", BOX) == f"handover:{label}"
    assert camera_named("handover:anything") == "handover:anything"
    with pytest.raises(InputError) as caught:
        camera_named("handover:al", BOX)
    diagnostic = caught.value.diagnostics[0]
    assert diagnostic.message == "there is no label 'al'"
    assert diagnostic.hint == "did you mean 'all'? valid labels: all, lid, box"


def test_cameras_may_follow_a_part() -> None:
    assert camera_named("part:lid", BOX) == "part:lid"
    assert camera_named("part:anything") == "part:anything"
    with pytest.raises(InputError, match="there is no part 'all'"):
        camera_named("part:all", BOX)


def test_panels_are_named_or_refused() -> None:
    assert panels_named("gantt, net") == PANELS and panels_named(None) == ()
    with pytest.raises(InputError, match=r"there is no panel 'gant'\n.*did you mean 'gantt'"):
        panels_named("net,gant")


@pytest.mark.parametrize("size", [(1280, 720), (720, 1280), (640, 640), (1920, 1080)])
@pytest.mark.parametrize("panels", [("net",), ("gantt",), PANELS])
def test_areas_cover_the_picture_once(size, panels) -> None:
    scene, areas = shared(size, panels)
    covered = np.zeros((size[1], size[0]), int)
    for area in (scene, *areas.values()):
        covered[area.top : area.top + area.height, area.left : area.left + area.width] += 1
    assert (covered == 1).all() and list(areas) == list(panels)
    assert 0.4 < scene.width * scene.height / (size[0] * size[1]) <= 0.7


def test_pictures_too_small_for_panels_are_refused() -> None:
    with pytest.raises(InputError, match="320x180 has no room for net and gantt"):
        shared((320, 180), PANELS)
    assert shared((320, 180), ())[1] == {}


def test_a_title_fades_and_then_leaves_the_picture_alone() -> None:
    assert strength(0.0) == strength(SHOWN) == 1.0 and strength(SHOWN + FADES) == 0.0
    blank = np.full((360, 640, 3), 100, np.uint8)
    shown, over = blank.copy(), blank.copy()
    draw_title(shown, "A very long title " * 9, "3 parts", 0.0)
    draw_title(over, "A title", "3 parts", SHOWN + FADES)
    changed = (shown != blank).any(axis=-1)
    assert (over == blank).all() and 0.02 < changed.mean() < 0.4
    assert not changed[:, -20:].any() and not changed[180:].any()


def test_words_are_cut_to_fit() -> None:
    assert fitted("gearbox", 12, 1000) == "gearbox"
    assert fitted("gearbox/12", 12, 0.8 * width("gearbox/12", 12)).endswith("…/12")
    one, other = (
        fitted(f"axle_{end}", 12, 0.9 * width("axle_right", 12)) for end in ("left", "right")
    )
    assert one != other
    assert fitted("subassembly12", 12, 60).endswith("…12")
    assert fitted("gearbox", 12, 5) == ""
    assert fitted("mount/2", 12, 0.65 * width("mount/2", 12)) == ""
    for label in ("mount", "mount/2", "front_axle", "cab"):
        name = label.partition("/")[0]
        for room in range(90):
            found = fitted(label, 12, room)
            kept = found.replace("…", "").partition("/")[0]
            assert not found or len(kept) >= 0.4 * len(name)
    assert all(width(fitted("subassembly", 12, room), 12) <= room for room in range(0, 90, 7))


def test_ink_is_where_it_is_put_to_a_fraction_of_a_pixel() -> None:
    for radius in (0.0, 2.0):
        pixels = np.zeros((40, 40, 3), np.uint8)
        Ink(pixels).box(10.25, 10, 20.75, 20, (200, 200, 200), radius=radius)
        rows = pixels[15, :, 0].astype(int)
        assert rows[11:20].tolist() == [200] * 9 and rows[9] == rows[21] == 0
        assert abs(rows[10] - 150) <= 2 and abs(rows[20] - 150) <= 2
    Ink(pixels).disc(-50, 300, 5, (1, 1, 1))
    Ink(pixels).words(-3, 39, "over the edge", 12, (255, 255, 255))


# Posters.


def test_the_poster_is_when_the_product_has_become_whole_and_most_is_there(paper: Log) -> None:
    scene = model_of(paper), recorded_subject(paper.header)
    take = recorded_take(paper, lambda: scene, Picture(SIZE))
    poster, completions = Poster(take, Path("poster.png")), Completions(take)
    firings = list(zip(paper.fired_t.tolist(), paper.fired.tolist(), strict=True))
    for row in range(len(paper)):
        take.history.catch_up(paper.timed_entries, float(paper.time[row]))
        poster.see(moment_of(paper, row), completions.since_last())
    root = take.subject.factory.by_label["sub3"]
    ends = [t for t, event in firings if event == root.end]
    assert isinstance(poster.moment, Moment)
    assert min(abs(poster.moment.time - t) for t in ends) < 0.02 and len(ends) == 3
    assert poster.moment.time > ends[0] + 0.1  # by then more has come in


# Films.


@needs_gl
def test_a_film_with_everything(tmp_path: Path) -> None:
    simulation, size = Simulation(laid_out("paper"), RunRequest("mujoco", units=1)), (560, 490)
    picture = Picture(size, "part:part2", True, PANELS, "Title")
    log, film = tmp_path / "run.log", tmp_path / "run.mp4"
    with (
        LogWriter(log, simulation) as writer,
        Film(simulation, film, picture, 2, tmp_path / "p.png") as filming,
    ):
        run = simulation.run([writer.observe, filming.observe])
    frames = iio.imread(film, plugin="pyav").astype(int)
    assert frames.shape == (int(run.sim_time_s * 2 + 1e-6) + 7, 490, 560, 3)
    assert iio.imread(tmp_path / "p.png").shape == (490, 560, 3)
    again = tmp_path / "again.mp4"
    render_log(read_log(log), Shot(again, picture, 2))
    assert np.abs(frames - iio.imread(again, plugin="pyav")).max() <= 2
    panels = shared(size, PANELS)[1]
    for area in panels.values():
        part = frames[:, area.top : area.top + area.height, area.left : area.left + area.width]
        assert (np.abs(np.diff(part, axis=0)).max(axis=(1, 2, 3)) > 30).mean() > 0.7


# The command line.


@needs_gl
@pytest.mark.parametrize(
    ("words", "found", "hint"),
    [
        (["--with", "net,gant"], "there is no panel 'gant'", "did you mean 'gantt'?"),
        (["--with", "net,gantt", "--size", "320x240"], "320x240 has no room", "take 1280x720"),
        (["--camera", "part:part9"], "there is no part 'part9'", "did you mean 'part"),
        (["--poster", "{out}/p.jpg"], "'p.jpg' has '.jpg'", "valid endings: .png"),
        (["--poster", "{out}/f.mp4"], "", ""),
    ],
    ids=lambda words: " ".join(words) if isinstance(words, list) else "",
)
def test_what_cannot_be_shown_is_refused_and_nothing_written(
    run: Terminal, out: Path, words: list[str], found: str, hint: str
) -> None:
    given = [word.format(out=out) for word in words]
    log = ["--log", out / "run.log"]
    done = run("run", PAPER, "--video", out / "f.mp4", *log, *given, "--json")
    assert done.status == 2
    error = done.json["errors"][0]
    assert found in error["message"] and hint in error["hint"]
    assert files_in(out) == {}


@needs_gl
def test_a_still_with_panels_on_the_command_line(run: Terminal, out: Path) -> None:
    picture = out / "still.png"
    words = ["--with", "net,gantt", "--size", "560x480", "--title", "A title", "--at", "0.5"]
    assert run("render", PAPER, "-o", picture, *words, "--json").status == 0
    assert iio.imread(picture).shape == (480, 560, 3) and list(files_in(out)) == ["still.png"]


@needs_gl
def test_a_run_says_where_its_film_is(run: Terminal, tmp_path: Path) -> None:
    film, poster, log = (tmp_path / name for name in ("a.mp4", "a.png", "a.log"))
    words = ["--video", film, "--poster", poster, "--log", log, "--size", "64x48", "--fps", 2]
    out = run("run", PAPER, *words).out
    assert out.endswith(f"film: {film}\nposter: {poster}\nlog: {log}\n")
    answer = run("run", PAPER, *words, "-q")
    assert answer.err == "" and answer.out.startswith("1 of 1 products")


@needs_gl
def test_a_still_is_called_a_still(run: Terminal, out: Path) -> None:
    still = out / "a.png"
    words = ["render", PAPER, "-o", still, "--size", "64x48", "--at"]
    assert run(*words, "0.5").out == f"{still}: a still of 64x48 at 0.5 s\n"
    assert run(*words, "end").out == f"{still}: a still of 64x48 at the end\n"
    found = run(*words, "0.5", "--json").json
    assert (found["frames"], found["seconds"]) == (1, 0.0)


@needs_gl
def test_a_time_past_the_end_is_an_error_that_names_the_end(run: Terminal, out: Path) -> None:
    log, still = out / "run.log", out / "a.png"
    end = run("run", PAPER, "--log", log, "--json").json["sim_time_s"]
    assert run("render", PAPER, "-o", still, "--size", "64x48", "--at", end).status == 0
    still.unlink()
    for file, what in ((PAPER, "run"), (log, "log")):
        done = run("render", file, "-o", still, "--size", "64x48", "--at", "100", "--json")
        assert (done.status, done.codes) == (2, ["BadValue"])
        message = done.json["errors"][0]["message"]
        assert message == f"--at 100 is past the end: the {what} ends at {end:.2f} s"
    assert list(files_in(out)) == ["run.log"]


@needs_gl
def test_a_still_of_a_time_that_does_not_come_is_not_written(tmp_path: Path) -> None:
    """What went wrong is told, not that the time did not come."""
    simulation = Simulation(laid_out("paper"), RunRequest("mujoco", units=1))

    def fail(_: State) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError), Still(simulation, tmp_path / "a.png", at=1.0) as still:
        simulation.run([still.observe, fail])
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_camera_lists_the_right_ones() -> None:
    every = "valid cameras: tour, overview, orbit, top, product, part:LABEL, handover:LABEL"
    for name, hint in (("orbt", f"did you mean 'orbit'? {every}"), ("zzz", every)):
        with pytest.raises(InputError) as caught:
            camera_named(name)
        assert caught.value.diagnostics[0].hint == hint
    with pytest.raises(InputError, match="there is no part 'lod'") as caught:
        camera_named("part:lod", BOX)
    assert caught.value.diagnostics[0].hint == "did you mean 'lid'? valid parts: lid, box"
