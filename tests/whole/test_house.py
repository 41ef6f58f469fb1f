"""The laws of the house hold, and each is seen to fail on a planted breach."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests import house as laws
from tests.house import House, anys, this_house
from tests.paths import ROOT

Law = Callable[[House], Iterator[str]]
LAWS: tuple[Law, ...] = (
    *(laws.strangers, laws.upward_imports, laws.circles, laws.engine_imports),
    *(laws.engine_writes, laws.twins, laws.long_modules, laws.unexplained),
    *(laws.unguided, laws.clocks, laws.misplaced_tests, laws.variants),
    *(laws.vague, laws.reach_ins, laws.interface, laws.undocumented),
    *(laws.unfit_tools, laws.named_apps),
)
BREACHES = r'''
strangers: loose: on no floor
  factory/loose.py:
strangers: attic: on no floor
  factory/attic/box.py:
upward_imports: theory.nets.a imports floor.layout.b
  factory/theory/nets/a.py: from factory.floor.layout import b
  factory/floor/layout/b.py:
upward_imports: theory.nets.a imports theory.lang.b
  factory/theory/nets/a.py: from factory.theory.lang.b import c
  factory/theory/lang/b.py: c = 1
upward_imports: theory.nets.a imports floor.layout.b
  factory/theory/nets/a.py: from typing import TYPE_CHECKING
    if TYPE_CHECKING:\n    from factory.floor.layout.b import C
  factory/floor/layout/b.py: class C: ...
upward_imports: theory.nets.a imports floor.layout.b
  factory/theory/nets/a.py: def late():\n    import factory.floor.layout.b
  factory/floor/layout/b.py:
upward_imports: theory.nets.a imports factory
  factory/theory/nets/a.py: from factory import run
upward_imports: floor.layout.a imports apps.log.b
  factory/floor/layout/a.py: def late():\n    from factory.apps.log import b
  factory/apps/log/b.py:
upward_imports: apps.log.a imports apps.report.b
  factory/apps/log/a.py: from factory.apps.report import b
  factory/apps/report/b.py:
upward_imports: apps.log.a imports apps.log.command_line.b
  factory/apps/log/a.py: from factory.apps.log.command_line.b import c
  factory/apps/log/command_line/b.py: from factory.commands.options import c
  factory/commands/options.py:
upward_imports: commands.a imports apps.log.command_line.b
  factory/commands/a.py: from factory.apps.log.command_line.b import c
  factory/apps/log/command_line/b.py:
upward_imports: apps.log.command_line.a imports apps.plc.command_line.b
  factory/apps/log/command_line/a.py: from factory.apps.plc.command_line.b import c
  factory/apps/plc/command_line/b.py:
circles: theory.nets.a
  factory/theory/nets/a.py: from factory.theory.nets import b
  factory/theory/nets/b.py: from typing import TYPE_CHECKING
    if TYPE_CHECKING:\n    from factory.theory.nets.a import c
engine_imports: theory.nets.a imports the engine
  factory/theory/nets/a.py: import mujoco
engine_imports: theory.nets.a imports the engine
  factory/theory/nets/a.py: from factory.support.engine import mujoco
  factory/support/engine.py: import mujoco
engine_imports: film.a imports mujoco past support.engine
  factory/film/a.py: from mujoco import MjData
engine_writes: film.a:2 writes d.qpos[3]
  factory/film/a.py: def f(d):\n    d.qpos[3] = 0.0
engine_writes: apps.study.a:2 writes m.body_mass[1:]
  factory/apps/study/a.py: def f(m, n):\n    n, m.body_mass[1:] = 1, 2
engine_writes: apps.study.a:2 writes world.d.xfrc_applied[4, :3]
  factory/apps/study/a.py: def f(world):\n    world.d.xfrc_applied[4, :3] += 1
twins: A: theory.lang.b, theory.nets.a
  factory/theory/nets/a.py: class A: ...
  factory/theory/lang/b.py: class A: ...
unexplained: theory.nets.a: no docstring
  factory/theory/nets/a.py: x = 1
unguided: theory.nets: names no module
  factory/theory/nets/__init__.py: 'Nets.'
  factory/theory/nets/a.py: 'A net.'
clocks: tests.test_a reads
  tests/test_a.py: def f():\n    from time import sleep
clocks: tests.test_a reads a clock
  tests/test_a.py: import time
misplaced_tests: tests.core.test_a needs apps.log.c
  tests/core/test_a.py: from tests.helper import b
  tests/helper.py: def b():\n    from factory.apps.log import c
  factory/apps/log/c.py:
misplaced_tests: tests.core.test_a needs factory
  tests/core/test_a.py: import factory
misplaced_tests: tests.apps.spiral.test_a stands with no app
  tests/apps/spiral/test_a.py:
vague: theory.nets.a.f: a variable is called
  factory/theory/nets/a.py: def f():\n    found = 1
vague: theory.nets.a.f: a variable is called 'own'
  factory/theory/nets/a.py: def f(own): ...
variants: theory.nets: names variants 3 times; at most 0
  factory/theory/nets/a.py: def f(plan):\n    return plan.is_folded, Relays(parallel=1)
reach_ins: the app log reaches theory.nets.b.C
  factory/apps/log/a.py: def late():\n    from factory.theory.nets.b import C
reach_ins: the app log no longer reaches theory.nets.b.C
  factory/apps/log/a.py: from factory.api import C
  tests/reach_ins.toml: [log]\n'theory.nets.b' = ['C']
reach_ins: the app log reaches support.b.d
  factory/apps/log/a.py: from factory.support.b import c, d
  factory/support/b.py: __all__ = ["c"]
unfit_tools: support.a imports support.b
  factory/support/a.py: __all__ = []\nfrom factory.support.b import c
  factory/support/b.py: c = 1
unfit_tools: support.a imports theory.nets.b
  factory/support/a.py: __all__ = []\nfrom factory.theory.nets.b import c
  factory/theory/nets/b.py: c = 1
unfit_tools: support.a.c: no app uses it
  factory/support/a.py: __all__: list[str] = ["c"]\nc = 1
unfit_tools: support.a.c: no docstring
  factory/support/a.py: __all__ = ["c"]\nc = 1
interface: api.C: twice
  factory/api.py: HOMES = {'theory.nets.b': 'C', 'theory.nets.a': 'C'}
interface: api: theory.nets.a.C is in one list only
  factory/api.py: from factory.theory.nets.b import C\nHOMES = {'theory.nets.a': 'C'}
undocumented: api.read: no docstring in pipeline
  factory/api.py: HOMES = {'pipeline': 'read'}
  factory/pipeline.py: read = 1
undocumented: api.read: 'path' is not under Args
  factory/api.py: HOMES = {'pipeline': 'read'}
  factory/pipeline.py: def read(path):\n    """Args:\n    file: of a PAG."""
undocumented: api.Project: 'pag' is not under Attributes
  factory/api.py: HOMES = {'pipeline': 'Project'}
  factory/pipeline.py: class Project:\n    'A project of a PAG.'\n    pag: PAG
named_apps: theory.nets.a names few robots
  factory/theory/nets/a.py: def with_tees(net): ...
named_apps: theory.nets.a names monitor
  factory/theory/nets/a.py: 'A net, for the monitor.'
named_apps: theory.nets.a no longer names relay
  factory/theory/nets/a.py:
  tests/named_in_core.toml: relay = ['theory.nets.a']
'''
"""Laws and what they say of files, which are planted below each."""


def breaches() -> Iterator[tuple[Law, dict[str, str], str]]:
    """What is planted, of each law."""
    for block in re.split(r"\n(?! )", BREACHES.strip()):
        first, *lines = re.split(r"\n  (?=\S)", block)
        name, said = first.split(": ", 1)
        pairs = (line.partition(":") for line in lines)
        files = {
            file: text.strip().replace("\n    ", "\n").replace("\\n", "\n")
            for file, _, text in pairs
        }
        yield getattr(laws, name), files, said
    yield (
        laws.long_modules,
        {"factory/theory/nets/a.py": "x = 1\n" * 351},
        "theory.nets.a: 351 lines",
    )
    names = " ".join(map("n{}".format, range(101)))
    yield (
        laws.unfit_tools,
        {"factory/support/a.py": f"__all__ = {[*range(129)]}"},
        "support: 129 tools",
    )
    yield laws.interface, {"factory/api.py": f"HOMES = {{'pipeline': '{names}'}}"}, "api: 101 names"


@pytest.fixture(scope="module")
def house() -> House:
    return this_house()


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_the_house_keeps_its_laws(law: Law, house: House) -> None:
    assert not list(law(house))


@pytest.mark.parametrize(
    ("law", "files", "said"), [*breaches()], ids=lambda value: getattr(value, "__name__", None)
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
    assert {law for law, *_ in breaches()} == {*LAWS}


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
