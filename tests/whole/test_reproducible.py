"""The same seed on the same machine gives the same run, bit for bit: in another process, with other
thread counts and hash seeds, beside another run, and whoever looks on."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

from factory.apps.log import read_log
from factory.support.errors import MissingError
from factory.support.gl import probe
from tests.paths import PAPER, ROOT
from tests.simulation_values import digest, reproduced

DIGEST = """
import sys
from tests.simulation_values import digest, reproduced
print(digest(reproduced()))
"""


@pytest.fixture(scope="module")
def here() -> str:
    """What this process makes of it."""
    return digest(reproduced())


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONHASHSEED": "4711", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
        {
            "PYTHONHASHSEED": "0",
            **dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "7"),
        },
    ],
    ids=["one thread", "seven threads"],
)
def test_another_process_gives_the_same(here: str, environment: dict[str, str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", DIGEST],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == here


def test_a_film_changes_nothing(here: str, tmp_path: Path) -> None:
    try:
        probe()
    except MissingError:
        pytest.skip("no GL here")
    from factory.film import Film, Picture

    made = reproduced()
    with Film(made, tmp_path / "f.mp4", Picture((64, 48)), 2.0) as film:
        assert digest(made, [film.observe]) == here


def test_a_log_says_what_made_it(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    words = ["run", str(PAPER), "--seed", "9", "--world", "ideal", "--log", str(path), "-q"]
    subprocess.run([sys.executable, "-m", "factory", *words], cwd=ROOT, check=True)
    header = read_log(path).header
    assert header["seed"] == 9
    assert header["command"][1:] == words
    assert header["pag"]["sha256"] == hashlib.sha256(Path(PAPER).read_bytes()).hexdigest()
    assert {"python", "mujoco", "numpy"} <= set(header["versions"])
