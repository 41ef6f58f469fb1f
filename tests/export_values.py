"""What the tests of exports share: the files, and the readers that read them back."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from factory.apps.exports import Made, Subject, exporters
from factory.apps.log import Log, LogWriter, is_log, read_log
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.layout.layout import Layout
from factory.pipeline import Project, read
from tests.paths import PAPER, ROOT, TESTS

LAMP = ROOT / "examples" / "lamp.pag"
MESHES = ROOT / "tests" / "baselines" / "meshes.pag"
PYTHON = ROOT / ".oracles" / "bin" / "python"
ORACLES = TESTS / "oracles"


@cache
def project(file: Path = PAPER) -> Project:
    """A PAG with its layout."""
    found = read(file)
    assert found.layout
    return found


def subject(file: Path = PAPER, of: str = "", name: str = "") -> Subject:
    """A file as exporters get it; read, compiled and laid out once."""
    return Subject(file, _log(file) if is_log(file) else project(file), of, name)


@cache
def _log(file: Path) -> Log:
    found = read_log(file)
    assert len(found)
    return found


@cache
def made(form: str, file: Path = PAPER, of: str = "", name: str = "") -> Any:
    """What an exporter makes of a file."""
    return exporters()[form].export(subject(file, of, name))


def write(made: Made, path: Path) -> Path:
    """What was made, in files."""
    if isinstance(made, str):
        made = made.encode()
    for name, content in ({"": made} if isinstance(made, bytes) else made).items():
        target = path.parent / name if name else path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
    return path


def kept_log(layout: Layout, path: Path, **options: Any) -> Path:
    """A log of a run."""
    simulation = Simulation(layout, RunRequest(**options))
    with LogWriter(path, simulation) as log:
        simulation.run([log.observe])
    return path


def ask(oracle: str, *words: object) -> Any:
    """What a program of tests/oracles prints. Skips the test where they are not installed."""
    if not PYTHON.exists():
        pytest.skip("run tools/oracles to have it read back by somebody else's program")
    script = ORACLES / f"{oracle}.py"
    done = subprocess.run(
        [PYTHON, script, *map(str, words)], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@dataclass(frozen=True)
class Reader:
    """A reader of a format: its name, its licence, what it is shown to accept, and the check."""

    form: str
    name: str
    licence: str
    shows: str
    check: Callable[[Path], None]


READERS: dict[str, Reader] = {}


def reads(form: str, name: str, licence: str) -> Callable[[Callable[[Path], None]], None]:
    """Registers a check, whose docstring says what it shows, as a row of docs/exports.md."""

    def register(check: Callable[[Path], None]) -> None:
        shows = " ".join((check.__doc__ or "").split())
        READERS[f"{form}-{name}"] = Reader(form, name, licence, shows, check)

    return register


def table(readers: Mapping[str, Reader]) -> str:
    """The table of docs/exports.md."""
    lines = ["| format | reader | licence | what it read back |", "|---|---|---|---|"]
    for reader in sorted(readers.values(), key=lambda r: (r.form, r.name)):
        lines.append(f"| `{reader.form}` | {reader.name} | {reader.licence} | {reader.shows} |")
    return "\n".join(lines) + "\n"
