"""What overlaps when finished is named, with its depth, and fails a run unless it is allowed. Parts
that overlap: up to a tolerance it is taken from the shapes that collide; pairs that overlap deeper
are left out, part by part, and counted."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from factory.apps.log import read_log
from factory.apps.resume.remade import model_faults
from factory.engine.mjcf.insets import insets_of
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.floor.geometry.insets import _faces, _largest_ball, breadth, inset
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.layout import Layout
from factory.pipeline import read
from factory.support.engine import mujoco
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.lang import read_pag, write_pag
from factory.theory.problem.pag import AllowedOverlap
from tests.command_line import Terminal
from tests.pag_texts import TEMPLATES, laid_out
from tests.paths import ROOT
from tests.planted import CLOSED
from tests.simulation_values import ready
from tests.slow import slow_but

CASES = ROOT / ".." / "shared" / "cases"

TEXT = """root = r; r = mate ( base, s ); s = mate ( peg, lid );
base = atomic ( box = ( 0.06, 0.06, 0.02 ) );
peg = atomic ( box = ( 0.02, 0.02, 0.03 ), pos = ( 0, 0, %s ) );
lid = atomic ( box = ( 0.02, 0.02, 0.01 ), pos = ( 0, 0, 0.045 ) );"""
"""A peg on a base, into which it reaches the less the higher it is, and a lid over it."""


@pytest.fixture
def deep(tmp_path: Path) -> Path:
    """The peg reaches 0.3 mm into the base."""
    file = tmp_path / "deep.pag"
    file.write_text(TEXT % 0.0247)
    return file


def test_an_overlap_is_named_and_fails_a_run(run: Terminal, deep: Path, tmp_path: Path) -> None:
    """Also where the pair is tested, with faces that recede; from the log too, and in a resumed
    verdict; `--lenient` leaves it out."""
    words = "base and peg overlap by 0.30 mm when finished"
    checked = run("check", deep)
    assert checked.status == 0 and f"Overlap warning: {words}" in checked.err
    (pair,) = run("check", deep, "--json", "--allow", "base:peg:0.1mm").json["overlaps"]
    assert pair == {"parts": ["base", "peg"], "depth_mm": pytest.approx(0.3), "allowed_mm": 0.1}
    log = tmp_path / "log"
    done = run("run", deep, "--log", log)
    assert done.status == 1
    assert done.out.splitlines()[0] == f"the run FAILED: Overlap: {words}"
    for words in (("monitor", log), ("report", log, "-o", tmp_path / "page.html")):
        found = run(*words, "--json")
        assert found.status == 1
        assert [f["code"] for f in found.json["verdict"]["failures"]] == ["Overlap"]
    assert run("run", deep, "--lenient").status == 0


@pytest.mark.parametrize(
    ("allow", "said"),
    slow_but(
        [((), True)],
        [((), True), (("core:front",), False), (("front:core:36mm",), False), (("34mm",), True)],
    ),
)
def test_a_run_says_that_ways_were_blocked_unless_they_are_allowed(
    run: Terminal, tmp_path: Path, allow: tuple[str, ...], said: bool
) -> None:
    """The core comes through a wall, 35 mm deep; from the log too, even where that does not say
    it; what is allowed is no warning, but said."""
    file, log = tmp_path / "closed.pag", tmp_path / "log"
    file.write_text(CLOSED % "")
    options = [word for one in allow for word in ("--allow", one)]
    words = "core cannot come to all: core and front 35.00 mm"
    checked = run("check", file, *options)
    assert checked.status == 0 and (words in checked.err) == said
    passes = "a pair of parts passes through each other on the way by up to 35.00 mm"
    assert (passes in checked.out) == (not said)
    counted = "1 blocked" if said else "1 allowed to pass through each other, 0 blocked"
    assert f" lowered, {counted}" in checked.out
    done = run("run", file, *options, "--log", log)
    watched = run("monitor", log)
    last = f"succeeded, but parts passed through each other in 1 operation (Blocked: {words}"
    assert (done.status, watched.status) == (0, 0)
    assert (last in done.out, last in watched.out) == (said, said)
    document = run("monitor", log, "--json").json
    blocked, qualified = document["verdict"]["blocked"], document["qualified"]
    assert [one["message"] for one in blocked] == [words] * said
    assert qualified[-1] == "1 of 10 pairs of parts were not tested for contact"
    strictly = run("monitor", log, "--strict")
    assert strictly.status == 1 and strictly.out.startswith("the run FAILED: Qualified: ")
    if said:
        kept = read_log(log)
        silent = replace(kept, figures={**(kept.figures or {}), "faults": []})
        faults, why = model_faults(silent, tmp_path)
        assert [fault.code for fault in faults] == ["Record", "Blocked"] and not why


@pytest.mark.parametrize("word", ["base:pg", "a:b:c:d", "-1mm"])
def test_what_is_no_overlap_to_allow(run: Terminal, deep: Path, word: str) -> None:
    done = run("check", deep, "--allow", word)
    assert done.status == 2 and "--allow" in done.err
    assert ("did you mean 'peg'?" in done.err) == (word == "base:pg")


def test_a_pag_allows_overlaps_and_is_written_so() -> None:
    text = TEXT % 0.0247 + "; allow ( peg, base, 0.0003 ); allow ( 0.0001 )"
    pag = read_pag(text, TEMPLATES)
    assert pag.allowed == (AllowedOverlap(0.0003, ("peg", "base")), AllowedOverlap(0.0001))
    assert read_pag(write_pag(pag), TEMPLATES) == pag
    scaled = read_pag("unit = mm; allow ( 0.5 ); root = allow; allow = atomic ()", TEMPLATES)
    assert scaled.allowed == (AllowedOverlap(0.0005),) and scaled.root == "allow"
    none = read_pag(TEXT % 0.0247 + "; allow ( 0 )", TEMPLATES)
    assert none.allowed == (AllowedOverlap(0.0),)
    copies = "root = r; r = mate ( a, b ); b[2] = atomic (); a = atomic (); allow ( a, b, 0.1 )"
    allowed = read_pag(copies, TEMPLATES).allowed
    assert [one.parts for one in allowed] == [("a", "b1"), ("a", "b2")]


@pytest.mark.parametrize(
    ("statement", "code", "said"),
    [
        ("allow ( peg, bse, 0.1 )", "UndefinedLabel", "did you mean 'base'?"),
        ("allow ( s, base, 0.1 )", "BadValue", "name the parts of it"),
        ("allow ( peg, base, -1 )", "BadValue", "allow ( 0.0005 )"),
        ("allow ( )", "Syntax", "up to a depth"),
    ],
)
def test_what_a_pag_cannot_allow(statement: str, code: str, said: str) -> None:
    with pytest.raises(InputError) as error:
        read_pag(f"{TEXT % 0.0247} {statement}", TEMPLATES)
    (found,) = error.value.diagnostics
    assert found.code == code and said in f"{found.message} {found.hint}"


def test_a_peg_too_thick_for_its_hole(run: Terminal, tmp_path: Path) -> None:
    folder = CASES / "peg_0.8mm_too_thick"
    if not folder.is_dir():
        pytest.skip("the cases are not there")
    file = tmp_path / "peg.pag"
    meshes = (
        f'{name} = atomic ( mesh = "{(folder / name).resolve()}.obj" );'
        for name in ("frame", "peg")
    )
    file.write_text(f"root = r; r = mate ( frame, peg ); {' '.join(meshes)}")
    (pair,) = overlaps_of(read(file).product).pairs
    assert pair.depth == pytest.approx(4e-4, abs=1e-8)
    assert run("run", file).status == 1
    assert run("run", file, "--allow", "peg:frame").status == 0


MM = 1e-3
PRESSED = """root = r; r = mate ( a, b );
a = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0, 0.02) );
b = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0.0397, 0.02) )"""
"""Two boxes that overlap by 0.3 mm."""

FOUR = """root = r; r = mate ( u, v ); u = mate ( a, c ); v = mate ( b, d );
a = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0, 0.02) );
b = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0.038, 0.02) );
c = atomic ( box = (0.04, 0.04, 0.04), pos = (0.05, 0, 0.02) );
d = atomic ( box = (0.04, 0.04, 0.04), pos = (0.05, 0.042, 0.02) )"""
"""Two pairs of boxes side by side; a and b overlap by 2 mm, c and d are 2 mm apart."""


def model_of(layout: Layout, overlap: float = 0.5 * MM, fuse: bool = False) -> Model:
    return physical_model(layout, 1, replace(Settings(), overlap=overlap), fuse=fuse)


def _ball(vertices: np.ndarray) -> float:
    return _largest_ball(*_faces(vertices))[1]


def test_the_largest_ball_in_a_body() -> None:
    text = """root = r; r = mate ( a, b, c ); a = atomic ( box = (0.02, 0.04, 0.06) );
    b = atomic ( cylinder = (0.01, 0.06) ); c = atomic ( sphere = 0.03 )"""
    solids = product_geometry(read_pag(text, TEMPLATES)).solids
    assert [breadth(solids[name], 0) for name in "abc"] == [0.01, 0.01, 0.03]
    assert _ball(solids["a"].pieces[0]) == pytest.approx(0.01)
    corners = {tuple(c) for c in np.round(inset(solids["a"].pieces[0], MM) / MM, 6).tolist()}
    assert corners == {(x, y, z) for x in (-9, 9) for y in (-19, 19) for z in (-29, 29)}


def test_what_is_too_thin_to_become_smaller_is_left_out() -> None:
    thin = PRESSED.replace("(0.04, 0.04, 0.04), pos = (0, 0,", "(0.04, 0.04, 0.0005), pos = (0, 0,")
    assert insets_of(laid_out(thin), 0.5 * MM).excluded == (("a", "b"),)


def touching_parts(world: MujocoWorld) -> set[tuple[str, ...]]:
    """The pairs of parts that touched and should not have."""
    found = (sorted(name.split("/")[1][0] for name in pair if name.startswith("part/"))
             for pair in world.inspection.unintended)  # fmt: skip
    return {tuple(pair) for pair in found if len(pair) == 2}


@pytest.mark.parametrize(("overlap", "expected"), [(0.0, set())])
def test_planted_fault_a_part_that_is_pushed_into_another_is_seen(
    overlap: float, expected: set[tuple[str, str]]
) -> None:
    """While the carrier takes the first product away, the robots that have the next two parts go on
    to where they meet, and beyond. Without a tolerance the parts are left out, and nothing is
    seen."""
    chosen = replace(Settings(timestep=0.002, substeps=5), overlap=overlap)
    simulation = ready(laid_out(PRESSED), settings=chosen, jitter=0.0)
    world = simulation.physical
    holdings = world.parts.holdings
    while not (("a", 1) in holdings and ("b", 1) in holdings and held(world) == 2):
        simulation.supervisor.step()
    assert not world.inspection.unintended
    axes, tick = np.array([1, 2]), world.model.settings.steps
    at, speed = world.motion.robots.x[axes].copy(), np.full(2, -0.1)
    mine, other = (holdings[label, 1] for label in "ab")
    while world.d.xpos[other, 1] - world.d.xpos[mine, 1] > 0.0392 and world.time < 5:
        world.move(axes, at, speed, np.zeros(2))
        world.advance(tick)
        world.inspection.tick()
        at += speed * world.model.settings.tick
    assert expected or world.time < 5, "it is there"
    assert touching_parts(world) == expected


def held(world: MujocoWorld) -> int:
    """How many robots other than the carrier hold something while none is joining."""
    hands = world.parts.holdings.in_hands()
    return 0 if world.inspection.joining else len({1, 2} & hands.keys())


def test_in_fused_runs_pairs_are_left_out_part_by_part() -> None:
    """Of two sub-assemblies that are to be joined, a and b are left out and the others not: all are
    pushed into each other."""
    layout = laid_out(FOUR)
    model = model_of(layout, fuse=True)
    assert model.excluded == (("a", "b"),)
    assert {*model.apart} == {((u, "a"), (v, "b")) for u in ("u", "a") for v in ("v", "b")}
    m = load(model)
    d = mujoco.MjData(m)
    u, v = (m.body(f"part/{label}#1").id for label in "uv")
    assert m.body_mass[m.body_parentid == u].sum() == 0.0
    assert m.body_subtreemass[u] == m.body_mass[u] == pytest.approx(0.128)
    solid = m.body_geomnum > 0
    m.geom_contype[:] = m.geom_conaffinity[:] = 1
    m.body_contype[solid] = m.body_conaffinity[solid] = 1
    m.opt.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
    places = (model.carried.centre["u"], model.carried.centre["v"] - [0, 3 * MM, 0])
    for body, at in zip((u, v), places, strict=True):
        d.qpos[m.jnt_qposadr[m.body_jntadr[body]] :][:7] = [*at[:2], 3, 1, 0, 0, 0]
    mujoco.mj_forward(m, d)
    seen = {
        tuple(sorted(m.geom(int(g)).name.rpartition("/")[2] for g in pair))
        for pair in d.contact.geom[d.contact.dist < 0]
    }
    assert {pair for pair in seen if {*pair} <= {*"abcd"}} == {("c", "d")}


def test_a_run_says_how_many_pairs_it_did_not_test(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "four.pag"
    file.write_text(FOUR)
    done = run("run", file)
    told = "0 unintended contacts; 1 of 6 pairs of parts not checked for collisions"
    assert f"{told} (list: -v)" in done.out and "clash" not in done.out
    verbose = run("run", file, "-v").out
    assert f"{told}\n  not checked: a - b\n" in verbose
    document = run("run", file, "--json").json
    assert (document["pairs_tested"], document["pairs_excluded"]) == (5, 1)
    assert document["excluded"] == [["a", "b"]]
    # a and c, b and d are 10 mm apart, a and b 2 mm inside each other
    assert [one["code"] for one in document["warnings"]] == ["Apart", "Overlap"]
    whole = run("run", file, "--overlap", 0.003).out
    assert "0 unintended contacts, 0 engine warnings" in whole and "not checked" not in whole
