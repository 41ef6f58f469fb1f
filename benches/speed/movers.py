"""Robots carrying parts against MagBotSim's movers under its own controllers."""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import partial
from typing import Any

from benches.speed.factories import Case
from benches.speed.processes import ROOT, fresh, interleaved, median, ratio, run, spread
from benches.speed.production import work
from benches.tables import table

RIVALS = ROOT / ".rivals" / "bin" / "python"

PROGRAM = ROOT / "benches" / "rivals" / "magbotsim_movers.py"

COUNTS, TIMESTEP = (1, 10, 100), 0.002
"""Movers, and the timestep [s]."""

WALL = 4.0
"""Seconds of wall time for each measurement of MagBotSim."""


def measure(quick: bool = False) -> dict[str, Any]:
    """Both with every number, in turns."""
    if not RIVALS.is_file():
        return {"missing": "MagBotSim is not installed: call tools/rivals"}
    counts = COUNTS[:2] if quick else COUNTS
    wall, window = (0.5, 0.5) if quick else (WALL, None)
    cases = [Case(count, TIMESTEP) for count in counts]
    jobs = []
    for case in cases:
        jobs.append(partial(theirs, case.robots, case.timestep, wall))
        jobs.append(partial(fresh, work, **asdict(case), window=window))
    found = interleaved(jobs, 2)
    rows = [
        {
            "movers": case.robots,
            "timestep": case.timestep,
            "theirs": median(their),
            "ours": median(our),
            "their_spread": spread(their, "realtime"),
            "our_spread": spread(our, "realtime"),
            "ratio": ratio(our, their, "realtime"),
        }
        for case, their, our in zip(cases, found[::2], found[1::2], strict=True)
    ]
    return {"runs": len(found[0]), "wall_s": wall, "rows": rows}


def theirs(movers: int, timestep: float, wall: float) -> dict[str, Any]:
    """One process of MagBotSim."""
    found = json.loads(run([RIVALS, PROGRAM, movers, timestep, wall]).text.splitlines()[-1])
    return {**found, "realtime": found["plain"]["realtime"]}


def section(results: dict[str, Any]) -> str:
    """The report."""
    title = "## Against MagBotSim"
    if "missing" in results:
        return f"{title}\n\n{results['missing']}."
    head = (
        *("movers", "timestep", "MagBotSim", "with its checks", "its engine's share"),
        *("our robots", "times real time", "window", "ratio"),
    )
    rows = []
    for row in results["rows"]:
        their, our = row["theirs"], row["ours"]
        rows.append(
            (
                row["movers"],
                f"{1000 * row['timestep']:g} ms",
                f"{their['realtime']:.3g} ({row['their_spread']})",
                f"{their['checked']['realtime']:.3g}",
                f"{100 * their['plain']['engine_share']:.1f} %",
                our["robots"],
                f"{our['realtime']:.3g} ({row['our_spread']})",
                f"{our['from_s']:.1f}–{our['to_s']:.1f} s",
                f"**{row['ratio']:.0f}**",
            )
        )
    versions = results["rows"][0]["theirs"]["versions"]
    return "\n\n".join(
        [
            title,
            f"{versions}, without pictures, in an environment of its own: each mover on a circle of"
            " 80 mm at 1 rad/s under its own six-axis `MoverImpedanceController`, computed in every"
            " timestep as its examples do; its default scene, `BasicMagBotEnv`, one mover a tile,"
            " no payload, no contact. Both have a timestep of 2 ms here; its own is 1 ms."
            " The next column adds the checks of collisions that its examples make in every"
            " timestep. Our robots are in steady production and carry parts: one body per part,"
            " the whole pool, contact between payloads on, a supervisor that ticks every five"
            " timesteps. Times real time, median"
            f" (least–greatest) of {results['runs']} interleaved processes each; MagBotSim"
            f" for {results['wall_s']:g} s of wall time each after 0.1 s simulated. The ratio is"
            " the median of those within each turn, to MagBotSim without its checks.",
            table(head, rows),
            "The two do not do the same: its movers hover in six degrees of freedom, our robots run"
            " on rails; it computes its controllers in Python, mover by mover, while we give the"
            " engine setpoints.",
        ]
    )
