"""The command line seen from outside: documents, statuses, diagnostics."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import click
import pytest

from factory.apps.exports.certificate.check import check_certificate
from factory.apps.log import read_log
from factory.commands import commands
from factory.support.version import EXTRAS
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT, files_in

NUMBER = (int, float)
MAYBE = (int, float, type(None))

BUILD: dict[str, Any] = {
    "mjcf": (str, type(None)),
    **dict.fromkeys(("robots", "parts", "joints", "welds"), int),
    **dict.fromkeys(("guidepath_length_m", "area_m2", "compile_s"), NUMBER),
}
RUN: dict[str, Any] = {
    "world": str,
    **dict.fromkeys(("units", "robots", "transitions_fired", "handoffs"), int),
    **dict.fromkeys(("unintended_contacts", "engine_warnings"), int),
    **dict.fromkeys(("sim_time_s", "wall_time_s", "physics_time_s"), NUMBER),
    **dict.fromkeys(("supervisor_time_s", "realtime_factor", "predicted_cycle_time_s"), NUMBER),
    **dict.fromkeys(("handoff_gap_max_mm", "grip_gap_max_mm", "weld_residual_max_mm"), NUMBER),
    "product_error_max_mm": NUMBER,
    "cycle_time_s": MAYBE,
    "refines_net": bool,
    "events": list,
}
OF_PHYSICS = [
    *(
        "physics_time_s",
        "handoffs",
        "handoff_gap_max_mm",
        "weld_residual_max_mm",
        "grip_gap_max_mm",
    ),
    *("product_error_max_mm", "unintended_contacts", "engine_warnings"),
]


def assert_keys(document: dict[str, Any], expected: dict[str, Any]) -> None:
    for key, kinds in expected.items():
        assert key in document
        assert isinstance(document[key], kinds), f"{key} = {document[key]!r}"
        if kinds is int:
            assert not isinstance(document[key], bool)


# --- the documents --------------------------------------------------------------------------------


def test_build_of_the_papers_example(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "paper.xml"
    document = run("build", PAPER, "--mjcf", file, "--json").json
    assert_keys(document, BUILD)
    assert document["mjcf"] == str(file)
    assert document["robots"] == 6
    assert file.is_file()


def test_build_writes_a_folder(run: Terminal, tmp_path: Path) -> None:
    done = run("build", PAPER, "-o", tmp_path / "new" / "folder")
    assert done.status == 0
    written = files_in(tmp_path)
    assert "new/folder/paper.xml" in written
    assert {Path(name).suffix for name in written} >= {".xml", ".svg", ".pnml", ".dot", ".json"}
    assert all(name in done.out for name in written)
    proof = json.loads(written["new/folder/paper.proof.json"])
    assert check_certificate(proof) == []


def test_a_build_lists_what_it_has_written_and_says_how_much_more(run: Terminal, out: Path) -> None:
    """Its meshes, in a folder of their own, behind."""
    words = "build", PAPER.parent / "chest.pag", "-o", out / "chest"
    document = run(*words, "--json").json
    for given in ([], ["-v"]):
        listed = [line for line in run(*words, *given).out.splitlines() if line.startswith("  ")]
        files = [Path(line.strip()) for line in listed if not line.endswith(" more: -v lists them")]
        where = [file.parent.name for file in files]
        assert where == sorted(where, key="chest_meshes".__eq__) and "chest_meshes" in where
        if given:
            assert sorted(files) == sorted(map(Path, document["files"]))
            assert len(listed) == len(files)
        else:
            assert len(listed) == 20 and listed[-1].split()[1] == str(len(document["files"]) - 19)


def test_run_in_mujoco(run: Terminal) -> None:
    done = run("run", PAPER, "--units", 2, "--json")
    document = done.json
    assert done.status == 0
    assert_keys(document, RUN)
    assert document["world"] == "mujoco"
    assert document["products"] == document["units"] == 2
    assert document["refines_net"]
    assert document["cycle_time_s"] is None
    assert len(document["events"]) == document["transitions_fired"] == 28
    assert document["handoffs"] == 2 * 11
    for event in document["events"]:
        assert set(event) >= {"t", "transition"}
    times = [event["t"] for event in document["events"]]
    assert times == sorted(times)
    assert document["events"][-1]["transition"] == "dropoff_e"
    spent = document["physics_time_s"] + document["supervisor_time_s"]
    assert spent == pytest.approx(document["wall_time_s"])
    factor = document["sim_time_s"] / document["wall_time_s"]
    assert document["realtime_factor"] == pytest.approx(factor)


def test_keys_of_physics_are_null_in_the_ideal_world(run: Terminal) -> None:
    document = run("run", PAPER, "--world", "ideal", "--units", 6, "--json").json
    assert_keys(document, {k: v for k, v in RUN.items() if k not in OF_PHYSICS})
    assert all(document[key] is None for key in OF_PHYSICS)
    assert document["cycle_time_s"] == pytest.approx(document["predicted_cycle_time_s"], rel=0.02)


def test_programs_export_templates_doctor(run: Terminal, tmp_path: Path) -> None:
    programs = run("programs", PAPER, "--json").json["programs"]
    assert list(programs) == [f"r{n}" for n in range(1, 7)]
    one = run("programs", PAPER, "--robot", "r3")
    assert one.status == 0
    assert "π_3 ∘ mate(x_5, x_6, x_3)" in one.out
    assert "r4" not in one.out
    for form, word in (("pnml", "<pnml"), ("dot", "digraph")):
        assert word in run("export", PAPER, "--format", form).out
        assert word in run("export", PAPER, "--format", form, "--json").json["text"]
        file = tmp_path / f"paper.{form}"
        assert run("export", PAPER, "--format", form, "-o", file).out == f"{form}: {file}\n"
        assert word in file.read_text("utf-8")
    shown = run("templates", "--json").json
    assert {t["name"] for t in shown["templates"]} >= {
        *("atomic", "mate", "insert", "weld", "dropoff", "inspect", "press", "glue")
    }
    assert {r["name"] for r in shown["robots"]} >= {"dot"}
    assert "mate" in run("templates").out
    found = run("doctor", "--json")
    assert found.status in (0, 3)
    assert {c["name"] for c in found.json["checks"]} >= {"python", "mujoco", "engine", "rendering"}
    assert all(c["ok"] or c["mend"] for c in found.json["checks"])


def test_version_and_help(run: Terminal) -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert run("--version").out.strip() == f"factory {version}"
    assert run("--version", "--json").json["version"] == version
    text = run("--help").out
    for command in ("check", "build", "run", "render", "programs", "export", "templates", "doctor"):
        assert command in text
        done = run(command, "--help")
        assert done.status == 0
        assert "--json" in done.out
        assert run(command, "-h").status == 0
    assert "..." not in text.partition("Commands:")[2], "each summary fits its line"


def test_doctor_names_all_packages_and_extras(run: Terminal) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

    def names(required: list[str]) -> set[str]:
        return {re.split(r"[>\[]", one)[0] for one in required}

    for_developers = {"all", "test", "dev", "docs", "browser", "readers"}
    extras = {
        name: names(required)
        for name, required in project["optional-dependencies"].items()
        if name not in for_developers
    }
    assert {name: set(packages) for name, (packages, _) in EXTRAS.items()} == extras
    found = run("doctor", "--json").json
    assert names(project["dependencies"]) <= {check["name"] for check in found["checks"]}
    assert {extra["name"] for extra in found["extras"]} == set(extras)
    lines = run("doctor").out.splitlines()
    for extra in found["extras"]:
        (line,) = (line for line in lines if line.split()[:1] == [extra["name"]])
        assert extra["for"] in line
        assert extra["installed"] or f"pip install 'klavins-factory[{extra['name']}]'" in line


def test_quiet_hides_progress_and_warnings_never_the_answer(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "big.pag"
    file.write_text("root = a; a = mate ( p, q ); p = atomic ( box = (9, 1, 1) ); q = atomic()")
    log = tmp_path / "run.log"
    words: tuple[tuple[object, ...], ...] = (
        ("check", file),
        ("build", file, "-o", tmp_path / "made"),
        ("run", PAPER, "--log", log),
        ("monitor", log),
        ("analyze", PAPER),
        ("sweep", PAPER, "--world", "ideal", "--vary", "seed=0:1", "-o", tmp_path / "r.db"),
        ("sweep", tmp_path / "r.db", "--summary"),
        ("new", tmp_path / "chime"),
        ("doctor",),
    )
    for command in words:
        done = run(*command, "-q")
        assert done.out.strip(), command
        assert "warning" not in done.err and "so far" not in done.err, command
    for module in (ROOT / "factory" / "commands").glob("*.py"):
        assert "out.quiet" not in module.read_text(), f"{module.name}: an answer depends on -q"


def test_a_pag_may_come_in(tmp_path: Path) -> None:
    text = PAPER.read_text()

    def piped(*words: object, text: str = text) -> tuple[int, str, str]:
        command = [sys.executable, "-m", "factory", *map(str, words)]
        done = subprocess.run(command, input=text, capture_output=True, text=True, cwd=ROOT)
        return done.returncode, done.stdout, done.stderr

    log = tmp_path / "run.log"
    status, out, _ = piped("run", "-", "--units", 2, "--world", "ideal", "--log", log)
    assert status == 0 and "2 of 2 products" in out and read_log(log).header["product"] == "stdin"
    status, _, err = piped("check", "-", text="root = a")
    assert status == 2 and err.startswith("<stdin>:1:8: UndefinedLabel")


def test_help_is_in_sections(run: Terminal) -> None:
    out = run("run", "--help").out
    titles = re.findall(r"^(\w[\w ]+):$", out, re.M)
    assert titles == [
        *("Options", "Run", "Failures", "Pictures", "Robots", "Floor", "Motion and physics"),
        "Advanced",
        "Printing",
    ]
    assert out.index("Run:") < out.index("--units") < out.index("Failures:") < out.index("--faults")
    common = run("run", "-h").out
    assert set(re.findall(r" --[a-z]+", common)) < set(re.findall(r" --[a-z]+", out))
    assert "--units" in common
    assert "--substeps" not in common
    left = out.partition("Advanced:")[2].partition("Printing:")[0].count("\n  -")
    assert common.endswith(f"--help lists {left} more options.\n")
    for name, command in commands().items():
        shown = run(name, "--help").out
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden:
                assert shown.count(f"{option.opts[-1]} ") + shown.count(f"{option.opts[-1]}\n"), (
                    name
                )


def test_people_get_a_summary(run: Terminal) -> None:
    out = run("run", PAPER, "--units", 4).out
    for word in ("4 of 4 products", "cycle time", "bottleneck r3", "Utilisation", "refines"):
        assert word in out
    assert "more robot" not in out  # six are all that there are
    assert "live: yes" in run("check", PAPER).out
    assert len(run("templates", "-v").out) > len(run("templates").out)


def test_a_table_says_that_it_is_cut(run: Terminal) -> None:
    words = "run", PAPER.parent / "lamp.pag", "--world", "ideal"
    robots = run(*words, "--json").json["robots"]
    out = run(*words).out
    assert out.endswith(f"... and {robots - 6} more robots (-v shows all)\n")
    assert len(re.findall(r"^ r\d+ ", out, re.M)) == 6
    out = run(*words, "-v").out
    assert "more robot" not in out and len(re.findall(r"^ r\d+ ", out, re.M)) == robots


def test_more_is_said_of_what_was_written(run: Terminal, tmp_path: Path) -> None:
    cart = PAPER.parent / "cart.mpd"
    for words in (("new", tmp_path / "a"), ("import", cart, "-o", tmp_path / "b")):
        said = run(*words, "-v").out.splitlines()
        assert sorted(line.strip() for line in said if line.startswith("  /")) == sorted(
            str(path) for path in Path(words[-1]).rglob("*") if path.is_file()
        )
    words = "report", PAPER, "--units", 1, "-o", tmp_path / "paper.html"
    assert "Utilisation" not in run(*words).out
    assert "1 of 1 products" in (said := run(*words, "-v").out) and "Utilisation" in said


# --- diagnostics ----------------------------------------------------------------------------------


def test_unprintable_signs_cannot_break_a_line(run: Terminal, tmp_path: Path) -> None:
    file = tmp_path / "new\nline.pag"
    file.write_bytes(b"root = \x1b[31m\x07;\tx")
    err = run("check", file).err
    assert "\x1b" not in err
    assert "new line.pag:1:" in err.splitlines()[0]


# --- proofs ---------------------------------------------------------------------------------------


def test_what_a_log_has_not_is_refused(
    run: Terminal, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it was set beforehand, and not for this log alone."""
    log = out / "run.log"
    assert run("run", PAPER, "--log", log, "-q").status == 0
    page, picture = ["report", log, "-o", out / "page.html"], ["render", log, "-o", out / "a.png"]
    words = ["--units", "1", "--relay", "--no-stage", "--seed", "0", "--floor", "4x4", "--wip", "1"]
    for command, more in ((page, []), (picture, ["--world", "mujoco", "--fuse", "--from", "x"])):
        refused = run(*command, *words, *more)
        given = [word for word in (*words, *more) if word.startswith("--")]
        assert refused.status == 2
        assert refused.err.count(f" applies to a PAG; '{log}' is a log\n") == len(given)
    assert files_in(out).keys() == {"run.log"}
    (out / "factory.toml").write_text('units = 2\nwip = 2\nfloor = "9x9"\nspeed = 0.3')
    monkeypatch.setenv("FACTORY_SEED", "3")
    assert run(*page).status == 0
    shown = ["--size", "640x360", "--fps", 5, "--camera", "top", "--with", "net", "--title", "A"]
    assert run(*picture, *shown, "--at", 1, "--quiet").status == 0
    assert "--poster applies to a film; this is a still" in run(*picture, "--poster", "b.png").err


# --- templates ----------------------------------------------------------------------------------

OWN = """{name} = (R, j, ~, <a; b>, F) where R = < dot, tool >; j = 1; ~ = {{ S1 = A2 }};
<a; b> = < LAB1, nopart; LAB2, nopart >;
F = navigation on W to ( S1 + 2r, A2 + 2r ) within eps for dwell; parameters = ( dwell = {dwell} );
"""


def test_folders_of_templates_are_searched_in_order(run: Terminal, tmp_path: Path) -> None:
    for folder, dwell in (("one", 1.5), ("two", 2.5)):
        (tmp_path / folder).mkdir()
        for name in ("rivet", "weld"):
            (tmp_path / folder / f"{name}.op").write_text(OWN.format(name=name, dwell=dwell))
    (tmp_path / "two" / "bolt.op").write_text(OWN.format(name="bolt", dwell=3.5))
    words = ["--templates", tmp_path / "one", "--templates", tmp_path / "two"]
    shown = {t["name"]: t for t in run("templates", *words, "--json").json["templates"]}
    dwells = [shown[n]["parameters"]["dwell"] for n in ("rivet", "weld", "bolt", "glue")]
    assert dwells == [1.5, 1.5, 3.5, 2.0]
    file = tmp_path / "p.pag"
    file.write_text("root = d; d = bolt(c); c = rivet(b); b = weld(a); a = atomic()")
    assert run("run", file, *words, "--json").json["sim_time_s"] > 1.5 + 1.5 + 3.5
    assert run("check", file).status == 2
    for command in (["check"], ["build"], ["programs"], ["export", "--format", "dot"]):
        assert run(command[0], file, *command[1:], *words).status == 0
