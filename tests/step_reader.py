"""STEP files read as they are, but that OpenCASCADE is loaded once for all: loading it takes 1.5 s,
and a file is read by two processes. Each conversion is still a process of its own, that is forked
from the one that has loaded it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

LOADED = """
import json, os, sys
import cascadio
for line in sys.stdin:
    folder, (code, *words) = json.loads(line)
    if not (child := os.fork()):
        try:
            os.chdir(folder)
            nothing = os.open(os.devnull, os.O_RDWR)
            [os.dup2(nothing, number) for number in (0, 1, 2)]
            sys.argv = ["-c", *words]
            exec(code)
            os._exit(0)
        finally:
            os._exit(1)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@contextmanager
def loaded() -> Iterator[SimpleNamespace]:
    """What stands in for `subprocess` where STEP files are read."""
    words, pipe = [sys.executable, "-c", LOADED], subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True) as server:
        asked, answers = server.stdin, server.stdout
        assert asked and answers

        def run(words: Sequence[str], *, cwd: Path, **_: int | bool) -> SimpleNamespace:
            assert words[:2] == [sys.executable, "-c"]
            print(json.dumps([str(cwd), words[2:]]), file=asked, flush=True)
            return SimpleNamespace(returncode=int(answers.readline()))

        yield SimpleNamespace(run=run, DEVNULL=subprocess.DEVNULL)
        asked.close()
