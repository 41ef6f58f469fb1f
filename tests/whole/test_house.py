"""The laws of the house hold, and each is seen to fail on a planted breach."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.house import (
    House,
    anys,
    circles,
    clocks,
    engine_imports,
    engine_writes,
    long_modules,
    misplaced_tests,
    reach_ins,
    strangers,
    this_house,
    twins,
    unexplained,
    unguided,
    upward_imports,
    vague,
    variants,
)
from tests.interface import interface, undocumented
from tests.naming import named_apps
from tests.paths import ROOT

Law = Callable[[House], Iterator[str]]
LAWS: tuple[Law, ...] = (
    strangers,
    upward_imports,
    circles,
    engine_imports,
    engine_writes,
    twins,
    long_modules,
    unexplained,
    unguided,
    clocks,
    misplaced_tests,
    variants,
    vague,
    reach_ins,
    interface,
    undocumented,
    named_apps,
)
BREACHES: tuple[tuple[Law, dict[str, str], str], ...] = (
    (strangers, {"factory/loose.py": ""}, "loose: on no floor"),
    (strangers, {"factory/attic/box.py": ""}, "attic: on no floor"),
    (
        upward_imports,
        {
            "factory/theory/nets/a.py": "from factory.floor.layout import b",
            "factory/floor/layout/b.py": "",
        },
        "theory.nets.a imports floor.layout.b",
    ),
    (
        upward_imports,
        {
            "factory/theory/nets/a.py": "from factory.theory.lang.b import c",
            "factory/theory/lang/b.py": "c = 1",
        },
        "theory.nets.a imports theory.lang.b",
    ),
    (
        upward_imports,
        {
            "factory/theory/nets/a.py": "from typing import TYPE_CHECKING\n"
            "if TYPE_CHECKING:\n    from factory.floor.layout.b import C",
            "factory/floor/layout/b.py": "class C: ...",
        },
        "theory.nets.a imports floor.layout.b",
    ),
    (
        upward_imports,
        {
            "factory/theory/nets/a.py": "def late():\n    import factory.floor.layout.b",
            "factory/floor/layout/b.py": "",
        },
        "theory.nets.a imports floor.layout.b",
    ),
    (
        upward_imports,
        {"factory/theory/nets/a.py": "from factory import run"},
        "theory.nets.a imports factory",
    ),
    (
        upward_imports,
        {
            "factory/floor/layout/a.py": "def late():\n    from factory.apps.log import b",
            "factory/apps/log/b.py": "",
        },
        "floor.layout.a imports apps.log.b",
    ),
    (
        upward_imports,
        {
            "factory/apps/log/a.py": "from factory.apps.report import b",
            "factory/apps/report/b.py": "",
        },
        "apps.log.a imports apps.report.b",
    ),
    (
        upward_imports,
        {
            "factory/apps/log/a.py": "from factory.apps.log.command_line.b import c",
            "factory/apps/log/command_line/b.py": "from factory.commands.options import c",
            "factory/commands/options.py": "",
        },
        "apps.log.a imports apps.log.command_line.b",
    ),
    (
        upward_imports,
        {
            "factory/commands/a.py": "from factory.apps.log.command_line.b import c",
            "factory/apps/log/command_line/b.py": "",
        },
        "commands.a imports apps.log.command_line.b",
    ),
    (
        upward_imports,
        {
            "factory/apps/log/command_line/a.py": "from factory.apps.plc.command_line.b import c",
            "factory/apps/plc/command_line/b.py": "",
        },
        "apps.log.command_line.a imports apps.plc.command_line.b",
    ),
    (
        circles,
        {
            "factory/theory/nets/a.py": "from factory.theory.nets import b",
            "factory/theory/nets/b.py": "from typing import TYPE_CHECKING\n"
            "if TYPE_CHECKING:\n    from factory.theory.nets.a import c",
        },
        "theory.nets.a",
    ),
    (
        engine_imports,
        {"factory/theory/nets/a.py": "import mujoco"},
        "theory.nets.a imports the engine",
    ),
    (
        engine_imports,
        {
            "factory/theory/nets/a.py": "from factory.support.engine import mujoco",
            "factory/support/engine.py": "import mujoco",
        },
        "theory.nets.a imports the engine",
    ),
    (
        engine_imports,
        {"factory/commands/a.py": "from factory.api import mujoco"},
        "commands.a imports the engine",
    ),
    (
        engine_imports,
        {"factory/film/a.py": "from mujoco import MjData"},
        "film.a imports mujoco past support.engine",
    ),
    (
        engine_writes,
        {"factory/film/a.py": "def f(d):\n    d.qpos[3] = 0.0"},
        "film.a:2 writes d.qpos[3]",
    ),
    (
        engine_writes,
        {"factory/apps/study/a.py": "def f(m, n):\n    n, m.body_mass[1:] = 1, 2"},
        "apps.study.a:2 writes m.body_mass[1:]",
    ),
    (
        engine_writes,
        {"factory/apps/study/a.py": "def f(world):\n    world.d.xfrc_applied[4, :3] += 1"},
        "apps.study.a:2 writes world.d.xfrc_applied[4, :3]",
    ),
    (
        twins,
        {"factory/theory/nets/a.py": "class A: ...", "factory/theory/lang/b.py": "class A: ..."},
        "A: theory.lang.b, theory.nets.a",
    ),
    (long_modules, {"factory/theory/nets/a.py": "x = 1\n" * 351}, "theory.nets.a: 351 lines"),
    (unexplained, {"factory/theory/nets/a.py": "x = 1"}, "theory.nets.a: no docstring"),
    (
        unguided,
        {"factory/theory/nets/__init__.py": "'Nets.'", "factory/theory/nets/a.py": "'A net.'"},
        "theory.nets: names no module",
    ),
    (clocks, {"tests/test_a.py": "def f():\n    from time import sleep"}, "tests.test_a reads"),
    (clocks, {"tests/test_a.py": "import time"}, "tests.test_a reads a clock"),
    (
        misplaced_tests,
        {
            "tests/core/test_a.py": "from tests.helper import b",
            "tests/helper.py": "def b():\n    from factory.apps.log import c",
            "factory/apps/log/c.py": "",
        },
        "tests.core.test_a needs apps.log.c",
    ),
    (
        misplaced_tests,
        {"tests/core/test_a.py": "import factory"},
        "tests.core.test_a needs factory",
    ),
    (
        misplaced_tests,
        {"tests/apps/spiral/test_a.py": ""},
        "tests.apps.spiral.test_a stands with no app",
    ),
    (
        vague,
        {"factory/theory/nets/a.py": "def f():\n    found = 1"},
        "theory.nets.a.f: a variable is called",
    ),
    (
        vague,
        {"factory/theory/nets/a.py": "def f(own): ..."},
        "theory.nets.a.f: a variable is called 'own'",
    ),
    (
        variants,
        {"factory/theory/nets/a.py": "def f(plan):\n    return plan.is_folded, Relays(parallel=1)"},
        "theory.nets: names variants 3 times; at most 0",
    ),
    (
        reach_ins,
        {"factory/apps/log/a.py": "def late():\n    from factory.theory.nets.b import C"},
        "the app log reaches theory.nets.b.C",
    ),
    (
        reach_ins,
        {
            "factory/apps/log/a.py": "from factory.api import C",
            "tests/reach_ins.toml": "[log]\n'theory.nets.b' = ['C']",
        },
        "the app log no longer reaches theory.nets.b.C",
    ),
    (
        interface,
        {"factory/api.py": f"HOMES = {{'pipeline': '{' '.join(map('n{}'.format, range(101)))}'}}"},
        "api: 101 names; at most 100",
    ),
    (
        interface,
        {"factory/api.py": "HOMES = {'theory.nets.b': 'C', 'theory.nets.a': 'C'}"},
        "api.C: twice",
    ),
    (
        interface,
        {"factory/api.py": "from factory.theory.nets.b import C\nHOMES = {'theory.nets.a': 'C'}"},
        "api: theory.nets.a.C is in one list only",
    ),
    (
        undocumented,
        {"factory/api.py": "HOMES = {'pipeline': 'read'}", "factory/pipeline.py": "read = 1"},
        "api.read: no docstring in pipeline",
    ),
    (
        undocumented,
        {
            "factory/api.py": "HOMES = {'pipeline': 'read'}",
            "factory/pipeline.py": "def read(path):\n    'Args:\\n    file: of a PAG.'",
        },
        "api.read: 'path' is not under Args",
    ),
    (
        undocumented,
        {
            "factory/api.py": "HOMES = {'pipeline': 'Project'}",
            "factory/pipeline.py": "class Project:\n    'A project of a PAG.'\n    pag: PAG",
        },
        "api.Project: 'pag' is not under Attributes",
    ),
    (
        named_apps,
        {"factory/theory/nets/a.py": "def with_tees(net): ..."},
        "theory.nets.a names few robots",
    ),
    (
        named_apps,
        {"factory/theory/nets/a.py": "'A net, for the monitor.'"},
        "theory.nets.a names monitor",
    ),
    (
        named_apps,
        {
            "factory/theory/nets/a.py": "",
            "tests/named_in_core.toml": "relay = ['theory.nets.a']",
        },
        "theory.nets.a no longer names relay",
    ),
)


@pytest.fixture(scope="module")
def house() -> House:
    return this_house()


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_the_house_keeps_its_laws(law: Law, house: House) -> None:
    assert not list(law(house))


@pytest.mark.parametrize(
    ("law", "files", "said"), BREACHES, ids=lambda value: getattr(value, "__name__", None)
)
def test_a_planted_breach_is_found(
    law: Law, files: dict[str, str], said: str, tmp_path: Path
) -> None:
    for name, text in {"factory/__init__.py": "", **files}.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    found = list(law(House(tmp_path)))
    assert any(line.startswith(said) for line in found), found


def test_every_law_has_a_planted_breach() -> None:
    assert {law for law, *_ in BREACHES} == {*LAWS}


@pytest.mark.parametrize(
    "name", ["engine.simulation.world", "engine.simulation.ideal", "engine.simulation.supervisor"]
)
def test_what_worlds_share_is_typed(name: str, house: House) -> None:
    assert not list(anys(house, name))


def test_any_is_found(tmp_path: Path) -> None:
    (tmp_path / "factory").mkdir()
    (tmp_path / "factory" / "a.py").write_text("x: Any = 1")
    assert list(anys(House(tmp_path), "a")) == ["a:1 says Any"]


def test_importing_the_package_loads_no_engine() -> None:
    code = "import sys, factory; assert 'mujoco' not in sys.modules, sorted(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
