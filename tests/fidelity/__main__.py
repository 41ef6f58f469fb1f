"""`python -m tests.fidelity [--quick] [NAME ...]`: measure all sections, or some, and write the
report."""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from time import perf_counter

SECTIONS = (
    "seeds",
    "approaches",
    "convergence",
    "disturbances",
    "attraction",
    "long_runs",
)
"""Modules of this package with `measure` and `section`, in the order of the report."""

DOCS = Path(__file__).resolve().parent.parent.parent / "docs"

FOLDER, REPORT = DOCS / "fidelity", DOCS / "fidelity.md"


def setting() -> dict[str, str]:
    """What it was measured on, and when."""
    packages = [f"{name} {version(name)}" for name in ("mujoco", "numpy", "scipy")]
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "machine": f"{os.cpu_count()} cores, {platform.machine()}, {platform.system()}",
        "versions": ", ".join([f"Python {platform.python_version()}", *packages]),
    }


def measured(name: str, quick: bool, folder: Path = FOLDER, only: Sequence[str] = ()) -> None:
    """Measure a section and keep what it found at once: one that takes long yields all that it has
    found so far, again and again. With `only` it measures these products, and the others that are
    kept stay as they are."""
    begin = perf_counter()
    measure = import_module(f"tests.fidelity.{name}").measure
    file = folder / f"{name}.json"
    kept = json.loads(file.read_text())["results"] if only and file.is_file() else None
    found = measure(quick, only, kept) if only else measure(quick)
    for results in [found] if isinstance(found, dict) else found:
        document = {
            "section": name,
            "quick": quick,
            "seconds": round(perf_counter() - begin, 1),
            **setting(),
            "results": results,
        }
        folder.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")


def report(folder: Path = FOLDER) -> str:
    """The report on all that is kept."""
    parts = [
        "# Fidelity",
        "How far the physics can be believed, measured. Written by `make fidelity`"
        " (`python -m tests.fidelity NAME` for one section) from what is kept in docs/fidelity/.",
    ]
    for name in SECTIONS:
        file = folder / f"{name}.json"
        if file.is_file():
            kept = json.loads(file.read_text())
            parts += [import_module(f"tests.fidelity.{name}").section(kept["results"]), _foot(kept)]
    return "\n\n".join(parts) + "\n"


def _foot(kept: Mapping[str, object]) -> str:
    quick = ", the quick version" if kept["quick"] else ""
    return (
        f"*Measured on {kept['date']} in {kept['seconds']} s{quick}: {kept['versions']};"
        f" {kept['machine']}.*"
    )


def main() -> None:
    """Measure, and write docs/fidelity.md after each section."""
    parser = argparse.ArgumentParser(prog="python -m tests.fidelity", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SECTIONS))
    parser.add_argument("--quick", action="store_true", help="a taste of each, in seconds")
    parser.add_argument(
        "--only", nargs="+", default=(), metavar="PRODUCT", help="of `seeds`: renew these products"
    )
    given = parser.parse_args()
    if given.only and given.names != ["seeds"]:
        parser.error("--only goes with `seeds`")
    if unknown := set(given.names) - set(SECTIONS):
        parser.error(f"no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    for name in given.names or SECTIONS:
        print(f"{name} ...", flush=True)
        measured(name, given.quick, only=given.only)
        REPORT.write_text(report())


if __name__ == "__main__":
    main()
