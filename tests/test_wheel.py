"""The wheel, installed outside the checkout: templates and robot types come with it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.command_line import PAPER, ROOT

pytestmark = pytest.mark.slow


def call(*words: object, cwd: Path) -> str:
    """What a program prints. It does not see where this process looks for packages."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [*map(str, words)], cwd=cwd, env=environment, capture_output=True, text=True
    )
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


def test_the_wheel_runs_by_itself(wheel: Path, tmp_path: Path) -> None:
    """In a new environment that borrows the dependencies of this one, but not the package."""
    call(sys.executable, "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / "bin" / "python"
    call(python, "-m", "pip", "install", "--quiet", "--no-deps", wheel, cwd=tmp_path)
    site = Path(
        call(python, "-c", "import site; print(site.getsitepackages()[0])", cwd=tmp_path).strip()
    )
    (site / "zz_dependencies.pth").write_text(sysconfig.get_paths()["purelib"])
    (tmp_path / "p.pag").write_bytes(PAPER.read_bytes())
    factory = tmp_path / "venv" / "bin" / "factory"
    where = call(python, "-c", "import factory; print(factory.__file__)", cwd=tmp_path)
    assert Path(where.strip()).is_relative_to(tmp_path)
    assert json.loads(call(factory, "check", "p.pag", "--json", cwd=tmp_path))["live"]
    call(factory, "build", "p.pag", "-o", "out", cwd=tmp_path)
    assert (tmp_path / "out" / "p.xml").is_file()
    run = json.loads(call(factory, "run", "p.pag", "--json", cwd=tmp_path))
    assert run["refines_net"] and run["products"] == 1
    shown = json.loads(call(factory, "templates", "--json", cwd=tmp_path))
    assert len(shown["templates"]) == len(list((ROOT / "templates").glob("*.op")))
