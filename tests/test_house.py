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
    crowded_classes,
    crowded_functions,
    engine_imports,
    engine_writes,
    long_modules,
    strangers,
    this_house,
    twins,
    unexplained,
    upward_imports,
    vague,
    variants,
)

ROOT = Path(__file__).resolve().parent.parent
Law = Callable[[House], Iterator[str]]
LAWS: tuple[Law, ...] = (
    strangers,
    upward_imports,
    circles,
    engine_imports,
    engine_writes,
    crowded_classes,
    crowded_functions,
    twins,
    long_modules,
    unexplained,
    clocks,
    variants,
    vague,
)
FIELDS = "\n".join(f"        self.a{n} = {n}" for n in range(13))
BREACHES: tuple[tuple[Law, dict[str, str], str], ...] = (
    (strangers, {"factory/loose.py": ""}, "loose: on no floor"),
    (strangers, {"factory/attic/box.py": ""}, "attic: on no floor"),
    (
        upward_imports,
        {"factory/nets/a.py": "from factory.layout import b", "factory/layout/b.py": ""},
        "nets.a imports layout.b",
    ),
    (
        upward_imports,
        {"factory/nets/a.py": "from factory.lang.b import c", "factory/lang/b.py": "c = 1"},
        "nets.a imports lang.b",
    ),
    (
        upward_imports,
        {
            "factory/nets/a.py": "from typing import TYPE_CHECKING\n"
            "if TYPE_CHECKING:\n    from factory.layout.b import C",
            "factory/layout/b.py": "class C: ...",
        },
        "nets.a imports layout.b",
    ),
    (
        upward_imports,
        {
            "factory/nets/a.py": "def late():\n    import factory.layout.b",
            "factory/layout/b.py": "",
        },
        "nets.a imports layout.b",
    ),
    (upward_imports, {"factory/nets/a.py": "from factory import run"}, "nets.a imports factory"),
    (
        circles,
        {
            "factory/nets/a.py": "from factory.nets import b",
            "factory/nets/b.py": "from typing import TYPE_CHECKING\n"
            "if TYPE_CHECKING:\n    from factory.nets.a import c",
        },
        "nets.a",
    ),
    (engine_imports, {"factory/nets/a.py": "import mujoco"}, "nets.a imports the engine"),
    (
        engine_imports,
        {
            "factory/nets/a.py": "from factory.support.engine import mujoco",
            "factory/support/engine.py": "import mujoco",
        },
        "nets.a imports the engine",
    ),
    (
        engine_imports,
        {"factory/rendering/a.py": "from mujoco import MjData"},
        "rendering.a imports mujoco past support.engine",
    ),
    (
        engine_writes,
        {"factory/rendering/a.py": "def f(d):\n    d.qpos[3] = 0.0"},
        "rendering.a:2 writes d.qpos[3]",
    ),
    (
        engine_writes,
        {"factory/study/a.py": "def f(m, n):\n    n, m.body_mass[1:] = 1, 2"},
        "study.a:2 writes m.body_mass[1:]",
    ),
    (
        engine_writes,
        {"factory/study/a.py": "def f(world):\n    world.d.xfrc_applied[4, :3] += 1"},
        "study.a:2 writes world.d.xfrc_applied[4, :3]",
    ),
    (
        crowded_classes,
        {"factory/nets/a.py": f"class A:\n    def __init__(self):\n{FIELDS}"},
        "nets.a.A: 13 attributes",
    ),
    (
        crowded_functions,
        {"factory/nets/a.py": "def f(a, b, c, d, e, *, f, g, h, i): ..."},
        "nets.a.f: 9 parameters",
    ),
    (
        crowded_functions,
        {"factory/stages.py": "def f(a, b, c, d, e, f, g, h, i, *, j): ..."},
        "stages.f: 9 parameters",
    ),
    (
        twins,
        {"factory/nets/a.py": "class A: ...", "factory/lang/b.py": "class A: ..."},
        "A: lang.b, nets.a",
    ),
    (long_modules, {"factory/nets/a.py": "x = 1\n" * 351}, "nets.a: 351 lines"),
    (unexplained, {"factory/nets/a.py": "x = 1"}, "nets.a: no docstring"),
    (clocks, {"tests/test_a.py": "def f():\n    from time import sleep"}, "tests.test_a reads"),
    (clocks, {"tests/test_a.py": "import time"}, "tests.test_a reads a clock"),
    (vague, {"factory/nets/a.py": "def f():\n    found = 1"}, "nets.a.f: a variable is called"),
    (vague, {"factory/nets/a.py": "def f(own): ..."}, "nets.a.f: a variable is called 'own'"),
    (
        variants,
        {"factory/nets/a.py": "def f(plan):\n    return plan.is_folded, Relays(parallel=1)"},
        "nets: names variants 3 times; at most 0",
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


@pytest.mark.parametrize("name", ["simulation.world", "simulation.ideal", "simulation.supervisor"])
def test_what_worlds_share_is_typed(name: str, house: House) -> None:
    assert not list(anys(house, name))


def test_any_is_found(tmp_path: Path) -> None:
    (tmp_path / "factory").mkdir()
    (tmp_path / "factory" / "a.py").write_text("x: Any = 1")
    assert list(anys(House(tmp_path), "a")) == ["a:1 says Any"]


def test_importing_the_package_loads_no_engine() -> None:
    code = "import sys, factory; assert 'mujoco' not in sys.modules, sorted(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)
