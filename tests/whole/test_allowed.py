"""What overlaps when finished is named, with its depth, and fails a run unless it is allowed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from factory.apps.log import read_log
from factory.apps.resume.remade import model_faults
from factory.floor.geometry.overlapping import overlaps_of
from factory.pipeline import read
from factory.support.errors import InputError
from factory.theory.lang import read_pag, write_pag
from factory.theory.problem.pag import AllowedOverlap
from tests.command_line import Terminal
from tests.pag_texts import TEMPLATES
from tests.paths import ROOT
from tests.planted import CLOSED
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
