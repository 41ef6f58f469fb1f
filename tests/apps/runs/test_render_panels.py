"""The net and the modes over time beside the 3-D: what they show is what the log says, calmly, and
in the picture's own colours."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import imageio.v3 as iio
import numpy as np
import pytest

from factory.apps.log import Log, LogWriter, read_log
from factory.apps.log.model import model_of
from factory.apps.monitor.record import recorded_subject
from factory.engine.record.state import State
from factory.engine.record.subject import MonitorSubject
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.film import Picture, Still, camera_named, panels_named
from factory.film.action import Snapshot
from factory.film.camerawork import Moment, Panels
from factory.film.caption import FADES, SHOWN, draw_title, strength
from factory.film.following import Followed
from factory.film.history import History
from factory.film.net_panel import NetPanel
from factory.film.picture import PANELS, shared
from factory.film.reel import Completions, Poster
from factory.film.sheet import BOTTOM, FOOT, OUTSIDE, ROOM, TALLEST, Rows
from factory.film.shot import moment_of, recorded_take
from factory.support.errors import InputError
from factory.theory.lang import read_pag
from tests.command_line import Terminal
from tests.examples import without_hands
from tests.opengl import needs_gl
from tests.pag_texts import TEMPLATES
from tests.paths import PAPER, files_in

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


@pytest.fixture(scope="module")
def paper(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return kept(laid_out("paper"), tmp_path_factory.mktemp("paper") / "log", units=3)


@pytest.fixture(scope="module")
def balanced(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return kept(laid_out("balanced"), tmp_path_factory.mktemp("balanced") / "log", "ideal")


def net_panel(history: History, size=SIZE) -> NetPanel:
    return NetPanel(size, 1.0, history, Rows(history))


def test_tokens_glide_and_never_go_back(paper: Log) -> None:
    panel = net_panel(told(paper))
    steps = []
    for row in range(0, len(paper), 8):
        before = dict(panel.tokens)
        panel.draw(float(paper.time[row]), paper.qpos[row][:6], 1 / 30 if before else 0.0)
        steps += [panel.tokens[r] - at for r, at in before.items()]
    assert max(steps) < 1.2 and min(steps) > -0.02
    assert sum(step > 0.5 for step in steps) < 0.1 * len(steps)


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


def test_a_part_is_followed_from_its_feeder_to_the_dropoff() -> None:
    simulation = Simulation(laid_out("paper"), RunRequest("mujoco", units=2, fuse=True))
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
    assert set(labels) == {"part1", "sub1", "sub3"}
    assert ranks[0] == 0.0


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


@needs_gl
@pytest.mark.parametrize(
    ("words", "found", "hint"),
    [
        (["--with", "net,gantt", "--size", "320x240"], "320x240 has no room", "take 1280x720"),
        (["--poster", "{out}/p.jpg"], "'p.jpg' has '.jpg'", "valid endings: .png"),
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
def test_a_still_of_a_time_that_does_not_come_is_not_written(tmp_path: Path) -> None:
    """What went wrong is told, not that the time did not come."""
    simulation = Simulation(laid_out("paper"), RunRequest("mujoco", units=1))

    def fail(_: State) -> None:
        raise RuntimeError

    with pytest.raises(RuntimeError), Still(simulation, tmp_path / "a.png", at=1.0) as still:
        simulation.run([still.observe, fail])
    assert list(tmp_path.iterdir()) == []
