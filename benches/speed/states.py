"""Our proof of a net against tools that enumerate its states."""

from __future__ import annotations

import json
import random
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benches.speed.movers import RIVALS
from benches.speed.processes import FACTORY, ROOT, interleaved, median, run
from benches.tables import table

TOOLS = {"SNAKES": "snakes_states.py", "pm4py": "pm4py_states.py"}

TOOLS_SAID = (
    "SNAKES (`StateGraph.build`) and pm4py (`reachability_graph`) enumerate the reachable markings,"
    " which is the ground of any such proof with them."
)

LABELS = (2, 5, 7, 10, 20, 190, 1_900, 19_000)
"""Sizes of PAGs: their nets have 10 to 100,000 nodes."""

OFTEN = 10
"""Labels up to which all is done three times: beyond, the tools only run into the limit."""

LIMIT, PATIENCE = 5.0, 3.0
"""A tool's time on a net [s]; it is ended from outside after this many times as long."""


def random_pag_text(labels: int, seed: int) -> str:
    """The text of a random PAG with so many labels, made fast: binary mates, at most one weld."""
    rng = random.Random(seed)
    parts = (labels + 1) // 2
    pool = [f"part{i}" for i in range(1, parts + 1)]
    lines = [f"{name} = atomic();" for name in pool]
    if labels % 2 == 0:
        lines.append(f"welded = weld ( {pool[0]} );")
        pool[0] = "welded"
    for number in range(1, parts):
        chosen = []
        for _ in range(2):
            at = rng.randrange(len(pool))
            pool[at], pool[-1] = pool[-1], pool[at]
            chosen.append(pool.pop())
        pool.append(f"sub{number}")
        lines.append(f"sub{number} = mate ( {', '.join(chosen)} );")
    rng.shuffle(lines)
    return "\n".join([f"{labels} parts;", f"root = {pool[0]};", *lines]) + "\n"


def measure(quick: bool = False) -> dict[str, Any]:
    """Every net by every tool that is there, in turns."""
    limit = 2.0 if quick else LIMIT
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for labels in LABELS[:5] if quick else LABELS:
            runs = 3 if labels <= OFTEN and not quick else 1
            rows.append(_compared(Path(folder), labels, limit, runs))
    return {"limit": limit, "versions": _versions(), "rows": rows}


def _compared(folder: Path, labels: int, limit: float, runs: int) -> dict[str, Any]:
    """One net by all."""
    pag, net = folder / f"{labels}.pag", folder / f"{labels}.pnml"
    pag.write_text(random_pag_text(labels, 1))
    run([*FACTORY, "export", pag, "--format", "pnml", "-o", net, "-q"])
    jobs: dict[str, Callable[[], dict[str, Any]]] = {"ours": partial(ours, net)}
    if RIVALS.is_file():
        jobs |= {name: partial(theirs, name, net, limit) for name in TOOLS}
    found = interleaved(list(jobs.values()), runs)
    return {
        "labels": labels,
        "runs": runs,
        **{n: median(o) for n, o in zip(jobs, found, strict=True)},
    }


def ours(net: Path) -> dict[str, Any]:
    """`check` of the net, a whole process."""
    process = run([*FACTORY, "check", net, "--json"])
    said = json.loads(process.text)
    assert said["live"] and said["safe"] and said["reversible"]
    return {
        "s": process.seconds,
        "nodes": said["places"] + said["transitions"],
    }


def theirs(name: str, net: Path, limit: float) -> dict[str, Any]:
    """The states that a tool has found."""
    program = ROOT / "benches" / "rivals" / TOOLS[name]
    command = [str(word) for word in (RIVALS, program, net, limit)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE * limit)
    except subprocess.TimeoutExpired:
        return {"states": 0.0, "complete": False, "s": PATIENCE * limit, "stage": "no answer"}
    if done.returncode:
        return {"states": 0.0, "complete": False, "s": 0.0, "stage": f"status {done.returncode}"}
    found = json.loads(done.stdout.splitlines()[-1])
    return {**found, "states": float(found["states"])}


def _versions() -> str:
    """Of the tools that are there."""
    if not RIVALS.is_file():
        return ""
    code = (
        "from importlib.metadata import version as v\n"
        "print(', '.join(f'{n} {v(n)}' for n in ('SNAKES', 'pm4py')))"
    )
    return run([RIVALS, "-c", code]).text.strip()


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = ("labels", "nodes of the net", "our proof [s]", *TOOLS, "runs")
    rows = [
        (
            row["labels"],
            row["ours"]["nodes"],
            f"{row['ours']['s']:.2f}",
            *(_outcome(row.get(name)) for name in TOOLS),
            row["runs"],
        )
        for row in results["rows"]
    ]
    return "\n\n".join(
        [
            "## Proofs against enumeration",
            f"The nets of random PAGs, from the same PNML: our `check` (the whole process, reading"
            f" included) proves them live, safe and reversible by their structure; {TOOLS_SAID}"
            " The time is counted from when the tool is loaded, reading the net included, up to"
            f" {results['limit']:g} s; where it was over, the states found until then are shown."
            f" Medians, in turns; {results['versions'] or 'none installed'}.",
            table(head, rows),
            "They take any net, and the theorem that we use only gear nets: for nets from elsewhere"
            " that are no gear nets `check` falls back on more general methods. Neither tool has a"
            " structural test for liveness that takes these nets: pm4py's soundness check is for"
            " workflow nets, which have a source and a sink, and SNAKES has none. TINA, LoLA and"
            " LTSmin, which would go further, cannot be installed from PyPI or Debian, so they are"
            " not here.",
        ]
    )


def _outcome(found: dict[str, Any] | None) -> str:
    """What a tool came to."""
    if found is None:
        return "not installed"
    states = f"{found['states']:,.0f} states"
    if found["complete"]:
        return f"{states} in {found['s']:.3g} s"
    if found["stage"] == "states":
        return f"stopped: {states}"
    return f"stopped: {found['stage']}"
