"""`make bench`: times and sizes as whole processes, written to docs/benchmarks.md.

Each figure is the median of several runs of a fresh process; memory is the process's largest
resident set.
"""

from __future__ import annotations

import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

from tests.strategies import random_pag_text

ROOT = Path(__file__).resolve().parent.parent
PRODUCTS = ROOT.parent / "shared" / "products" / "ldraw"
FACTORY = [sys.executable, "-m", "factory"]

LAYOUT = """
import sys, factory, json, time
from factory.geometry import product_geometry
from factory.layout.embedding import lay_out
from factory.layout.clearance import certify
plan = factory.compile(factory.load_pag(sys.argv[1]))
start = time.perf_counter(); layout = lay_out(plan, product_geometry(plan.pag))
middle = time.perf_counter(); proof = certify(layout)
print(json.dumps({"layout": middle - start, "certificate": time.perf_counter() - middle,
                  "holds": proof.holds, "area": layout.area, "length": layout.guidepath_length}))
"""


def measured(command: Sequence[str]) -> tuple[float, float, str]:
    """Wall time [s], largest resident set [MB] and stdout of one process."""
    begin = perf_counter()
    with tempfile.TemporaryFile("w+") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.DEVNULL, cwd=ROOT)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        took = perf_counter() - begin
        out.seek(0)
        text = out.read()
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} ended with status {process.returncode}")
    return took, usage.ru_maxrss / 1024, text


def median(command: Sequence[str], runs: int) -> tuple[float, float, str]:
    """Medians of wall time and memory over some runs, and the last run's stdout."""
    found = [measured(command) for _ in range(runs)]
    return (
        statistics.median(f[0] for f in found),
        statistics.median(f[1] for f in found),
        found[-1][2],
    )


def scaling(folder: Path) -> list[str]:
    """Check and layout of random PAGs of growing size."""
    lines = [
        "| labels | check [s] | memory [MB] | layout [s] | certificate [s] | memory [MB] |",
        "|---|---|---|---|---|---|",
    ]
    for labels, runs in ((100, 5), (1_000, 5), (10_000, 3), (100_000, 1)):
        path = folder / f"random{labels}.pag"
        path.write_text(random_pag_text(labels, 1))
        took, memory, _ = median([*FACTORY, "check", str(path), "--json"], runs)
        if labels <= 10_000:
            _, size, text = median([sys.executable, "-c", LAYOUT, str(path)], runs)
            layout = json.loads(text)
            assert layout["holds"]
            rest = f"{layout['layout']:.2f} | {layout['certificate']:.2f} | {size:.0f}"
        else:
            rest = "– | – | –"
        lines.append(f"| {labels} | {took:.2f} | {memory:.0f} | {rest} |")
        print(lines[-1], flush=True)
    return lines


def runs() -> list[str]:
    """What runs of real products measure."""
    wanted = [
        (ROOT / "examples" / f"{n}.pag", u)
        for n, u in (("paper", 20), ("lamp", 10), ("stool", 10), ("shelf", 10), ("balanced", 10))
    ]
    wanted += [(p, 1 if p.stat().st_size > 12_000 else 2) for p in sorted(PRODUCTS.glob("*.pag"))]
    heads = (
        *("product", "robots", "units", "cycle [s]", "predicted [s]", "times real time"),
        *("supervisor share", "gap [mm]", "product error [mm]", "contacts"),
    )
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for path, units in wanted:
        _, _, text = measured([*FACTORY, "run", str(path), "--units", str(units), "--json", "-q"])
        run = json.loads(text)
        cycle = "–" if run["cycle_time_s"] is None else f"{run['cycle_time_s']:.3f}"
        share = run["supervisor_time_s"] / run["wall_time_s"]
        lines.append(
            f"| {path.stem} | {run['robots']} | {units} | {cycle}"
            f" | {run['predicted_cycle_time_s']:.3f} | {run['realtime_factor']:.1f}"
            f" | {100 * share:.0f} % | {run['handoff_gap_max_mm']:.3f}"
            f" | {run['product_error_max_mm']:.4f} | {run['unintended_contacts']} |"
        )
        print(lines[-1], flush=True)
    return lines


def machine() -> str:
    """What it was measured on."""
    packages = ", ".join(
        f"{name} {version(name)}" for name in ("mujoco", "numpy", "lark", "shapely")
    )
    cores = f"{os.cpu_count()} cores, {platform.machine()}"
    return f"Python {platform.python_version()}, {packages}; {cores}."


def main() -> None:
    """Measure everything and write docs/benchmarks.md."""
    sections: list[tuple[str, Callable[[], list[str]]]] = []
    with tempfile.TemporaryDirectory() as folder:
        sections = [
            ("From PAG to proof and layout", lambda: scaling(Path(folder))),
            ("Runs", runs),
        ]
        parts = [f"## {title}\n\n" + "\n".join(measure()) for title, measure in sections]
    text = "\n\n".join(
        [
            "# Benchmarks",
            "Written by `make bench`. " + machine(),
            "Random PAGs are mixed trees of mates, welds and parts without geometry. Check is the"
            " whole process, interpreter start included: parse, compile, verify, print. Layout"
            " includes the payloads' extents and the certificate that `lay_out` asks for. Runs are"
            " in MuJoCo at 2 ms, contact between different units on, one body per part, jitter 0.",
            *parts,
        ]
    )
    (ROOT / "docs" / "benchmarks.md").write_text(text + "\n")


if __name__ == "__main__":
    main()
