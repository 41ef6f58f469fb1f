"""The wheel, installed outside the checkout: templates and robot types come with it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.paths import PAPER, ROOT
from tests.plug_in import FILES, write_package

pytestmark = pytest.mark.slow


def call(*words: object, cwd: Path) -> str:
    """What a program prints that finds no package through PYTHONPATH."""
    env = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run([*map(str, words)], cwd=cwd, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of a copy of the checkout, for building leaves traces."""
    folder = tmp_path_factory.mktemp("wheel")
    listed = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    found = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True)
    if found.returncode != 0:
        pytest.skip("no git checkout: what belongs to the project is not known")
    for name in filter(None, found.stdout.split("\0")):
        if (ROOT / name).is_file():
            (folder / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / "tree" / name).write_bytes((ROOT / name).read_bytes())
    words = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", folder, "."]
    done = subprocess.run(words, cwd=folder / "tree", capture_output=True, text=True)
    if done.returncode != 0 and "hatchling" in done.stderr:
        pytest.skip("the build backend cannot be downloaded")
    assert done.returncode == 0, done.stderr
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Python of a new environment that borrows the dependencies of this one, but not the
    package."""
    folder = tmp_path_factory.mktemp("environment")
    call(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    python = folder / "venv" / "bin" / "python"
    call(python, "-m", "pip", "install", "--quiet", "--no-deps", wheel, cwd=folder)
    words = python, "-c", "import site; print(site.getsitepackages()[0])"
    site = Path(call(*words, cwd=folder).strip())
    (site / "zz_dependencies.pth").write_text(sysconfig.get_paths()["purelib"])
    return python


def test_the_wheel_runs_by_itself(python: Path, tmp_path: Path) -> None:
    (tmp_path / "p.pag").write_bytes(PAPER.read_bytes())
    factory = python.parent / "factory"
    where = call(python, "-c", "import factory; print(factory.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(python.parents[1])
    assert json.loads(call(factory, "check", "p.pag", "--json", cwd=tmp_path))["live"]
    call(factory, "build", "p.pag", "-o", "out", cwd=tmp_path)
    assert (tmp_path / "out" / "p.xml").is_file()
    run = json.loads(call(factory, "run", "p.pag", "--json", cwd=tmp_path))
    assert run["refines_net"] and run["products"] == 1
    shown = json.loads(call(factory, "templates", "--json", cwd=tmp_path))
    assert len(shown["templates"]) == len(list((ROOT / "templates").glob("*.op")))


def test_an_installed_package_extends_it(python: Path, tmp_path: Path) -> None:
    """Its operation, control law, robot type and exporter are found by their entry points; they are
    gone when it is."""
    write_package(tmp_path / "source", installed=False)
    (tmp_path / "p.pag").write_text(FILES["p.pag"])
    call(python, "-m", "pip", "install", "--quiet", "--no-deps", tmp_path / "source", cwd=tmp_path)
    factory = python.parent / "factory"
    run = json.loads(call(factory, "run", "p.pag", "--json", cwd=tmp_path))
    assert run["refines_net"] and run["products"] == 1
    assert call(factory, "export", "p.pag", "--format", "count", cwd=tmp_path).strip() == "2"
    shown = json.loads(call(factory, "templates", "--json", cwd=tmp_path))
    assert shown["robots"][-1]["name"] == "dabber"
    call(python, "-m", "pip", "uninstall", "--quiet", "--yes", "gluing", cwd=tmp_path)
    shown = json.loads(call(factory, "templates", "--json", cwd=tmp_path))
    assert len(shown["templates"]) == len(list((ROOT / "templates").glob("*.op")))
