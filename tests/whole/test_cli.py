"""The command line seen from outside: documents, statuses, diagnostics."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import click

from factory.apps.log import read_log
from factory.commands import commands
from tests.command_line import Terminal
from tests.paths import PAPER, ROOT


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
