"""Processes that are killed while they run, and go on from the log."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

from benches.fidelity.products import over_cores
from benches.tables import table
from factory.apps.log.reader import read_log
from tests.apps.resume.test_resume import FACTORIES, killed_and_gone_on, ticks_of
from tests.apps.resume.test_resume_faults import FACTORIES as FAILING
from tests.apps.resume.test_resume_faults import FAULTS
from tests.command_line import spawn

KILLS = 2

RUNS = (*((words, "") for words in FACTORIES), *((words, FAULTS) for words in FAILING))
"""The words of each run, and the file of its faults, "" for none."""


def measure(quick: bool = False) -> dict[str, Any]:
    """Kill each run again and again, as the tests in tests/apps/resume do."""
    cases = [(n, 1 if quick else KILLS) for n in range(1 if quick else len(RUNS))]
    return {"rows": over_cores(killed, cases)}


def killed(case: tuple[int, int]) -> dict[str, Any]:
    """What came of a run, by its number, that is killed so many times."""
    number, kills = case
    given, faults = RUNS[number]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "faults.toml"
        file.write_text(faults)
        shown = (*given, "--faults", file) if faults else given
        words = *shown, "--seed", number
        whole = Path(folder) / "whole.log"
        assert spawn("run", *words, "--log", whole, "-q").status == 0
        size, chance = whole.stat().st_size, Random(number)
        came = killed_and_gone_on(Path(folder), words, kills, chance, size)
        return {
            "run": " ".join(Path(str(word)).name for word in shown),
            "lasts_s": float(read_log(whole).time[-1]),
            "from_s": came,
            "same": ticks_of(Path(folder) / "run.log") == ticks_of(whole),
        }


def section(results: dict[str, Any]) -> str:
    """The report."""
    rows = results["rows"]
    kills = sum(len(row["from_s"]) for row in rows)
    same = sum(row["same"] for row in rows)
    return "\n\n".join(
        [
            "## Killed and gone on",
            f"{kills} kills (`kill -9`) at random times of {len(rows)} runs, each gone on with by"
            f" `factory run --resume`. All made their units, refine the net, touched nothing, and"
            f" the monitor agrees; **{same} of {len(rows)}** logs are, tick by tick, that of a run"
            " that was never killed. In some things go wrong (`faults.toml`: parts are dropped,"
            " come bad, askew or late, joints slip, a robot dies). *Log ends*: the time up to which"
            " each resume makes its run again.",
            table(
                ("factory run", "lasts [s]", "kills", "log ends [s]", "the same log"),
                [
                    (
                        f"`{row['run']}`",
                        f"{row['lasts_s']:.2f}",
                        len(row["from_s"]),
                        ", ".join(f"{t:g}" for t in row["from_s"]),
                        row["same"],
                    )
                    for row in rows
                ],
            ),
        ]
    )
