"""The report: one file that holds what the log holds and refers to nothing outside itself, and in
which nothing of the user's is taken for anything but text."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import factory
from factory.apps.exports import Subject, exporters
from factory.apps.fidelity.record import QUANTITIES
from factory.apps.log import LogWriter, read_log
from factory.apps.log.failed import failures_of
from factory.apps.report import page, recording_of
from factory.apps.report.drawings import data
from factory.apps.report.failures import failures_data, failures_section
from factory.apps.report.pace import fidelity
from factory.apps.report.page import SCRIPTS
from factory.apps.report.recording import Recording
from factory.apps.report.scene import PLAIN
from factory.apps.report.words import proof
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.support.errors import InputError
from factory.support.tables import table_of
from tests.command_line import Terminal
from tests.failing_runs import failing, paper_layout
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


def test_only_its_own_scripts_may_run(made: Page) -> None:
    digests = {
        f"'sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}'"
        for code in made.code
    }
    allowed = set(re.findall(r"'sha256-[^']+'", made.policy))
    assert allowed == digests and len(digests) == len(SCRIPTS)
    assert "default-src 'none'" in made.policy and "unsafe-eval" not in made.policy


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


def test_a_broken_proof_is_told(recording) -> None:
    net = recording.factory.net
    robot = replace(net.gears[2], transitions=net.gears[2].transitions[::-1])
    gears = (*net.gears[:2], robot, *net.gears[3:])
    told = proof(replace(recording.factory, net=replace(net, gears=gears)))
    assert not told.holds
    assert any(claim.holds is False and claim.why for claim in told.claims)


def _exceeded(figures: Mapping[str, float | None]) -> dict[str, float | None]:
    return {k: value for k, value in figures.items() if QUANTITIES[k].exceeded(value)}


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


@pytest.mark.parametrize(
    ("change", "words"),
    [(lambda h: h.update(start=[0, 99]), "start must be numbers of places, below 19")],
    ids=["start"],
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


def test_a_fused_body_of_which_each_part_is_apart_is_drawn(run: Terminal, tmp_path: Path) -> None:
    """Parts that overlap when finished are not tested against each other, so that each has a body
    of its own in the fused one: this has no geoms then."""
    box = "atomic ( box = ( 0.04, 0.04, 0.04 ), pos = ( {}, 0, 0.02 ) );"
    file, log = tmp_path / "apart.pag", tmp_path / "apart.log"
    parts = f"a = {box.format(0)} b = {box.format(0.036)} c = {box.format(-0.036)}"
    file.write_text(f"root = t; allow ( 0.01 ); t = mate ( s, c ); s = mate ( a, b ); {parts}\n")
    run("run", file, "--fuse", "--units", 1, "--log", log)
    assert run("report", log, "-o", tmp_path / "apart.html").status == 0


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


@pytest.fixture(scope="module")
def failed(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    path = tmp_path_factory.mktemp("failing") / "log"
    failing(path)
    return recording_of(path, paper_layout())


def test_the_section_tells_every_failure(failed: Recording) -> None:
    section, failures = failures_section(failed), failed.log.failures
    assert failures is not None and len(failures.found) >= 4
    assert section.count(" s</th><td>") == len(failures.found)
    for one in failures.found:
        assert f"<tr><th>{one.t:.2f} s</th><td>{one.what}</td><td>{one.done}</td>" in section
    lost = next(u for _, u in failed.log.undone if u.reason == "lost")
    assert ", ".join(lost.transitions) in section
    assert f"{failures.contacts} contact" in section and "1 spare used" in section


def test_the_page_can_draw_what_was_undone(failed: Recording) -> None:
    data, count = failures_data(failed), len(failed.log.fired)
    names = failed.log.header["transitions"]
    assert len(data["undone"]) == len(failed.log.undone) >= 3
    for (after, t, events), (_, undone) in zip(data["undone"], failed.log.undone, strict=True):
        assert 0 <= after <= count and t == pytest.approx(undone.t, abs=1e-4)
        assert [names[event] for event in events] == [*undone.transitions]
    assert any(robots for _, robots in data["stood"])
    text = page(failed)
    assert "Failures</h2>" in text and "spansWithUndone" in text and ".op.undone" in text


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("missed", -1, "counts must be whole numbers from 0"),
        ("stood", [[1.0, ["r9"]]], "'r9' stood"),
        ("found", [{"t": -1}], "lacks the key 'test'"),
    ],
)
def test_what_is_no_account_of_failures_is_refused(
    failed: Recording, key: str, value: object, words: str
) -> None:
    assert failed.log.failures is not None
    told = {**table_of(failed.log.failures), key: value}
    with pytest.raises(ValueError, match=words):
        failures_of(told, frozenset(failed.log.header["robots"]))


def test_csv_says_so(failed: Recording) -> None:
    text = exporters()["csv"].export(Subject(Path("log"), failed.log))
    assert isinstance(text, str)
    kinds = Counter(row["kind"] for row in csv.DictReader(io.StringIO(text)))
    assert kinds.keys() == {"start", "end", "start undone", "end undone"}
