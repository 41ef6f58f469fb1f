"""`factory plan` from end to end: what it is asked for, and what it says and writes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import imageio.v3 as iio
import numpy as np
import pytest
from numpy.typing import NDArray

from factory.apps.planning.command_line.plan import _by_label
from factory.apps.planning.exploded import ExplodedView
from factory.apps.planning.exploding import explosion
from factory.apps.planning.interlocked import PAINTS
from factory.pipeline import read
from tests.apps.planning.test_plan_models import CHAIN, LOADED, PEG
from tests.command_line import Done, Terminal
from tests.opengl import needs_gl
from tests.paths import ROOT, files_in
from tests.plan_puzzles import Parts, pinwheel, source

EXAMPLES = ROOT / "examples"
Planning = Callable[..., Done]


@pytest.fixture
def planning(run: Terminal, tmp_path: Path) -> Planning:
    """Plans a puzzle, or a PAG, with its tree thrown away, into `out`."""

    def planned(what: Parts | Path, *words: object, out: str = "out") -> Done:
        file = what if isinstance(what, Path) else puzzle(tmp_path, what)
        return run("plan", file, "--replan", "-o", tmp_path / out, *words, "--json")

    return planned


def puzzle(folder: Path, parts: Parts) -> Path:
    source(folder, parts)
    return folder / "puzzle.pag"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gearbox", "chest", "chair"])
def test_a_plan_is_free_and_no_slower_than_the_tree_drawn_by_hand(
    planning: Planning, run: Terminal, name: str
) -> None:
    from factory.engine.timing.timed import pace

    done = planning(EXAMPLES / f"{name}.pag", "--no-look", "--no-screws")
    assert done.status == 0, done.err
    checked = run("check", done.json["pag"], "--json").json
    assert checked["live"] and checked["approaches"]["blocked"] == 0
    assert checked["robots"] == done.json["figures"]["robots"]
    by_hand, planned = read(EXAMPLES / f"{name}.pag"), read(Path(done.json["pag"]))
    cycles = [pace(one.layout, one.settings)[0].seconds for one in (planned, by_hand)]
    assert cycles[0] <= cycles[1]
    assert cycles[0] == pytest.approx(done.json["figures"]["cycle"])


def test_each_operation_has_its_room(planning: Planning, run: Terminal, tmp_path: Path) -> None:
    joins = planning(PEG, "--no-look").json["joins"]
    assert {join["label"] for join in joins} == labels_of(tmp_path / "out" / "puzzle.pag")
    rooms = [join["clearance"] for join in joins]
    assert all(room is None or room >= -1e-5 for room in rooms)
    words = ("plan", tmp_path / "puzzle.pag", "--replan", "-o", tmp_path / "out", "--no-look")
    told = run(*words, "-v").out
    for join in joins:
        (line,) = [line for line in told.splitlines() if line.startswith(f"  {join['label']}: ")]
        room = join["clearance"]
        assert line.endswith("nothing near" if room is None else f"room {1e3 * room:.2f} mm")


def test_the_report_has_the_way_and_the_room_of_an_operation(
    planning: Planning, run: Terminal, tmp_path: Path
) -> None:
    wall = (-20, -20, 0.2), (-5.2, 20, 30.2)
    done = planning({**PEG, "cap": [*PEG["cap"][1:], wall]}, "--no-look")
    (join,), to = done.json["joins"], tmp_path / "report.html"
    assert run("report", done.json["pag"], "--units", 1, "-o", to).status == 0
    text = to.read_text().partition("How parts come together")[2].partition("</table>")[0]
    (row,) = [row for row in text.split("<tr>") if f">{join['label']}<" in row]
    assert "<td>peg + cap</td><td>cap is lowered " in row
    room = f"{1e3 * abs(join['clearance']):.2f} mm"
    assert f">{room}<" in row and ">none<" in row


def labels_of(pag: Path) -> set[str]:
    matings = read(pag).matings
    assert matings is not None
    return {mating.label for mating in matings.all}


@needs_gl
def test_what_interlocks_is_said_and_drawn_and_nothing_else_is_written(
    planning: Planning, tmp_path: Path
) -> None:
    done = planning(pinwheel())
    assert (done.status, done.codes) == (2, ["CannotAssemble"])
    (error,) = done.json["errors"]
    assert "a, b, c" in error["message"] and "puzzle-interlocked.png" in error["message"]
    assert "--allow" in error["hint"]
    (lock,) = done.json["interlocks"]
    assert lock["parts"] == ["a", "b", "c"]
    assert sorted(lock["circuits"]) == ["+x", "+y", "+z", "-x", "-y", "-z"]
    assert all(set(way) == {"a", "b", "c"} for way in lock["circuits"].values())
    assert done.json["removal"]["smallest"] and len(done.json["removal"]["labels"]) == 1
    assert list(files_in(tmp_path / "out")) == ["puzzle-interlocked.png"]
    pixels = iio.imread(tmp_path / "out" / "puzzle-interlocked.png")
    assert all((pixels == paint).all(axis=2).any() for paint in PAINTS[:3])


def test_joins_find_their_operations_whenever_screws_are_driven() -> None:
    """Screw s is driven before b comes, and screw t before c: the joins of b and c omit them."""
    labels = ["a", "b", "c", "s", "t"]
    operations = [("as", "a", "s"), ("ab", "as", "b"), ("abt", "ab", "t"), ("abc", "abt", "c")]
    steps = [SimpleNamespace(label=whole, inputs=(one, other)) for whole, one, other in operations]
    made = [("a", "b"), ("ab", "c"), ("a", "s"), ("ab", "t")]
    joins = [SimpleNamespace(pile=tuple(pile), come=(come,)) for pile, come in made]
    parts = [(label, [SimpleNamespace(label=label)]) for label in labels]
    project = SimpleNamespace(
        pag=SimpleNamespace(postorder=lambda: steps), matings=SimpleNamespace(all=steps)
    )
    told = _by_label(
        SimpleNamespace(units=lambda: parts), SimpleNamespace(operations=joins), project
    )
    assert {label: join.come for label, join in told.items()} == {
        whole: (come,) for whole, _, come in operations
    }


def test_what_interlocks_is_not_drawn_where_no_pictures_are_wanted(
    planning: Planning, tmp_path: Path
) -> None:
    done = planning(CHAIN, "--no-look")
    assert (done.status, done.codes, done.json["files"]) == (2, ["CannotAssemble"], [])
    assert not (tmp_path / "out").exists()


def test_clashes_that_are_allowed_are_counted_and_written(
    planning: Planning, run: Terminal
) -> None:
    """Of a part that may pass through all others, or of a pair, whatever overlaps when finished:
    `check` knows that they are allowed, as deep as they are and no deeper."""
    refused = planning(CHAIN, "--no-look")
    (label,) = refused.json["removal"]["labels"]
    done = planning(CHAIN, "--allow", label, "--no-look")
    assert done.status == 0, done.err
    assert done.json["figures"]["blocked"] == done.json["approaches"]["blocked"] > 0
    assert planning(CHAIN, "--allow", f"{label}s", "--no-look").codes == ["Usage"]
    pairs = [a.parts for a in read(Path(done.json["pag"])).pag.allowed]
    again = planning(
        CHAIN, *(w for pair in pairs for w in ("--allow", ":".join(pair))), "--no-look"
    )
    for one in (done, again):
        found = read(Path(one.json["pag"])).pag
        assert found.allowed and all(0 < a.depth < 0.1 for a in found.allowed)
        checked = run("check", one.json["pag"], "--json").json
        codes = [w["code"] for w in (*one.json["warnings"], *checked["warnings"])]
        assert checked["approaches"]["blocked"] > 0 and "Blocked" not in codes


STACK = """root = stack; stack = mate ( pair, third );
pair = press ( two, dwell = 0.5 ); two = mate ( first, second );
first = atomic ( box = ( 0.1, 0.1, 0.1 ), pos = ( 0, 0, 0.05 ) );
second = atomic ( box = ( 0.1, 0.1, 0.1 ), pos = ( 0, 0, 0.15 ) );
third = atomic ( box = ( 0.1, 0.1, 0.1 ), pos = ( 0, 0, 0.25 ) )
"""


def test_a_sub_tree_is_kept(run: Terminal, tmp_path: Path) -> None:
    (tmp_path / "stack.pag").write_text(STACK)
    words = ("--keep", "pair", "--no-look", "-o", tmp_path / "out")
    done = run("plan", tmp_path / "stack.pag", *words, "--json")
    assert done.status == 0, done.err
    assert done.json["kept"] == ["pair"]
    after = read(Path(done.json["pag"])).pag
    assert (after["pair"].operation, after["pair"].inputs) == ("press", ("two",))
    assert (after["two"].operation, after["two"].inputs) == ("mate", ("first", "second"))
    (join,) = done.json["joins"]
    assert {*join["pile"], *join["come"]} == {"pair", "third"}


def test_the_time_that_is_asked_for_bounds_proofs_of_small_products(planning: Planning) -> None:
    """Of one whose trees are proved to the end where none is asked for."""
    done = planning(LOADED, "--no-look", "--seconds", 0.001)
    assert done.status == 0, done.err
    assert done.json["figures"]["layouts"] == 1 and not done.json["optimal"]


@pytest.mark.parametrize(("where", "kept"), [("factory.apps.planning.plan.blocking", False)])
def test_a_signal_is_heard_at_once(
    planning: Planning, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str, kept: bool
) -> None:
    """While there is no tree yet, and while pictures are made, when the plan is written already."""

    def stop(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("the signal was not heard")

    monkeypatch.setattr("factory.apps.planning.exploded.ExplodedView.still", lambda *_: None)
    monkeypatch.setattr(where, stop)
    done = planning(LOADED, "--seconds", 0.001)
    assert (done.status, done.codes) == (130, ["Interrupted"])
    assert (tmp_path / "out" / "puzzle.pag").exists() == kept
    assert not list(tmp_path.glob("out/*.mp4"))


def test_a_signal_is_heard_while_files_are_read(
    planning: Planning, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        raise AssertionError("the signal was not heard")

    file = puzzle(tmp_path, LOADED)
    monkeypatch.setattr("factory.apps.planning.source.placed", stop)
    done = planning(file)
    assert (done.status, done.codes) == (130, ["Interrupted"])
    assert not list(tmp_path.glob("out/*"))


def test_the_answer_does_not_wait_for_pictures(
    run: Terminal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("factory.apps.planning.exploded.ExplodedView.still", stop)
    done = run("plan", puzzle(tmp_path, PEG), "--replan", "-o", tmp_path / "out")
    assert done.status == 130
    assert "robots, cycle time about" in done.out and "factory run" in done.out


ENDLESS = """
import os, signal, sys, threading
from factory.floor.geometry import product
as_given, signals = product.in_pieces, iter((signal.SIGINT,))
def in_pieces(mesh, stood_in=False, decomposed=True):
    if not decomposed:
        return as_given(mesh, stood_in, decomposed)
    if sys.argv[1] == "signal":
        for one in signals:  # of the first part alone
            os.kill(os.getpid(), one)
    threading.Event().wait(600)
product.in_pieces = in_pieces
from factory.commands import main
main(sys.argv[2:])
"""
"""Plans with parts that are decomposed for ever, with or without a signal meanwhile."""


@pytest.mark.parametrize("ends", ["signal", "time"])
def test_a_tree_is_written_however_long_its_parts_are_decomposed(tmp_path: Path, ends: str) -> None:
    file, folder = puzzle(tmp_path, PEG), tmp_path / "out"
    words = ["plan", file, "--replan", "-o", folder, "--json"]
    words += ["--seconds", "0.001"] if ends == "time" else []
    kept = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", ENDLESS, ends, *map(str, words)],
        env={**os.environ, **kept},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    document = json.loads(done.stdout)
    assert document["figures"]["layouts"] == 0 and document["figures"]["cycle"] is None
    assert labels_of(Path(document["pag"])) and document["joins"] == []


def test_ways_are_not_looked_at_for_longer_than_the_time_that_is_asked_for(
    planning: Planning, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def long(source: object, watch: Callable[[], None]) -> None:
        watch()
        raise AssertionError("the time was not heard")

    monkeypatch.setattr("factory.apps.planning.plan.GRACE", -1.0)
    monkeypatch.setattr("factory.apps.planning.plan.blocking", long)
    done = planning(LOADED, "--seconds", 0.001)
    assert (done.status, done.codes) == (2, ["Usage"])
    assert not (tmp_path / "out").exists()


HEAVY = """root = all; all = mate ( stem, slab );
stem = atomic ( box = ( 0.02, 0.01, 0.6 ), pos = ( 0, 0, 0.3 ) );
slab = atomic ( box = ( 0.6, 0.6, 0.1 ), pos = ( 0, 0, 0.65 ), density = 8000 )
"""


def test_what_is_too_heavy_for_every_hand_is_said_by_plan_and_check(
    run: Terminal, tmp_path: Path
) -> None:
    (tmp_path / "all.pag").write_text(HEAVY)
    words = ("--replan", "--no-look", "-o", tmp_path / "out")
    done = run("plan", tmp_path / "all.pag", *words, "--json")
    checked = run("check", done.json["pag"], "--json")
    for warnings in (done.json["warnings"], checked.json["warnings"]):
        grips = [w for w in warnings if w["code"] == "NoGrip"]
        assert {w["message"] for w in grips} == {
            "no hand can hold 'slab'",
            "no hand can hold 'all'",
        }
        assert any("not even a pin bears the load" in w["hint"] for w in grips)
        assert any("times its strength" in w["hint"] for w in grips)


SHELF = """root = shelf; shelf = mate ( foot, top );
foot = atomic ( box = ( 0.2, 0.2, 0.1 ), pos = ( 0, 0, 0.05 ), rgba = ( 0.9, 0.1, 0.1, 1 ) );
top = atomic ( box = ( 0.2, 0.2, 0.1 ), pos = ( 0, 0, 0.15 ), rgba = ( 0.1, 0.2, 0.9, 1 ) )
"""


@needs_gl
def test_the_film_begins_apart_and_ends_together(tmp_path: Path) -> None:
    (tmp_path / "shelf.pag").write_text(SHELF)
    project = read(tmp_path / "shelf.pag")
    assert project.matings is not None
    view = ExplodedView(project.product, explosion(project.pag, project.matings, project.product))
    assert view.film(tmp_path / "film.mp4", fps=4.0) == 15
    film = iio.imread(tmp_path / "film.mp4", plugin="pyav")
    assert is_apart(film[0])
    assert not is_apart(film[-1])
    assert film[0].shape == (640, 480, 3)


@needs_gl
@pytest.mark.slow
def test_plan_writes_a_still_and_a_film(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "shelf.pag").write_text(SHELF)
    out = tmp_path / "out"
    done = Terminal(capsys)("plan", tmp_path / "shelf.pag", "--replan", "-o", out, "--json")
    assert done.status == 0, done.err
    names = [Path(name).name for name in done.json["files"]]
    assert names == ["shelf.pag", "shelf-exploded.png", "shelf-assembly.mp4"]
    still = iio.imread(out / "shelf-exploded.png")
    film = iio.imread(out / "shelf-assembly.mp4", plugin="pyav")
    assert is_apart(still)
    assert not is_apart(film[-1])


def is_apart(pixels: NDArray[np.uint8]) -> bool:
    """Whether the upper side of what is red is seen, which shines brighter than its walls."""
    red, green, blue = (pixels[..., k].astype(int) for k in range(3))
    return bool(((red > 200) & (green < 60) & (blue < 60)).sum() > 0.002 * red.size)
