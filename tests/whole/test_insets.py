"""Parts that overlap: up to a tolerance it is taken from the shapes that collide; pairs that
overlap deeper are left out, part by part, and counted."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from math import comb
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from factory.apps.live import Session
from factory.engine.mjcf.insets import insets_of
from factory.engine.mjcf.loading import load
from factory.engine.mjcf.model import Model
from factory.engine.simulation.modelling import physical_model
from factory.engine.simulation.mujoco.fast.neighbours import boxes
from factory.engine.simulation.mujoco.world import MujocoWorld
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.geometry.insets import _faces, _largest_ball, breadth, inset
from factory.floor.geometry.product import product_geometry
from factory.floor.layout.layout import Layout
from factory.floor.mating.depth import exact, polytope
from factory.floor.mating.overlaps import CLEAR
from factory.pipeline import read
from factory.support.engine import mujoco
from factory.support.settings import Settings
from factory.theory.lang import read_pag
from tests.command_line import Terminal
from tests.examples import with_hands
from tests.pag_texts import TEMPLATES, laid_out
from tests.simulation_values import ready

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


# --- faces that recede ------------------------------------------------------------------------


@given(st.integers(0, 10_000))
@settings(max_examples=60, deadline=None)
def test_bodies_whose_faces_recede_by_half_of_it_overlap_no_more(seed: int) -> None:
    rng = np.random.default_rng(seed)
    p, q = (rng.normal(size=(int(rng.integers(6, 30)), 3)) * 0.02 for _ in range(2))
    q = q + rng.normal(size=3) * 0.01
    here = np.zeros((1, 3))
    depth = exact(polytope(p), polytope(q)).heights(here).min()
    half = depth / 2
    if not 0 < half < 0.4 * min(_ball(p), _ball(q)):
        return
    left, right = inset(p, half), inset(q, half)
    assert exact(polytope(left), polytope(right)).heights(here).min() <= 1e-8
    assert exact(polytope(left), polytope(q)).heights(here).min() <= half + 1e-8
    normals = rng.normal(size=(50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    assert ((left @ normals.T).max(axis=0) <= (p @ normals.T).max(axis=0) - half + 1e-9).all()


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


# --- the model --------------------------------------------------------------------------------


def geoms(model: Model) -> dict[str, dict[str, str]]:
    """The geoms of the parts by name, with their class and size."""
    found = ElementTree.fromstring(model.xml).iter("geom")
    return {g.get("name", ""): dict(g.attrib) for g in found if "part/" in g.get("name", "")}


def test_what_collides_is_smaller_and_what_is_seen_and_weighed_is_not() -> None:
    layout = laid_out(PRESSED)
    whole, small = model_of(layout, 0.0), model_of(layout)
    assert whole.excluded == (("a", "b"),) and small.excluded == ()
    drawn, solid = geoms(small)["part/a#1"], geoms(small)["part/a#1/1"]
    assert (drawn["class"], drawn["size"]) == ("shown", "0.02 0.02 0.02")
    half = [float(word) for word in solid["size"].split()]
    assert half == pytest.approx([0.02 - 0.15 * MM] * 3, abs=1e-6), "no more than is needed"
    assert solid["group"] == "3" and "part/a#1/1" not in geoms(whole)
    for name in ("part/a#1", "part/b#1"):
        one, other = (load(model).body(name) for model in (whole, small))
        assert one.mass == other.mass and (one.inertia == other.inertia).all()


def test_only_pairs_that_overlap_deeper_are_left_out() -> None:
    """The tolerance, and who needs which part of it."""
    layout = laid_out(PRESSED)
    found = [insets_of(layout, by * MM).excluded for by in (0.2, 0.29, 0.3, 5)]
    assert found == [(("a", "b"),), (), (), ()], "up to what counts as an overlap"
    assert insets_of(laid_out(FOUR), 0.5 * MM).excluded == (("a", "b"),)
    assert insets_of(laid_out(FOUR), 2 * MM).depths.keys() == {"a", "b"}


def test_what_scrapes_along_each_other_gets_room() -> None:
    """Two boxes flush with a third that they slide along."""
    layout = laid_out(
        """root = r; r = mate ( s, b ); s = mate ( a, c );
        a = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0, 0.02) );
        c = atomic ( box = (0.04, 0.04, 0.04), pos = (0.05, 0, 0.02) );
        b = atomic ( box = (0.01, 0.0401, 0.04), pos = (0.025, 0.00005, 0.02) )"""
    )
    assert {o.parts for o in layout.overlaps} == {("a", "b"), ("b", "c")}
    found = insets_of(layout, 0.5 * MM)
    assert found.excluded == ()
    assert found.depths["b"] == {0: pytest.approx(CLEAR / 2, abs=1e-6)}


def test_faces_do_not_recede_by_less_than_a_micrometre() -> None:
    """Rounding takes a billionth of a millimetre from the room on the way: no body is renamed."""
    layout = laid_out(
        """root = r; r = mate ( s, b ); s = mate ( a, c );
        a = atomic ( box = (0.04, 0.04, 0.04), pos = (0, 0, 0.02) );
        c = atomic ( box = (0.01, 0.04, 0.04), pos = (0.2, 0, 0.02) );
        b = atomic ( box = (0.01, 0.04, 0.04), pos = (0.025049999999, 0, 0.02) )"""
    )
    assert {o.parts for o in layout.overlaps} == {("a", "b")}
    assert insets_of(layout, 0.5 * MM).depths == {}


def test_what_is_too_thin_to_become_smaller_is_left_out() -> None:
    thin = PRESSED.replace("(0.04, 0.04, 0.04), pos = (0, 0,", "(0.04, 0.04, 0.0005), pos = (0, 0,")
    assert insets_of(laid_out(thin), 0.5 * MM).excluded == (("a", "b"),)


@pytest.mark.parametrize("name", ["paper", "stool", "truck"])
def test_products_without_overlaps_are_the_same_to_the_byte(name: str) -> None:
    layout = with_hands(name)
    one, other = model_of(layout, 0.0), model_of(layout)
    assert one.xml == other.xml and one.files == other.files


def test_a_mesh_recedes_in_a_file_of_its_own(tmp_path: Path) -> None:
    """It is shared by three parts, two of which overlap."""
    import trimesh

    (tmp_path / "b.obj").write_text(trimesh.creation.icosphere(1, 0.02).export(file_type="obj"))
    file = tmp_path / "m.pag"
    at = (0, 0.039, 0.09)
    parts = (f'p{i} = atomic ( mesh = "b.obj", pos = (0, {y}, 0) )' for i, y in enumerate(at))
    file.write_text(f"root = r; r = mate ( p0, p1, p2 ); {'; '.join(parts)}")
    model = model_of(read(file).layout, 2 * MM)
    assert model.excluded == ()
    depths = {solid: dict(d) for solid, d in model.insets.depths.items()}
    ((number, depth),) = depths["p0"].items()
    assert depths == {"p0": {0: depth}, "p1": {0: depth}} and number == 0
    (mesh,) = (name for name in model.files if name.endswith(f".1-{round(depth * 1e6)}.stl"))
    m = load(model)
    meshes = [m.mesh(int(i)).name for i in m.geom_dataid[m.geom_group == 3] if i >= 0]
    assert set(meshes) == {f"mesh/{mesh.removesuffix('.stl')}"}
    assert np.ptp(m.mesh_vert[m.mesh(meshes[0]).vertadr[0] :][:9], axis=0).max() < 0.04 - depth


def test_of_a_mesh_of_several_bodies_those_recede_that_overlap(tmp_path: Path) -> None:
    """The second of two boxes in one mesh is 0.2 mm deep in another part."""
    import trimesh

    boxes = [
        trimesh.creation.box((0.02, 0.02, 0.02)).apply_translation((0, y, 0)) for y in (0, 0.03)
    ]
    (tmp_path / "b.obj").write_text(trimesh.util.concatenate(boxes).export(file_type="obj"))
    file = tmp_path / "m.pag"
    file.write_text(
        """root = r; r = mate ( p, q ); p = atomic ( mesh = "b.obj" );
        q = atomic ( box = (0.02, 0.02, 0.02), pos = (0, 0.0498, 0) )"""
    )
    model = model_of(read(file).layout)
    assert model.insets.depths == {"p": {1: 1e-4}, "q": {0: 1e-4}}
    used = [geoms(model)[f"part/p#1/{n}"]["mesh"].rpartition("/")[2] for n in (1, 2)]
    assert [name.partition(".")[2] for name in used] == ["1", "2-100"]
    files = [io.BytesIO(model.files[f"{name}.stl"]) for name in used]
    size = [np.ptp(trimesh.load(file, file_type="stl").vertices, axis=0) for file in files]
    assert size[0] == pytest.approx([0.02] * 3) and size[1] == pytest.approx([0.0198] * 3)
    load(model)


# --- runs -------------------------------------------------------------------------------------


def touching_parts(world: MujocoWorld) -> set[tuple[str, ...]]:
    """The pairs of parts that touched and should not have."""
    found = (sorted(name.split("/")[1][0] for name in pair if name.startswith("part/"))
             for pair in world.inspection.unintended)  # fmt: skip
    return {tuple(pair) for pair in found if len(pair) == 2}


@pytest.mark.parametrize(("overlap", "expected"), [(0.5 * MM, {("a", "b")}), (0.0, set())])
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


def test_a_run_makes_what_overlaps_a_little_without_a_contact() -> None:
    simulation = ready(laid_out(PRESSED))
    run = simulation.run()
    assert run.trouble is None and run.products == 2 and run.physics is not None
    assert run.physics.unintended_contacts == 0 and run.physics.mating_force_max_n < 0.1
    assert (run.physics.pairs_tested, run.physics.pairs_excluded) == (1, 0)


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


def test_a_fused_run_is_as_the_plain_one() -> None:
    """In its events, its pairs, and to a hundredth of a millimetre."""
    layout = laid_out(FOUR)
    plain, fused = (ready(layout, fuse=fuse, units=3).run() for fuse in (False, True))
    assert plain.physics is not None and fused.physics is not None
    assert fused.physics.fused and fused.trouble is None
    assert fused.events == plain.events
    assert fused.physics.excluded == plain.physics.excluded == (("a", "b"),)
    assert fused.physics.pairs_tested == comb(4, 2) - 1
    for record in (plain.physics, fused.physics):
        assert record.unintended_contacts == 0 and record.mating_force_max_n < 0.1
        assert record.product_error_max_mm is not None and record.product_error_max_mm < 0.01
    assert fused.physics.handoff_gap_max_mm == pytest.approx(
        plain.physics.handoff_gap_max_mm, abs=0.01
    )


def test_shells_are_in_the_hands_and_the_unit_of_what_they_are_of() -> None:
    """Else they would pass through other parts and robots, or stop what they are joined with."""
    simulation = ready(laid_out(FOUR), fuse=True)
    world, seen = simulation.physical, set()
    m, masks = world.m, world.parts.masks
    shells = np.flatnonzero(masks.trunk != np.arange(m.nbody))
    trunks = masks.trunk[shells]
    assert len(shells) == len(m.body_parentid[shells]) and (m.body_dofnum[shells] == 0).all()
    while world.delivered() < 2:
        simulation.supervisor.step()
        for figures in (masks.code, masks.unit, m.body_contype, m.body_conaffinity):
            assert (figures[shells] == figures[trunks]).all()
        for shell, trunk in zip(shells, trunks, strict=True):
            (mine,) = np.flatnonzero(m.geom_bodyid == shell)
            (other,) = np.flatnonzero(m.geom_bodyid == trunk)
            assert m.geom_contype[mine] == m.geom_contype[other] == m.body_contype[shell]
        seen |= set(masks.code[shells].tolist())
    assert len(seen) > 2


def test_a_live_view_shows_shells_where_their_bodies_are() -> None:
    """At once where these have been put somewhere."""
    layout = laid_out(FOUR)
    session = Session(lambda: Simulation(layout, RunRequest(units=10**9, fuse=True)), False)
    world = session.simulation.physical
    bodies, trunk = session.bodies, world.parts.masks.trunk
    shells = np.flatnonzero(trunk[bodies] != bodies)
    places = [bodies.tolist().index(b) for b in trunk[bodies[shells]]]
    world.d.xpos[bodies[places]] += 1.0
    session._publish()
    poses = np.frombuffer(session.frame.poses, "<f4").reshape(-1, 7)
    assert len(shells) and (poses[shells] == poses[places]).all()


def test_the_broad_phase_knows_the_boxes_of_shells() -> None:
    found = {}
    for overlap in (0.5 * MM, 3 * MM):
        chosen = replace(Settings(timestep=0.002, substeps=5), overlap=overlap)
        world = ready(laid_out(FOUR), settings=chosen, fuse=True).physical
        mujoco.mj_kinematics(world.m, world.d)
        low, high = boxes(world.m, world.d, world.parts.masks)
        body = world.m.body("part/u#1").id
        found[overlap] = high[body] - low[body]
    assert found[0.5 * MM] == pytest.approx(found[3 * MM], abs=3 * MM)


# --- what is told -----------------------------------------------------------------------------


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


def test_the_tolerance_is_a_setting(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "pressed.pag"
    file.write_text(PRESSED)
    (tmp_path / "factory.toml").write_text("overlap = 0.0\n")
    assert run("run", file, "--json").json["pairs_excluded"] == 1
    assert run("run", file, "--overlap", 0.001, "--json").json["pairs_excluded"] == 0
    done = run("run", file, "--overlap", 0.5)
    assert done.status == 2 and "overlap = 0.5 is not between 0 and 0.005" in done.err


def test_a_report_says_how_many_pairs_were_not_tested(run: Terminal, tmp_path: Path) -> None:
    file, page = tmp_path / "four.pag", tmp_path / "four.html"
    for text, expected in ((FOUR, True), (PRESSED, False)):
        file.write_text(text)
        assert run("report", file, "-o", page, "--units", 1).status == 1  # they overlap
        words = page.read_text()
        told = "1 of 6 pairs of parts were not checked for collisions."
        listed = words.partition(told)[2].partition("</ul>")[0]
        assert (told in words) == expected and ("<li>a - b</li>" in listed) == expected


def test_the_ideal_world_has_no_pairs(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "four.pag"
    file.write_text(FOUR)
    document = run("run", file, "--world", "ideal", "--json").json
    assert document["pairs_tested"] is document["pairs_excluded"] is None
