"""Which tests run a decision that no others run.

`python -m benches.covering measure` runs the suite, campaigns aside, and keeps which branches of
the package each test takes, and how long it takes, in build/covering/. `python -m benches.covering
choose` picks tests, those first that take most new branches for their time, as long as that is
WORTH it. It keeps with them what no coverage sees (tests of documents and of the house, of
processes that they start), examples in docstrings, and what first kills a mutant
(`benches/mutants.toml`), and prints all others: they bring nothing, and can go, but for those that
alone hold a law, a theorem or a code."""

from __future__ import annotations

import argparse
import heapq
import json
import os
import sqlite3
import subprocess
import sys
import tomllib
from collections.abc import Collection, Generator, Mapping, Sequence
from math import inf
from time import process_time

import numpy as np
import pytest
from numpy.typing import NDArray

from benches.mutants import LIST, ROOT

FOLDER = ROOT / "build" / "covering"

OFTEN = 40
"""What has been seen is written after so many tests."""

WORTH = 5.0
"""A test is worth its time where it takes so many new branches a second."""

BRIEF = 3.0
"""A test that starts processes, in which nothing is seen, is kept where it takes no longer [s]."""

KEPT = ("tests/core/test_core_alone.py::test_the_core_runs_without_apps",)
"""Longer ones that are kept."""

LEAST = 0.05
"""A test takes at least so long [s]."""

Taken = NDArray[np.uint8]
"""The branches that a test takes, a bit for each."""


class Contexts:
    """A plugin of pytest that keeps the branches that each test takes, and its processor time with
    that of the processes that it has started [s]."""

    def __init__(self) -> None:
        import coverage  # of the extra `dev`

        FOLDER.mkdir(parents=True, exist_ok=True)
        name = os.environ.get("PYTEST_XDIST_WORKER", "main")
        file = str(FOLDER / f"{name}.coverage")
        self._coverage = coverage.Coverage(data_file=file, source=["factory"], branch=True)
        self._times, self._seen = FOLDER / f"{name}.times", 0
        self._coverage.start()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        self._coverage.switch_context(item.nodeid)
        begin, children = process_time(), os.times().children_user
        result = yield
        own, started = process_time() - begin, os.times().children_user - children
        self._coverage.switch_context("")
        with self._times.open("a", encoding="utf-8") as file:
            file.write(json.dumps([item.nodeid, own, started]) + "\n")
        self._seen += 1
        if self._seen % OFTEN == 0:
            self._coverage.save()
        return result

    def pytest_unconfigure(self) -> None:
        self._coverage.stop()
        self._coverage.save()


def pytest_configure(config: pytest.Config) -> None:
    """Measure in the processes that run tests."""
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        config.pluginmanager.register(Contexts())


def measure(words: Sequence[str]) -> int:
    """Run tests, all where none are named."""
    for old in FOLDER.glob("*"):
        old.unlink()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "benches.covering", "-n", "2"]
    command += ["-m", "not slow", *words]
    return subprocess.run(command, cwd=ROOT, check=False).returncode


def times() -> dict[str, tuple[float, float]]:
    """The processor time of each test, and that of the processes that it has started [s]."""
    lines = (line for file in FOLDER.glob("*.times") for line in file.open(encoding="utf-8"))
    return {name: (own, started) for name, own, started in map(json.loads, lines)}


def branches() -> dict[str, Taken]:
    """What each test takes."""
    numbers: dict[tuple[str, int, int], int] = {}
    tests: dict[str, list[int]] = {}
    for file in FOLDER.glob("*.coverage"):
        with sqlite3.connect(file) as kept:
            test = dict(kept.execute("select id, context from context where context != ''"))
            module = dict(kept.execute("select id, path from file"))
            rows = kept.execute("select file_id, context_id, fromno, tono from arc")
            for module_id, test_id, come, go in rows:
                if test_id in test:
                    branch = module[module_id], come, go
                    number = numbers.setdefault(branch, len(numbers))
                    tests.setdefault(test[test_id], []).append(number)
    size = len(numbers)
    return {
        name: np.packbits(np.bincount(taken, minlength=size).astype(bool))
        for name, taken in tests.items()
    }


def chosen(taken: Mapping[str, Taken], cost: Mapping[str, float]) -> set[str]:
    """Tests that take together the branches that are taken, as long as each is worth its time:
    greedily, by new branches for their time."""
    left = np.bitwise_or.reduce([*taken.values()])
    heap = [(-inf, name) for name in taken]
    picked = set[str]()
    while heap:
        _, name = heapq.heappop(heap)
        worth = int(np.bitwise_count(taken[name] & left).sum()) / cost[name]
        if heap and -worth > heap[0][0]:
            heapq.heappush(heap, (-worth, name))
        elif worth >= WORTH:
            picked.add(name)
            left &= ~taken[name]
    return picked


def killers() -> set[str]:
    """The tests that were first to kill a mutant."""
    return {one["now"] for one in tomllib.loads(LIST.read_text())["mutant"] if one.get("now")}


def listed(names: Collection[str], kept: Collection[str]) -> list[str]:
    """Tests as a list, whole functions where none of their cases is kept."""
    of = {name.split("[")[0] for name in kept}
    functions = {name.split("[")[0] for name in names}
    whole = functions - of
    return sorted(whole | {name for name in names if name.split("[")[0] not in whole})


def choose() -> None:
    """Print the tests that bring nothing."""
    spent, taken = times(), branches()
    cost = {name: LEAST + own + started for name, (own, started) in spent.items()}
    kept = chosen({name: bits for name, bits in taken.items() if name in cost}, cost)
    brief = {name for name, (_, started) in spent.items() if started and cost[name] <= BRIEF}
    examples = {name for name in cost if not name.startswith("tests/")}
    kept |= brief | examples | (cost.keys() - taken.keys())
    wanted = {*KEPT, *killers()}
    kept |= {name for name in cost if name in wanted or name.split("[")[0] in wanted}
    out = cost.keys() - kept
    print(*listed(out, kept), sep="\n")
    seconds = sum(cost[name] for name in kept)
    every = np.bitwise_count(np.bitwise_or.reduce([*taken.values()])).sum()
    theirs = np.bitwise_count(np.bitwise_or.reduce([taken[n] for n in kept & taken.keys()])).sum()
    print(
        f"{len(kept)} of {len(cost)} tests, {seconds:.0f} of {sum(cost.values()):.0f} s,"
        f" {theirs} of {every} branches",
        file=sys.stderr,
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benches.covering", description=__doc__)
    parser.add_argument("what", choices=["measure", "choose"])
    parser.add_argument("words", nargs="*", help="for pytest")
    asked = parser.parse_args()
    if asked.what == "measure":
        raise SystemExit(measure(asked.words))
    choose()


if __name__ == "__main__":
    main()
