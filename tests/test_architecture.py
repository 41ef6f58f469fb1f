"""The law of the house: a room imports only rooms that the data has already passed."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "factory"

ROOMS = [
    {
        *("errors", "explanations", "assets", "closing", "collector", "files", "engine", "gl"),
        *("pickling", "extras"),
    },
    {"pag", "template", "robots", "settings", "defaults", "approach"},
    {"lang"},
    {"nets"},
    {"factory"},
    {
        "prepared",
        "compiler",
        "programs",
        "geometry",
        "limits",
        "meshes",
        "pieces",
        "decomposition",
        "importing",
        "mating",
        "wholes",
    },
    {"layout"},
    {"control", "prediction", "relaying", "planning", "pipeline"},
    {"mjcf"},
    {"trace"},
    {"supervisor", "distributed", "world"},
    {"simulation"},
    {
        "log",
        "render",
        "progress",
        "plotting",
        "interruption",
        "monitor",
        "disturbance",
        "fidelity",
        "analysis",
        "sweep",
    },
    {
        "console",
        "checking",
        "receipt",
        "approaching",
        "clashes",
        "building",
        "starting",
        "running",
        "doctor",
        "export",
        "report",
        "live",
    },
    {"cli", "__main__"},
]
"""In the order in which the data walks; rooms of one set may use each other."""

NETS_MAY_USE = {"factory"}
"""Net theory may name the value `Factory` (its pool and cycle time), which holds the net."""

ENGINE = {
    "gl",
    "engine",
    "world/physics",
    "world/stock",
    "world/inspection",
    "world/contacts",
    "world/fusing",
    "disturbance/acting",
    "mjcf",
    "render",
    "log",
    "monitor/record",
    "doctor",
    "fidelity",
}
"""Modules that may reach mujoco."""

LONGEST = 400
"""Lines of the longest module."""


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room_of(name: str) -> str:
    return name.split("/")[0].removesuffix(".py")


def imports(path: Path) -> set[str]:
    """Dotted names imported, at run time, anywhere in a module."""
    tree = ast.parse(path.read_text("utf-8"))
    typing_only = {
        node
        for guard in ast.walk(tree)
        if isinstance(guard, ast.If) and "TYPE_CHECKING" in ast.dump(guard.test)
        for node in ast.walk(guard)
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if node in typing_only:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module)
    return found


def level(room: str) -> int:
    return next(i for i, rooms in enumerate(ROOMS) if room in rooms)


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_rooms_import_only_what_the_data_has_passed(path: Path) -> None:
    name = path.relative_to(PACKAGE).as_posix()
    room = room_of(name)
    if room == "__init__":
        return
    for imported in imports(path):
        if not imported.startswith("factory."):
            continue
        other = imported.split(".")[1]
        if room == "nets" and other in NETS_MAY_USE:
            continue
        assert level(other) <= level(room), f"{name} imports {imported}, which comes after it"


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_only_some_modules_reach_the_engine(path: Path) -> None:
    name = path.relative_to(PACKAGE).as_posix().removesuffix(".py")
    if any(name == allowed or name.startswith(f"{allowed}/") for allowed in ENGINE):
        return
    assert not any(i == "mujoco" or i.startswith("mujoco.") for i in imports(path)), name


@pytest.mark.parametrize("path", modules(), ids=lambda p: str(p.relative_to(PACKAGE)))
def test_modules_are_short_and_say_what_they_are(path: Path) -> None:
    text = path.read_text("utf-8")
    assert len(text.splitlines()) <= LONGEST
    if text.strip():
        assert ast.get_docstring(ast.parse(text)), f"{path.name} has no docstring"


def test_the_package_loads_without_the_engine() -> None:
    code = (
        "import sys, factory, factory.pipeline, factory.nets.verify;"
        "assert not any(m.split('.')[0] == 'mujoco' for m in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=PACKAGE.parent)
