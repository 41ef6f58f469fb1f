"""`python -m tests.bench [--quick] [NAME ...]`: measure all sections, or some, and write
docs/benchmarks.md."""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

from tests.bench.processes import ROOT

SECTIONS = (
    "production",
    "floors",
    "profile_300",
    "movers",
    "relays",
    "states",
    "proving",
    "sweeping",
    "rendering",
    "products",
)
"""Modules of this package with `measure` and `section`, in the order of the report."""

FOLDER, REPORT = ROOT / "docs" / "benchmarks", ROOT / "docs" / "benchmarks.md"


def setting() -> dict[str, str]:
    """What it was measured on, and when."""
    names = ("mujoco", "numpy", "scipy", "lark", "shapely")
    packages = [f"{name} {version(name)}" for name in names]
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "machine": f"{os.cpu_count()} cores of {processor()}, {platform.system()}",
        "versions": ", ".join([f"Python {platform.python_version()}", *packages]),
    }


def processor() -> str:
    """What kind of processor this is, as well as the system says."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.machine())


def measured(name: str, quick: bool, folder: Path = FOLDER) -> None:
    """Measure a section and keep what it found."""
    begin = perf_counter()
    results = import_module(f"tests.bench.{name}").measure(quick)
    kept = {
        "section": name,
        "quick": quick,
        "seconds": round(perf_counter() - begin, 1),
        **setting(),
        "results": results,
    }
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.json").write_text(json.dumps(kept, indent=1, ensure_ascii=False) + "\n")


def report(folder: Path = FOLDER) -> str:
    """The report on all that is kept."""
    parts = [
        "# Benchmarks",
        "Written by `make bench` (`python -m tests.bench NAME` for one section) from what is kept"
        " in docs/benchmarks/.",
    ]
    for name in SECTIONS:
        file = folder / f"{name}.json"
        if file.is_file():
            kept = json.loads(file.read_text())
            parts += [import_module(f"tests.bench.{name}").section(kept["results"]), _foot(kept)]
    return "\n\n".join(parts) + "\n"


def _foot(kept: Mapping[str, object]) -> str:
    quick = ", the quick version" if kept["quick"] else ""
    return (
        f"*Measured on {kept['date']} in {kept['seconds']} s{quick}: {kept['versions']};"
        f" {kept['machine']}.*"
    )


def main() -> None:
    """Measure, and write the report after each section."""
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SECTIONS))
    parser.add_argument("--quick", action="store_true", help="a taste of each, in seconds")
    parser.add_argument("-o", "--output", type=Path, default=REPORT, help="the report")
    given = parser.parse_args()
    if unknown := set(given.names) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    subprocess.run([ROOT / "tools" / "rivals"], check=False)
    folder = given.output.with_suffix("")
    for name in given.names or SECTIONS:
        print(f"{name} ", end="", flush=True)
        measured(name, given.quick, folder)
        given.output.write_text(report(folder))


if __name__ == "__main__":
    main()
