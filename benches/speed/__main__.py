"""`python -m benches.speed [--quick] [NAME ...]`: measure all sections, or some, and write
docs/benchmarks.md."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from benches.reporting import DOCS, Report
from benches.speed.factories import LAYOUTS
from benches.speed.processes import ROOT

REPORT = Report(
    "benches.speed",
    "# Benchmarks\n\nWritten by `make bench` (`python -m benches.speed NAME` for one section) from"
    " what is kept in docs/benchmarks/.",
    (
        "production",
        "floors",
        "profile_300",
        "movers",
        "few_robots",
        "states",
        "firings",
        "proving",
        "sweeping",
        "rendering",
        "products",
    ),
    DOCS / "benchmarks.md",
    ("mujoco", "numpy", "scipy", "lark", "shapely"),
)


def main() -> None:
    """Measure, and write the report after each section."""
    parser = REPORT.parser(__doc__)
    parser.add_argument("-o", "--output", type=Path, default=REPORT.path, help="the report")
    given = parser.parse_args()
    report = replace(REPORT, path=given.output)
    names = report.chosen(parser, given)
    if names:
        subprocess.run([ROOT / "tools" / "rivals"], check=False)
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault(LAYOUTS, folder)
        for name in names:
            if len(names) > 1:  # what a process starts is said to be as large as itself
                more = ("--quick",) if given.quick else ()
                words = (sys.executable, "-m", REPORT.package, name, "-o", given.output, *more)
                subprocess.run(words, check=True)
            else:
                print(f"{name} ", end="", flush=True)
                report.measure(name, given.quick)
                report.write()


if __name__ == "__main__":
    main()
