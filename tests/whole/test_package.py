"""The Python package: its functions do what the commands do, its values are checked and show
themselves, its types reach a user's script, and the clash of its import name is said. What is a
table is one for pandas, too: the same rows, figures by their names in `--json`. A project is a PAG
with all that follows from it; options travel as values with types. Products of our own with true
clearances: a chest of drawers, of which everything slides, and a gearbox, which needs the lift.
Nothing of them touches, on the way or when finished, in the engine's own eyes."""

from __future__ import annotations

import ast
import json
import math
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import factory
from factory.apps.drawing.tables import Tabular
from factory.commands.requests import ProjectOptions
from factory.floor.layout.request import Ground
from factory.pipeline import read
from factory.support import namesake
from factory.support.errors import InputError
from factory.support.settings import Settings
from factory.theory.problem.plan import Plan
from tests.apps.planning.test_plan_models import PEG
from tests.command_line import Terminal
from tests.opengl import needs_gl
from tests.paths import PAPER, ROOT, files_in
from tests.plan_puzzles import pinwheel, source

WRONG: tuple[tuple[Callable[[Any], object], tuple[object, ...]], ...] = (
    (lambda p: factory.run(p, world="moojoco"), ("run", PAPER, "--world", "moojoco")),
    (lambda p: factory.run(p, start="nowhere"), ("run", PAPER, "--from", "nowhere")),
    (
        lambda p: factory.run(p, distributed=True, spares=1),
        ("run", PAPER, "--distributed", "--spares", 1),
    ),
    (lambda p: factory.lay_out(p, floor="1e9x3"), ("build", PAPER, "--floor", "1e9x3")),
    (lambda p: factory.compile(p, robots=2), ("check", PAPER, "--robots", 2)),
    (lambda p: factory.compile(p, cycle=-1), ("check", PAPER, "--cycle", -1)),
    (lambda p: factory.compile(p, parallel={"sub9": 2}), ("check", PAPER, "--parallel", "sub9=2")),
    (lambda p: factory.build(p, wip=0), ("build", PAPER, "--wip", 0)),
    (lambda p: factory.export(p, "pnlm"), ("export", PAPER, "--format", "pnlm")),
    (lambda p: factory.export(p, "csv"), ("export", PAPER, "--format", "csv")),
    (lambda p: factory.analyze(p, faster={"r1": -3}), ("analyze", PAPER, "--faster", "r1=-3")),
    (
        lambda p: factory.sweep(p, "a.db", {"sed": [1]}),
        ("sweep", PAPER, "--vary", "sed=1", "-o", "a.db"),
    ),
    (
        lambda p: factory.sweep(p, "a.db", {"jitter": [7]}),
        ("sweep", PAPER, "--vary", "jitter=7", "-o", "a.db"),
    ),
    (
        lambda p: factory.render(p, "a.png", camera="nose"),
        ("render", PAPER, "-o", "a.png", "--camera", "nose"),
    ),
    (lambda p: factory.render(p, "a.png", at=-1), ("render", PAPER, "-o", "a.png", "--at", -1)),
    (lambda p: factory.load_pag("nowhere.pag"), ("check", "nowhere.pag")),
    (lambda p: factory.plan("nowhere", "a", aim="speed"), ("plan", "nowhere", "--for", "speed")),
    (lambda p: factory.plan("nowhere", "a"), ("plan", "nowhere")),
)


@pytest.mark.parametrize(
    ("call", "words"),
    WRONG,
    ids=lambda value: " ".join(map(str, value[2:4])) if isinstance(value, tuple) else "",
)
def test_a_wrong_call_gives_the_code_of_the_command(
    call: Callable[[Any], object],
    words: tuple[object, ...],
    run: Terminal,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(factory.FactoryError) as caught:
        call(PAPER)
    done = run(*words, "--json")
    assert done.status == caught.value.exit_status
    assert done.codes == [diagnostic.code for diagnostic in caught.value.diagnostics]
    assert not list(tmp_path.iterdir())


def test_a_floor_is_two_lengths() -> None:
    with pytest.raises(factory.InputError, match="is not two positive lengths"):
        factory.lay_out(PAPER, floor=4)


def test_a_floor_is_given_in_numbers_or_as_a_command_takes_it() -> None:
    layouts = [factory.lay_out(PAPER, floor=floor) for floor in ("2x1.5", (2, 1.5), [2.0, 1.5])]
    assert len({str(layout.guidepaths) for layout in layouts}) == 1
    width, depth = (layouts[0].floor[i + 2] - layouts[0].floor[i] for i in (0, 1))
    assert 0 < width <= 2 and 0 < depth <= 1.5


def test_what_is_no_product_is_told() -> None:
    with pytest.raises(factory.InputError, match="42 is no path"):
        factory.run(42)  # type: ignore[arg-type]


def test_every_stage_gives_the_same_run() -> None:
    pag = factory.load_pag(PAPER)
    plan = factory.compile(pag)
    layout = factory.lay_out(plan)
    stages = (str(PAPER), PAPER, pag, plan, layout, read(PAPER))
    runs = [
        factory.run(stage, world="ideal", units=2, seed=3, jitter=0.2).events for stage in stages
    ]
    assert all(run == runs[0] for run in runs)


def test_a_build_is_that_of_the_command(run: Terminal, tmp_path: Path) -> None:
    assert run("build", PAPER, "-o", tmp_path / "command").status == 0
    built = factory.build(PAPER, tmp_path / "function")
    names = {path.relative_to(tmp_path / "command") for path in (tmp_path / "command").rglob("*.*")}
    assert names == {path.relative_to(tmp_path / "function") for path in built.files}
    for name in names:
        same = (tmp_path / "command" / name).read_bytes() == (
            tmp_path / "function" / name
        ).read_bytes()
        assert same, name
    again = factory.run(tmp_path / "function" / "plan.json", world="ideal", units=2)
    assert again.events == factory.run(PAPER, world="ideal", units=2).events


def test_a_plan_is_a_product_and_what_interlocks_is_refused(tmp_path: Path) -> None:
    source(tmp_path, PEG)
    made = factory.plan(tmp_path / "puzzle.pag", tmp_path / "out", replan=True, seconds=60)
    assert made.pag == factory.load_pag(made.files[0]) and made.planned.optimal
    assert {part.label for part in made.pag.parts()} == {*PEG}
    source(tmp_path, pinwheel())
    with pytest.raises(factory.InputError) as caught:
        factory.plan(tmp_path / "puzzle.pag", tmp_path / "none", replan=True)
    assert [diagnostic.code for diagnostic in caught.value.diagnostics] == ["CannotAssemble"]
    assert not (tmp_path / "none").exists()


def test_a_sweep_runs_in_a_script(tmp_path: Path) -> None:
    """Its processes do not run the script again."""
    script = tmp_path / "script.py"
    script.write_text(
        "import factory\nprint('begun')\n"
        f"made = factory.sweep({str(PAPER)!r}, 'a.db', {{'seed': range(2)}}, world='ideal')\n"
        "print(made.done)\n"
    )
    env = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, script], cwd=tmp_path, env=env, capture_output=True)
    assert done.stdout.decode().split() == ["begun", "2"], done.stderr.decode()


def test_values_are_shown_in_a_line_and_as_a_picture() -> None:
    plan = factory.compile(factory.load_pag(PAPER))
    layout = factory.lay_out(plan)
    for value in (plan.pag, plan, plan.net, layout):
        assert len(repr(value)) < 100 and "\n" not in repr(value)
        assert "<svg" in str(value._repr_svg_())
    made = factory.run(layout, world="ideal")
    assert repr(made) == f"<Run in ideal: succeeded, 1 of 1 products in {made.sim_time_s:.2f} s>"
    assert "1 of 1 products" in str(made._repr_html_())
    assert "<script" in factory.report(layout, units=1)._repr_html_().replace("&lt;", "<")


def test_results_are_shown_in_a_line_and_as_a_table(tmp_path: Path) -> None:
    layout = factory.lay_out(PAPER)
    swept = factory.sweep(PAPER, tmp_path / "a.db", {"seed": [0, 1]}, world="ideal")
    results = (
        (factory.verify(PAPER), "<Verdict by structure: gear net, live, safe", "proved"),
        (layout.certificate, "<Certificate: holds, 6 robots", "clearance_m"),
        (factory.build(PAPER, tmp_path / "built"), "<Built: a model of 11 bodies", "kB"),
        (factory.analyze(layout), "<Analysis of sub3: cycle time 2.5", "with a second one"),
        (factory.pareto(PAPER, layouts=False), "<ParetoFront of paper: ", "robots"),
        (swept, "<Summary of sub3: 2 runs done, 0 failed", "cycle time [s]"),
    )
    for value, line, word in results:
        assert repr(value).startswith(line), repr(value)
        assert len(repr(value)) < 140 and "\n" not in repr(value)
        assert "<table" in str(value._repr_html_()) and word in str(value._repr_html_())


def test_a_refusal_is_shown_without_the_code_that_found_it(tmp_path: Path) -> None:
    (tmp_path / "bad.pag").write_text("root = a; a = mate ( b );")
    with pytest.raises(factory.InputError) as caught:
        factory.load_pag(tmp_path / "bad.pag")
    assert caught.value._render_traceback_() == str(caught.value).splitlines()


def test_a_revision_is_a_line_and_a_drawing() -> None:
    made = factory.revise(PAPER, PAPER)
    assert (
        repr(made)
        == "<Revision paper.pag -> paper.pag: 6 robots stay, 6 as they were, 0 new, 0 gone>"
    )
    assert made._repr_svg_().count('class="dot stays"') == 6


def test_what_is_too_large_is_not_drawn(tmp_path: Path) -> None:
    file = tmp_path / "many.pag"
    rows = [f"s{n} = mate ( s{n + 1}, p{n} ); p{n} = atomic();" for n in range(250)]
    file.write_text("root = s0;\n" + "\n".join(rows) + "\ns250 = atomic()\n")
    pag = factory.load_pag(file)
    assert pag._repr_svg_() is None
    assert factory.compile(pag)._repr_svg_() is None


def cells() -> list[str]:
    """The code of the notebook, cell by cell; it has no outputs."""
    document = json.loads((ROOT / "docs" / "notebook.ipynb").read_text("utf-8"))
    assert document["nbformat"] == 4
    code = [cell for cell in document["cells"] if cell["cell_type"] == "code"]
    assert not any(cell["outputs"] or cell["execution_count"] for cell in code)
    return ["".join(cell["source"]) for cell in code]


@needs_gl
@pytest.mark.slow
def test_the_notebook_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT / "docs")
    names: dict[str, Any] = {}
    shown = []
    for text in cells():
        *before, last = ast.parse(text).body
        if isinstance(last, ast.Expr):
            exec(compile(ast.Module(before, []), "<cell>", "exec"), names)
            shown.append(eval(compile(ast.Expression(last.value), "<cell>", "eval"), names))
        else:
            exec(text, names)
    pictures = [value._repr_svg_() for value in shown if hasattr(value, "_repr_svg_")]
    assert len(pictures) == 4 and all(pictures)
    assert "iframe" in names["run"]._repr_html_()
    assert (names["folder"] / "paper.png").stat().st_size > 10_000
    shutil.rmtree(names["folder"])


SCRIPT = """
import factory
reveal_type(factory.load_pag("p.pag"))
reveal_type(factory.compile("p.pag"))
reveal_type(factory.lay_out("p.pag"))
reveal_type(factory.run("p.pag"))
reveal_type(factory.run("p.pag").cycle_time_s)
reveal_type(factory.verify("p.pag").live)
reveal_type(factory.build("p.pag").files)
reveal_type(factory.analyze("p.pag").bottlenecks)
reveal_type(factory.plan("a", "b").pag)
factory.run("p.pag", world="moojoco")
factory.run("p.pag", unit=3)
"""
TYPES = (
    "factory.theory.problem.pag.PAG",
    "factory.theory.plant.factory.Factory",
    "factory.floor.layout.layout.Layout",
    "factory.engine.simulation.run.Run",
    "float | None",
    "bool | None",
    "tuple[pathlib.Path, ...]",
    "tuple[str, ...]",
    "factory.theory.problem.pag.PAG",
)


@pytest.mark.slow
def test_types_reach_the_script_of_a_user(tmp_path: Path) -> None:
    api = pytest.importorskip("mypy.api", reason="mypy is in the extra `dev`")
    (tmp_path / "script.py").write_text(SCRIPT)
    environment = {**os.environ, "MYPYPATH": str(ROOT)}
    words = ["--strict", "--follow-imports=silent", "--config-file", ROOT / "pyproject.toml"]
    done = subprocess.run(
        [sys.executable, "-m", api.__name__.split(".")[0], *words, tmp_path / "script.py"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
    )
    lines = done.stdout.splitlines()
    revealed = [line.split('"')[1] for line in lines if "Revealed type" in line]
    assert tuple(revealed) == TYPES, done.stdout + done.stderr
    assert any("arg-type" in line and "Literal" in line for line in lines)
    assert any('Unexpected keyword argument "unit"' in line for line in lines)
    assert (ROOT / "factory" / "py.typed").is_file()


def installed(folder: Path, files: dict[str, str]) -> dict[str, str]:
    """This package in a folder, with files written over it; the environment of a process that
    imports it from there."""
    shutil.copytree(ROOT / "factory", folder / "factory", ignore=shutil.ignore_patterns("*.pyc"))
    for name in ("templates", "mjcf"):
        (folder / name).symlink_to(ROOT / name)
    for name, text in files.items():
        (folder / "factory" / name).write_text(text)
    return {**os.environ, "PYTHONPATH": str(folder)}


def python(*words: str, folder: Path, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=env, capture_output=True, text=True
    )


def test_factory_boy_installed_before_is_told_at_import(tmp_path: Path) -> None:
    env = installed(tmp_path, {"declarations.py": ""})
    done = python("-c", "import factory; print(factory.load_pag)", folder=tmp_path, env=env)
    assert done.stdout and "factory_boy is broken by this package: give each" in done.stderr


def test_factory_boy_installed_after_is_told_by_doctor(tmp_path: Path) -> None:
    env = installed(tmp_path, {"declarations.py": "", "__init__.py": "class Factory: ...\n"})
    (tmp_path / "factory_boy-3.3.3.dist-info").mkdir()
    (tmp_path / "factory_boy-3.3.3.dist-info" / "METADATA").write_text("Version: 3.3.3\n")
    done = python("-m", "factory", "doctor", "--json", folder=tmp_path, env=env)
    name = next(c for c in json.loads(done.stdout)["checks"] if c["name"] == "import name")
    assert done.returncode == 3 and not name["ok"] and "environment" in name["mend"]
    assert "factory_boy 3.3.3: it was installed after this package" in name["found"]


def test_nothing_is_said_without_factory_boy(
    run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not namesake.clash()
    monkeypatch.setattr("factory.support.namesake.release", lambda name: "3.3.3")
    assert "factory_boy 3.3.3, which has the same import name" in run("doctor").out


def swept(folder: Path) -> Tabular:
    values = {"seed": [0, 1], "speed": [0.2, 0.3]}
    return factory.sweep(PAPER, folder / "a.db", values, world="ideal", units=4, jobs=1)


TABLES: dict[str, tuple[Callable[[Path], Tabular], int, set[str]]] = {
    "sweep": (swept, 2, {"speed", "done", "failed", "cycle_time_s", "cycle_time_s_deviation"}),
    "analyze": (lambda _: factory.analyze(PAPER), 6, {"robot", "busy", "gain_second_robot_s"}),
    "pareto": (
        lambda _: factory.pareto(PAPER, layouts=False),
        3,
        {"robots", "tools", "estimated_cycle_time_s"},
    ),
    "fidelity": (
        lambda _: factory.fidelity(PAPER, seeds=2, units=1, jobs=1),
        2,
        {"seed", "passed", "tracking_error_max_mm"},
    ),
}
"""For each command its value, the number of rows at least, and some of the columns."""


@pytest.fixture(scope="module", params=TABLES)
def case(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Tabular, int, set[str]]:
    make, rows, columns = TABLES[request.param]
    return make(tmp_path_factory.mktemp("frames")), rows, columns


def test_records_are_plain_rows(case: tuple[Tabular, int, set[str]]) -> None:
    value, rows, columns = case
    records = value.records()
    assert len(records) >= rows
    for record in records:
        assert columns <= record.keys() == records[0].keys()
        assert all(v is None or isinstance(v, str | int | float) for v in record.values())


def test_a_frame_has_the_records(case: tuple[Tabular, int, set[str]]) -> None:
    pandas = pytest.importorskip("pandas", reason="the extra `pandas` is not installed")
    value, *_ = case
    frame, records = value.to_frame(), value.records()
    assert isinstance(frame, pandas.DataFrame)
    assert [*frame.columns] == [*records[0]]
    for row, record in zip(frame.to_dict("records"), records, strict=True):
        for name, figure in record.items():
            same = row[name] == figure
            assert same or (figure is None and (row[name] is None or math.isnan(row[name])))


def test_pandas_gets_the_records(
    case: tuple[Tabular, int, set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where pandas is not installed, a stand-in takes them."""
    value, *_ = case
    pandas: Any = ModuleType("pandas")
    pandas.DataFrame = type("DataFrame", (), {"from_records": staticmethod(lambda rows: rows)})
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    assert value.to_frame() == value.records()


def test_without_pandas_the_extra_is_named(
    case: tuple[Tabular, int, set[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    value, *_ = case
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(factory.MissingError) as caught:
        value.to_frame()
    (diagnostic,) = caught.value.diagnostics
    assert caught.value.exit_status == 3 and diagnostic.code == "Missing"
    assert diagnostic.message.startswith("a data frame needs pandas")
    assert diagnostic.hint == "pip install 'klavins-factory[pandas]'"


UNFIT = ((PAPER, "--fuse", "--world", "ideal"),)
"""Files and options that do not go together."""


@pytest.mark.parametrize("words", UNFIT, ids=lambda words: " ".join(map(str, words[1:])))
def test_options_that_do_not_go_together_are_refused_before_any_work(
    words: tuple[object, ...], run: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    def work(*_: object) -> None:
        raise AssertionError("something was compiled")

    monkeypatch.setattr("factory.pipeline.compile_pag", work)
    done = run("run", *words, "--json")
    assert done.status == 2 and done.codes[0] in ("BadValue", "BadDemand", "Usage")


def test_no_plan_with_several_tours_gets_relays() -> None:
    project = read(PAPER).with_plan(Plan(turns=((0, 1, 2, 3, 4, 4),)))
    with pytest.raises(InputError, match="several tours"):
        project.with_ground(Ground(relay=True))
    with pytest.raises(InputError, match="several tours"):
        read(PAPER, ground=Ground(relay=True)).with_plan(project.plan)


def test_options_become_settings_and_ground() -> None:
    given = ProjectOptions(PAPER, speed=0.2, stage=True, floor="4x3", cycle=2.0)
    assert given.settings() == Settings(speed=0.2, stage=1)
    assert given.ground() == Ground((4.0, 3.0), False, 2.0)
    with pytest.raises(InputError, match="--floor takes two positive numbers"):
        replace(given, floor="4").ground()


def loose(text: str) -> Iterator[str]:
    """Parameters of functions that are dictionaries of anything."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.arg) and node.annotation is not None:
            words = ast.unparse(node.annotation)
            if words.startswith(("dict[str, Any]", "Mapping[str, Any]")):
                yield node.arg


def test_no_command_passes_a_dictionary_of_options() -> None:
    planted = "from typing import Any\ndef run(options: dict[str, Any]) -> None: ..."
    assert list(loose(planted)) == ["options"]
    for path in (ROOT / "factory" / "commands").glob("*.py"):
        assert not list(loose(path.read_text("utf-8"))), path.name


EXAMPLES = ROOT / "examples"
OWN = ["chest", "gearbox"]


def test_the_generator_writes_the_same_bytes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, EXAMPLES / "make_meshes.py", tmp_path], check=True)
    made = files_in(tmp_path)
    kept = {f"{name}/{k}" for name in [*OWN, "peg"] for k in files_in(EXAMPLES / name)}
    assert len(made) == len(kept) > 0
    for path in tmp_path.rglob("*.obj"):
        assert path.read_bytes() == (EXAMPLES / path.relative_to(tmp_path)).read_bytes(), path.name
