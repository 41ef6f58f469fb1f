"""The command line for tests: in this process, which is quick, or in one of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from factory.commands import run_command
from tests.paths import ROOT


@dataclass(frozen=True)
class Done:
    """What a command left: its status, and what it wrote."""

    status: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one document on stdout, in which no number is out of range."""
        assert self.out.count("\n") == 1, self.out
        document = json.loads(self.out, parse_constant=_refuse)
        assert document["schema"] == 1
        return dict(document)

    @property
    def codes(self) -> list[str]:
        """The codes of its errors."""
        return [error["code"] for error in self.json["errors"]]


def _refuse(constant: str) -> float:
    raise AssertionError(f"{constant} is not JSON")


class Terminal:
    """Runs commands in this process."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self.capsys = capsys

    def __call__(self, *words: object) -> Done:
        self.capsys.readouterr()
        status = run_command([str(word) for word in words])
        out, err = self.capsys.readouterr()
        assert "Traceback" not in err
        assert "Internal" not in err, err
        return Done(status, out, err)


def spawn(*words: object, cwd: Path | None = None, **variables: str) -> Done:
    """Runs a command in a process of its own, with environment variables added."""
    done = subprocess.run(
        [sys.executable, "-m", "factory", *(str(word) for word in words)],
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "Traceback" not in done.stderr, done.stderr
    return Done(done.returncode, done.stdout, done.stderr)


EACH = """
import json, sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from factory.commands import run_command
from tests.paths import ROOT
for words in json.loads(sys.argv[1]):
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        status = run_command(words)
    print(json.dumps([status, out.getvalue(), err.getvalue()]))
"""


def spawn_each(*commands: Sequence[object], **variables: str) -> list[Done]:
    """Runs commands one after the other in one process of their own, with environment variables
    added."""
    words = json.dumps([[str(word) for word in command] for command in commands])
    done = subprocess.run(
        [sys.executable, "-c", EACH, words],
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0 and "Traceback" not in done.stdout, (done.stdout, done.stderr)
    return [Done(*json.loads(line)) for line in done.stdout.splitlines()]


@contextmanager
def started(*words: object, **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A command in a process of its own, which does not outlive the block, whatever happens."""
    command = [sys.executable, "-m", "factory", *(str(word) for word in words)]
    with subprocess.Popen(command, cwd=ROOT, **options) as process:
        try:
            yield process
        finally:
            process.kill()
