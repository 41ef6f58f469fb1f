"""The report: one file that holds what the log holds and refers to nothing outside itself, and in
which nothing of the user's is taken for anything but text."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import factory
from factory.apps.analyze import Timing, analyse
from factory.apps.analyze.measured import logged_record
from factory.apps.drawing.canvas import hexadecimal
from factory.apps.drawing.tables import alike, differing
from factory.apps.fidelity.record import QUANTITIES
from factory.apps.log import LogWriter, read_log
from factory.apps.report import page, recording_of
from factory.apps.report.drawings import data, floor_plan, labels_of, links
from factory.apps.report.pace import fidelity, measured, predicted
from factory.apps.report.page import SCRIPTS, json_inside
from factory.apps.report.scene import PLAIN
from factory.apps.report.sections import assembly_tree, ending, heading
from factory.apps.report.words import proof
from factory.engine.record.ending import CutOff
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.run import STEADY
from factory.engine.simulation.simulation import Simulation
from factory.film.look import ROLES
from factory.support.errors import InputError
from factory.theory.problem.pag import PAG, Assembly
from tests.command_line import Terminal
from tests.layout_values import paper_layout
from tests.paths import PAPER, files_in
from tests.report_values import EVIL, Page, altered


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A log of two units of the paper's example."""
    path = tmp_path_factory.mktemp("log") / "paper.log"
    layout = factory.lay_out(factory.compile(factory.load_pag(PAPER)))
    simulation = Simulation(layout, RunRequest("mujoco", units=2, seed=1, jitter=0.2))
    with LogWriter(path, simulation) as writer:
        simulation.run([writer.observe])
    return path


@pytest.fixture(scope="module")
def recording(log: Path):
    return recording_of(log)


@pytest.fixture(scope="module")
def made(recording) -> Page:
    return Page(page(recording))


def test_nothing_outside_the_page_is_referred_to(made: Page) -> None:
    for tag, attributes in made.tags:
        assert tag not in {"link", "iframe", "object", "embed", "base"}
        assert not {"src", "href", "action"} & attributes.keys(), (tag, attributes)
        assert not [name for name in attributes if name.startswith("on")]
    style = next(text for text in made.words if ":root" in text)
    assert "url(" not in style and "@import" not in style


def test_only_its_own_scripts_may_run(made: Page) -> None:
    digests = {
        f"'sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}'"
        for code in made.code
    }
    allowed = set(re.findall(r"'sha256-[^']+'", made.policy))
    assert allowed == digests and len(digests) == len(SCRIPTS)
    assert "default-src 'none'" in made.policy and "unsafe-eval" not in made.policy


def test_the_same_log_gives_the_same_bytes(recording) -> None:
    assert page(recording) == page(recording)


def test_poses_are_those_of_the_log(made: Page, recording) -> None:
    motion, log = recording.motion, recording.log
    time = made.array("time")
    assert time[0] == pytest.approx(log.time[0]) and time[-1] == pytest.approx(recording.end)
    assert np.diff(time).max() < 0.061
    rows = np.searchsorted(log.time[motion.rows], time - 1e-4)
    for body in made.data["frames"]["moving"]:
        error = made.track(f"x{body}", 3).T - motion.position[rows, body]
        assert np.abs(error).max() < 1e-4
    robots = {motion.m.body(f"{r.name}/carriage").id for r in recording.factory.robots}
    assert robots <= set(made.data["frames"]["moving"])


def test_the_token_game_ends_in_the_marking_of_the_log(made: Page, recording) -> None:
    log = recording.log
    assert made.marked_at_end() == set(log.marking[len(log) - 1].tolist())


def test_every_view_has_every_robot_label_transition_and_place(made: Page, recording) -> None:
    wanted = {
        "robot": len(recording.factory.robots),
        "label": len(recording.factory.pag.nodes),
        "transition": len(recording.factory.net.threaded.transitions),
        "place": len(recording.factory.net.threaded.places),
    }
    for kind, count in wanted.items():
        drawn = {a[f"data-{kind}"] for _, a in made.tags if f"data-{kind}" in a}
        assert drawn == {str(n) for n in range(count)}, kind
    things = made.data["scene"]["things"]
    assert {t["robot"] for t in things if "robot" in t} == set(range(wanted["robot"]))
    parts = {labels_of(recording.factory)[leaf.label] for leaf in recording.factory.leaves}
    assert {t["label"] for t in things if t.get("copy")} == parts


def test_what_is_only_shown_is_drawn_and_linked_too(made: Page, recording) -> None:
    """Arms and hands on the floor plan and in 3-D with their robots; feeders, their sliders and
    rods with their parts."""
    robots, leaves = recording.factory.robots, recording.factory.leaves
    hands = sum(hand is not None for hand in recording.layout.hands)
    styles = [a.get("class") for tag, a in made.tags if tag == "polygon"]
    assert styles.count("arm") == len(robots) + hands == len(robots) + 5, "tools have none"
    assert styles.count("boom") == 2 * len(leaves) and styles.count("post") == len(leaves)
    things = made.data["scene"]["things"]
    seen = [t["robot"] for t in things if "robot" in t]
    assert all(seen.count(robot.index) >= 3 for robot in robots)  # rail, carriage, shell
    labels, m = labels_of(recording.factory), recording.motion.m
    theirs = [(m.body(t["body"]).name, t["label"]) for t in things if "label" in t]
    feeders = {pair for pair in theirs if pair[0].startswith("feeder/")}
    assert feeders == {
        (f"feeder/{leaf.label}{body}", labels[leaf.label])
        for leaf in leaves
        for body in ("", "/slider", "/rod")
    }


def test_the_scale_bar_is_beneath_the_robots(recording) -> None:
    """On a floor of 3 m, too, where its letters are larger than the margin."""
    stage = replace(recording.stage, reach=4 * recording.stage.reach)
    svg = floor_plan(stage, labels_of(recording.factory))
    bodies = [stage.m.body(f"{r.name}/carriage").id for r in recording.factory.robots]
    lowest = -1e3 * stage.reach[0, bodies, 1].min()
    found = re.search(r'y="([\d.]+)" font-size="([\d.]+)"[^>]* class="measure"', svg)
    height, size = map(float, found.groups())
    assert height - size > lowest + 30


def test_what_is_linked_is_linked_both_ways(recording) -> None:
    found = links(recording.factory)
    for number, link in enumerate(found["robot"]):
        for transition in link["transitions"]:
            assert number in found["transition"][transition]["robots"]
        for place in link["places"]:
            assert number in found["place"][place]["robots"]
    labels = labels_of(recording.factory)
    sub2 = found["label"][labels["sub2"]]
    assert sub2["solids"] == sorted(labels[n] for n in ("part1", "part2", "sub1", "sub2"))


def test_a_stage_of_a_sub_assembly_is_about_that() -> None:
    plan = factory.compile(factory.load_pag(PAPER.parent / "shelf.pag"))
    found, labels = links(plan), labels_of(plan)
    staged = [o for o in plan.operations if "/" in o.label]
    assert staged
    for operation in staged:
        whole = labels[operation.label.partition("/")[0]]
        assert found["transition"][operation.start]["labels"] == [whole]
        assert operation.index in found["label"][whole]["operations"]


def test_bars_say_what_they_make_whole_or_not_at_all(recording) -> None:
    """Not `mate ...`, which all begin with: what is too long goes to a line out of sight."""
    factory = recording.factory
    assert [o["label"] for o in data(factory)["operations"]] == [
        o.label for o in factory.operations
    ]
    text = page(recording)
    (bar,) = re.findall(r"^\.op \{[^}]*\}", text, re.M)
    assert "overflow: hidden" in bar and "ellipsis" not in bar and "nowrap" not in bar
    assert ".op span { display: inline-block; white-space: nowrap; }" in text
    assert text.count("inside(bar, span.operation)") == 1


def test_what_is_measured_is_what_analyze_says(recording) -> None:
    log, layout = recording.log, recording.layout
    record = logged_record("log", log, layout.factory)
    timing = Timing(layout, seed=1, jitter=0.2)
    told = analyse(timing, 2, record=record).measured
    found = measured(recording)
    assert found.dropoffs == record.dropoffs
    for share, pair in zip(found.busy, told.busy, strict=True):
        assert share * recording.end == pytest.approx(pair.measured * told.last.measured)
    for mean, duration in zip(found.durations, told.durations, strict=True):
        assert mean == pytest.approx(duration.time.measured)


def test_the_proof_is_told_and_checked(recording) -> None:
    told = proof(recording.factory)
    assert told.holds and len(told.claims) == 5 and all(claim.why for claim in told.claims)
    gears = next(claim for claim in told.claims if claim.name == "Gear net")
    assert "6 gears" in gears.why


def test_a_broken_proof_is_told(recording) -> None:
    net = recording.factory.net
    robot = replace(net.gears[2], transitions=net.gears[2].transitions[::-1])
    gears = (*net.gears[:2], robot, *net.gears[3:])
    told = proof(replace(recording.factory, net=replace(net, gears=gears)))
    assert not told.holds
    assert any(claim.holds is False and claim.why for claim in told.claims)


def _exceeded(figures: Mapping[str, float | None]) -> dict[str, float | None]:
    return {k: value for k, value in figures.items() if QUANTITIES[k].exceeded(value)}


def test_a_good_run_has_good_figures(recording) -> None:
    assert recording.verdict.refines and recording.monitor is not None
    assert recording.monitor.refines_net
    figures = fidelity(recording)
    assert not _exceeded(figures)
    assert 0 < figures["handoff_gap_max_mm"] < 0.2 and 0 < figures["grip_gap_max_mm"] < 0.5
    assert 0 < figures["tracking_error_max_mm"] < 0.5


def test_planted_faults_show_in_the_figures(recording) -> None:
    log, m = recording.log, recording.motion.m
    joint = m.jnt_qposadr[m.body("part/part2#1").jntadr[0]]
    qpos, ctrl = np.array(log.qpos), np.array(log.ctrl)
    qpos[:, joint] += 2e-3
    ctrl[:, m.actuator_ctrladr[0]] += 5e-3
    found = fidelity(replace(recording, log=replace(log, qpos=qpos, ctrl=ctrl), layout=None))
    bad = _exceeded(found)
    assert bad["product_error_max_mm"] == pytest.approx(2, abs=0.2)
    assert bad["tracking_error_max_mm"] == pytest.approx(5, abs=0.5)
    fired = log.fired[::-1].copy()
    changed = replace(recording, log=replace(log, fired=fired), layout=None)
    assert not changed.verdict.refines


def test_hostile_names_are_text(log: Path, tmp_path: Path, made: Page) -> None:
    def change(header) -> None:
        header["product"] = EVIL
        header["versions"] = {EVIL: EVIL}
        header["command"] = [EVIL]
        header["pag"]["file"] = EVIL

    found = Page(page(recording_of(altered(log, tmp_path / "evil.log", change))))
    assert [tag for tag, _ in found.tags] == [tag for tag, _ in made.tags]
    assert found.data["name"] == EVIL
    assert sum(EVIL in "".join(found.words[n : n + 1]) for n in range(len(found.words))) >= 3
    assert found.code == made.code


def test_hostile_labels_are_text() -> None:
    nodes = (Assembly(EVIL, "mate", ("a", "b")), Assembly("a", "atomic"), Assembly("b", EVIL))
    pag = PAG(EVIL, nodes)
    drawn = assembly_tree(pag, {node.label: n for n, node in enumerate(nodes)})
    assert "<img" not in drawn and "</script" not in drawn and 'onerror="' not in drawn
    inside = json_inside({"label": EVIL})
    assert "<" not in inside and ">" not in inside and json.loads(inside) == {"label": EVIL}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda h: h.pop("product"), "'product'"),
        (lambda h: h.update(start=[0, 99]), "start must be numbers of places, below 19"),
        (lambda h: h["pag"].update(file=3), "'header.pag.file' must be a text"),
        (lambda h: h.update(seed="x"), "'header.seed' must be a whole number"),
    ],
    ids=["product", "start", "file", "seed"],
)
def test_damaged_logs_are_refused(log: Path, tmp_path: Path, change, words: str) -> None:
    with pytest.raises(InputError) as caught:
        recording_of(altered(log, tmp_path / "bad.log", change))
    assert caught.value.diagnostics[0].code == "BadLog"
    assert words in caught.value.diagnostics[0].message


MESHED = """root = pair; pair = mate ( a, b );
a = atomic ( mesh = "cube.obj", scale = 0.04 );
b = atomic ( box = (0.02, 0.02, 0.02), pos = (0.05, 0, 0.02) )"""

CUBE = """v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"""


def test_a_log_is_enough_where_meshes_are_gone(run, tmp_path: Path, out: Path) -> None:
    (tmp_path / "pair.pag").write_text(MESHED)
    (tmp_path / "cube.obj").write_text(CUBE)
    kept = tmp_path / "pair.log"
    assert run("run", tmp_path / "pair.pag", "--units", 1, "--log", kept, "--quiet").status == 0
    assert run("report", kept, "-o", out / "one.html", "--json").json["predicted"]
    (tmp_path / "cube.obj").unlink()
    assert run("monitor", kept, "--quiet").status == 0
    done = run("report", kept, "-o", out / "two.html")
    assert done.status == 0 and "no predictions: there is no mesh file 'cube.obj'" in done.out
    found = Page((out / "two.html").read_text("utf-8"))
    assert any("No prediction: there is no mesh file" in words for words in found.words)
    assert len(found.data["scene"]["things"]) == len(
        Page((out / "one.html").read_text("utf-8")).data["scene"]["things"]
    )


def test_meshes_beside_the_log_are_found_from_elsewhere(
    run, tmp_path: Path, out: Path, monkeypatch
) -> None:
    (tmp_path / "pair.pag").write_text(MESHED)
    (tmp_path / "cube.obj").write_text(CUBE)
    monkeypatch.chdir(tmp_path)
    assert run("run", "pair.pag", "--units", 1, "--log", "pair.log", "--quiet").status == 0
    assert read_log(Path("pair.log")).header["pag"]["file"] == "pair.pag"
    monkeypatch.chdir(out)
    done = run("report", tmp_path / "pair.log", "-o", "pair.html", "--json")
    assert done.status == 0 and done.json["predicted"]


def test_a_pag_is_run_first_and_leaves_nothing_but_the_page(run, out: Path, monkeypatch) -> None:
    temporary = out.parent / "temporary"
    temporary.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    done = run("report", PAPER, "-o", out / "paper.html", "--units", 1, "--json")
    assert done.status == 0 and done.json["products"] == 1 and done.json["predicted"]
    written = files_in(out)
    assert list(written) == ["paper.html"] and not files_in(temporary)
    assert len(written["paper.html"]) == done.json["bytes"] < 1_000_000


def test_a_pag_is_run_for_as_long_as_its_figures_need(run: Terminal, out: Path) -> None:
    """A cycle time is measured from four products on, and the report makes as many by itself."""
    done = run("report", PAPER, "-o", out / "a.html", "--json")
    assert done.status == 0 and done.json["products"] == STEADY
    assert done.json["cut_off"] is None
    words = Page((out / "a.html").read_text("utf-8")).words
    rows = {words[n]: words[n + 1 : n + 3] for n in range(len(words) - 2)}
    for name in ("Cycle time", "Throughput", "First product", f"Product {STEADY}"):
        predicted, measured = map(float, rows[name])
        assert measured == pytest.approx(predicted, rel=0.02)


def test_what_cannot_be_told_is_refused(run, log: Path, out: Path, tmp_path: Path) -> None:
    ideal = tmp_path / "ideal.log"
    assert run("run", PAPER, "--world", "ideal", "--log", ideal, "--quiet").status == 0
    done = run("report", ideal, "-o", out / "x.html", "--json")
    assert (done.status, done.codes) == (2, ["BadLog"])
    assert run("report", log, "-o", out).status == 2
    assert run("report", log, "-o", log).status == 2
    assert run("report", log).status == 2
    assert run("report", PAPER, "-o", out / "none" / "x.html").status == 2
    assert not files_in(out)


def test_a_log_whose_layout_is_not_of_its_factory(log: Path, tmp_path: Path) -> None:
    """The report says so, and leaves out what follows from the layout."""

    def nearer(header) -> None:
        header["layout"]["guidepaths"][4]["a"][1] += 0.03

    told = recording_of(altered(log, tmp_path / "near.log", nearer))
    assert told.layout is None and "not clear" in told.missing


def test_a_log_that_was_cut_off_is_told_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.log"
    cut.write_bytes(log.read_bytes()[:-4000])
    kept = read_log(cut)
    assert not kept.complete and kept.cut_off is not None
    found = Page(page(recording_of(cut)))
    assert kept.cut_off.with_cause in found.words
    assert any(
        "consistent with the net up to the end of the log." in words for words in found.words
    )


def test_bodies_that_replace_others_are_no_hand_overs(tmp_path: Path) -> None:
    """In a fused run one body comes from out of sight into the place of those that were joined."""
    path = tmp_path / "fused.log"
    simulation = Simulation(paper_layout(), RunRequest(units=2, fuse=True))
    with LogWriter(path, simulation) as writer:
        run = simulation.run([writer.observe])
    recording = recording_of(path)
    assert run.physics is not None and recording.monitor is not None
    assert not recording.monitor.violations
    recounted = recording.monitor.figures or {}
    for key in ("handoff_gap_max_mm", "grip_gap_max_mm"):
        assert recounted[key] == pytest.approx(getattr(run.physics, key), abs=0.02)


def test_a_fused_body_of_which_each_part_is_apart_is_drawn(run: Terminal, tmp_path: Path) -> None:
    """Parts that overlap when finished are not tested against each other, so that each has a body
    of its own in the fused one: this has no geoms then."""
    box = "atomic ( box = ( 0.04, 0.04, 0.04 ), pos = ( {}, 0, 0.02 ) );"
    file, log = tmp_path / "apart.pag", tmp_path / "apart.log"
    parts = f"a = {box.format(0)} b = {box.format(0.036)} c = {box.format(-0.036)}"
    file.write_text(f"root = t; allow ( 0.01 ); t = mate ( s, c ); s = mate ( a, b ); {parts}\n")
    run("run", file, "--fuse", "--units", 1, "--log", log)
    assert run("report", log, "-o", tmp_path / "apart.html").status == 0


# how it looks


def test_roles_have_the_colours_of_films(made: Page, recording) -> None:
    """In 3-D, on the plan, in charts and in the net."""
    paints = recording.stage.paints
    assert paints == {role: hexadecimal(colour) for role, colour in ROLES.items()}
    text = page(recording)
    assert all(f"--paint-{role}: {paint};" in text for role, paint in paints.items())
    assert {*recording.stage.roles} == {"output", "carrier", "fed", "tool"}
    for robot, role in enumerate(recording.stage.roles):
        shapes = [t["shape"] for t in made.data["scene"]["things"] if t.get("robot") == robot]
        colours = {
            "#" + bytes(row).hex() for n in shapes for row in made.array(f"c{n}").reshape(-1, 3)
        }
        assert paints[role] in colours, (robot, role)


def test_corners_have_the_finish_of_their_material(made: Page, recording) -> None:
    m = recording.stage.drawn
    known = {
        (round(255 * max(0.0, float(m.mat_metallic[i]))), round(255 * float(m.mat_roughness[i])))
        for i in range(m.nmat)
        if m.mat_roughness[i] >= 0
    } | {tuple(round(255 * v) for v in PLAIN)}
    shapes = range(len(made.data["scene"]["alphas"]))
    finishes = [made.array(f"m{n}").reshape(-1, 2) for n in shapes]
    assert {tuple(row) for rows in finishes for row in rows.tolist()} <= known
    assert len({tuple(row) for rows in finishes for row in rows.tolist()}) > 4
    assert all(len(made.array(f"v{n}")) == 3 * len(finishes[n]) for n in shapes)


def test_columns_of_equal_figures_are_folded(made: Page) -> None:
    columns, rows = ("", "tools", "cycle", "relays"), [("a", "3", "1", "-"), ("b", "3", "2", "-")]
    assert differing(rows) == [0, 2] and alike(columns, rows) == "tools 3, relays -"
    assert differing(rows[:1]) == [0, 1, 2, 3] and alike(columns, rows[:1]) == ""
    assert differing([]) == [] and alike(columns, []) == ""
    assert "excluded none" in " ".join(made.words)


def test_notes_are_amber_and_failures_red(recording) -> None:
    """A cut-off run has failed; a reservation is a note."""
    cut = CutOff(1.0, 1, 2, "Interrupted", "stopped by the user")
    assert ending(cut).startswith('<p class="notice bad"')
    run, plan, proved = measured(recording), predicted(recording), proof(recording.factory)
    doubts = {"qualified": ("no hand holds 'x'",), "judged": True, "follows": True, "refines": True}
    doubted = replace(recording)
    doubted.__dict__["verdict"] = SimpleNamespace(**doubts)
    cards = heading(doubted, run, plan, proved)
    assert '<span class="doubt">1 <small>reservation</small></span>' in cards
    assert 'class="bad"' not in cards
