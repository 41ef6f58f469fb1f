"""Measurements in fresh processes, in turns, and their medians."""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

ROOT = Path(__file__).resolve().parent.parent.parent

FACTORY = (sys.executable, "-m", "factory")

Found = dict[str, Any]
"""What one measurement found, as JSON takes it."""

Job = Callable[[], Found]


@dataclass(frozen=True)
class Process:
    """Wall time [s], largest resident set [MB], stdout, processor time [s] and exit status of a
    process that has ended."""

    seconds: float
    megabytes: float
    text: str
    processor: float
    status: int


def run(command: Sequence[object], may_fail: bool = False, /, **environment: str) -> Process:
    """Run it, with some more environment. Ends everything, with what it says, if it fails, unless
    it `may_fail`: with exit status 1."""
    words = [str(word) for word in command]
    begin = perf_counter()
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            words,
            stdout=out,
            stderr=said,
            cwd=ROOT,
            env=os.environ | environment,
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        took = perf_counter() - begin
        out.seek(0)
        said.seek(0)
        text, why = out.read(), said.read()
    if process.returncode > may_fail or process.returncode < 0:
        raise SystemExit(f"{' '.join(words)} ended with status {process.returncode}\n{why}")
    busy = usage.ru_utime + usage.ru_stime
    return Process(took, usage.ru_maxrss / 1024, text, busy, process.returncode)


def fresh(work: Callable[..., Found], **given: Any) -> Found:
    """What a section's `work` finds in a process of its own."""
    text = run([sys.executable, "-m", work.__module__, json.dumps(given)]).text
    return dict(json.loads(text.splitlines()[-1]))


def serve(work: Callable[..., Found]) -> None:
    """The other end of `fresh`: this process does the work."""
    print(json.dumps(work(**json.loads(sys.argv[1]))))


def resident() -> float:
    """This process's largest resident set so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def interleaved(jobs: Sequence[Job], runs: int) -> list[list[Found]]:
    """All that each job found. They take turns, so that whatever slows the machine down for a while
    does so to all."""
    found: list[list[Found]] = [[] for _ in jobs]
    for _ in range(runs):
        for job, own in zip(jobs, found, strict=True):
            own.append(job())
            print(".", end="", flush=True)
    print()
    return found


def median(found: Sequence[Found]) -> Found:
    """Of every number its median; anything else is as it was the last time."""
    last = found[-1]
    return {
        key: statistics.median(one[key] for one in found)
        if isinstance(value, float)
        else median([one[key] for one in found])
        if isinstance(value, dict)
        else value
        for key, value in last.items()
    }


def spread(found: Sequence[Found], key: str) -> str:
    """The least and the greatest of a number."""
    values = [one[key] for one in found]
    return f"{min(values):.3g}–{max(values):.3g}"


def ratio(one: Sequence[Found], other: Sequence[Found], key: str) -> float:
    """The median of the ratios within each turn."""
    return float(statistics.median(a[key] / b[key] for a, b in zip(one, other, strict=True)))
