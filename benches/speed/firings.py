"""The timed net of a factory: our recursion against its simulation by SimPy."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benches.speed.factories import DEFAULT, Case
from benches.speed.movers import RIVALS
from benches.speed.processes import ROOT, interleaved, median, ratio, run
from benches.tables import table
from factory.engine.timing.timed import Timed
from factory.engine.timing.timing import Timing

PROGRAM = ROOT / "benches" / "rivals" / "simpy_firings.py"

CASES = {"paper": 6, "truck": 23, "balanced": 301}
"""Robots by product: two examples and a balanced tree."""

PERIODS, RUNS = 100, 3


def measure(quick: bool = False) -> dict[str, Any]:
    """Every net by both, in turns."""
    if not RIVALS.is_file():
        return {"missing": "SimPy is not installed: call tools/rivals"}
    names, runs = (list(CASES)[:1], 1) if quick else (list(CASES), RUNS)
    with tempfile.TemporaryDirectory() as folder:
        rows = [_compared(Path(folder), name, runs) for name in names]
    return {"periods": PERIODS, "runs": runs, "version": _version(), "rows": rows}


def _compared(folder: Path, name: str, runs: int) -> dict[str, Any]:
    case = Case(CASES[name], None, example=None if name == "balanced" else name)
    net, file = Timed.of(Timing(case.layout(), DEFAULT)), folder / f"{name}.json"
    file.write_text(json.dumps(_written(net)))
    our, their = interleaved([partial(ours, net), partial(theirs, file)], runs)
    off = np.abs(np.array(our[0].pop("dates")) - np.array(their[0].pop("dates")).T).max()
    for found in (*our[1:], *their[1:]):
        del found["dates"]
    return {
        "product": name,
        "robots": len(net.timing.factory.robots),
        "places": len(net.net.tokens),
        "transitions": len(net.net.net.transitions),
        "off_s": float(off),
        "ours": median(our),
        "theirs": median(their),
        "ratio": ratio(their, our, "s"),
    }


def _written(timed: Timed) -> dict[str, Any]:
    """The net as the program for SimPy reads it."""
    net, first, ready = timed.net, timed.timing.first, timed.ready
    rows: Sequence[tuple[float, ...]] = [
        (source, target, tokens, stay, first.get(place, stay), ready.get(place, 0.0))
        for place, (source, target, tokens, stay) in enumerate(
            zip(net.left, net.right, net.tokens, timed.seconds, strict=True)
        )
    ]
    return {"transitions": len(net.net.transitions), "places": rows}


def ours(timed: Timed) -> dict[str, Any]:
    """The dates by the recursion, and the processor time [s]."""
    begin = process_time()
    dates = timed.firings(PERIODS * timed.timing.factory.period)
    return {"s": process_time() - begin, "dates": dates.tolist()}


def theirs(file: Path) -> dict[str, Any]:
    """The dates by SimPy, and its processor time [s], loading aside."""
    return dict(json.loads(run([RIVALS, PROGRAM, file, PERIODS]).text))


def _version() -> str:
    return run([RIVALS, "-c", "import simpy; print(simpy.__version__)"]).text.strip()


def section(results: dict[str, Any]) -> str:
    """The report."""
    title = "## Timed nets against SimPy"
    if "missing" in results:
        return f"{title}\n\n{results['missing']}."
    head = ("product", "robots", "places", "transitions", "firings", "SimPy [s]", "ours [s]")
    rows = [
        (
            *(row[key] for key in head[:4]),
            f"{row['transitions'] * results['periods']:,}",
            f"{row['theirs']['s']:.3g}",
            f"{row['ours']['s']:.3g}",
            f"{row['ratio']:.1f}",
            f"{row['off_s']:.2g} s",
        )
        for row in results["rows"]
    ]
    return "\n\n".join(
        [
            title,
            f"The timed net of a layout, {results['periods']} periods from the empty factory: SimPy"
            f" {results['version']} runs a process for each transition, which takes a token of each"
            " place before it, and a process for each token, which stays its time; `analyze`"
            " computes the same dates by the max-plus recursion. Processor time, without loading;"
            f" medians of {results['runs']}, in turns. Difference: the greatest between two dates"
            " of one firing. Both predict a given net; the net, its times and the proof that it is"
            " live come from the compiler, which SimPy does not have.",
            table((*head, "ratio", "difference"), rows),
        ]
    )
