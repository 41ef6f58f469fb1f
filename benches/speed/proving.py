"""From PAG to proof, layout and model."""

from __future__ import annotations

import json
import tempfile
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from benches.speed.factories import robots_at_least
from benches.speed.processes import FACTORY, fresh, interleaved, median, resident, run, serve
from benches.speed.states import random_pag_text
from benches.tables import table

LABELS = (100, 1_000, 10_000, 100_000)

LARGEST = 1_000
"""Labels of the largest PAG that is laid out."""

ROBOTS = 300
"""Of the factory that is built twice."""

AIMS = (
    ("check of 100,000 labels, after parsing", 100_000, "check_s", 5.0),
    ("check of 100,000 labels, the whole process", 100_000, "process_s", 6.0),
    ("layout of 1,000 labels with its certificate", 1_000, "layout_s", 15.0),
)
"""What is aimed at: name, labels, figure, most seconds."""

BUILD_AIM = 1.0
"""Seconds for the second build."""


def work(file: str, lay_out: bool) -> dict[str, Any]:
    """The stages of `check`, and of `build` up to the certificate, one by one [s]."""
    from factory.engine.timing.pool import part_pool
    from factory.pipeline import read
    from factory.support.collector import collector_paused
    from factory.theory.nets.verify import verify

    found: dict[str, Any] = {}
    with collector_paused():
        begin = perf_counter()
        project = read(Path(file), ())
        parsed = perf_counter()
        plan = project.plain
        verdict = verify(plan.net, {r.name: r.position for r in plan.robots if r.position})
        part_pool(plan)
        found |= {"parse_s": parsed - begin, "check_s": perf_counter() - parsed}
        assert verdict.holds
        if lay_out:
            found |= _laid_out(plan)
    return {**found, "memory_MB": resident()}


def _laid_out(plan: Any) -> dict[str, float]:
    from factory.floor.geometry.product import product_geometry
    from factory.floor.layout.clearance import certify
    from factory.floor.layout.embedding import lay_out

    begin = perf_counter()
    layout = lay_out(plan, product_geometry(plan.pag))
    middle = perf_counter()
    assert certify(layout).holds
    return {"layout_s": middle - begin, "certificate_s": perf_counter() - middle}


def checked(file: Path) -> dict[str, Any]:
    """`factory check`, a whole process."""
    process = run([*FACTORY, "check", file, "--json"])
    return {"process_s": process.seconds, "process_MB": process.megabytes}


def built_twice(file: Path) -> dict[str, Any]:
    """`factory build -o`, a whole process, and once more into the same folder; the user's cache is
    empty at first."""
    with tempfile.TemporaryDirectory() as folder:
        command = [*FACTORY, "build", file, "-o", Path(folder) / "out", "--json", "-q"]
        first, second = (run(command, XDG_CACHE_HOME=folder) for _ in range(2))
    said = json.loads(second.text)
    return {"robots": said["robots"], "first_s": first.seconds, "second_s": second.seconds}


def measure(quick: bool = False) -> dict[str, Any]:
    """All sizes, in turns; large ones less often."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for labels in LABELS[:2] if quick else LABELS:
            file = folder / f"random{labels}.pag"
            file.write_text(random_pag_text(labels, 1))
            stages = partial(fresh, work, file=str(file), lay_out=labels <= LARGEST)
            runs = 3 if labels < LARGEST and not quick else 1
            apart, whole = interleaved([stages, partial(checked, file)], runs)
            rows.append({"labels": labels, "runs": runs, **median(apart), **median(whole)})
        robots = 100 if quick else ROBOTS
        file = folder / "balanced.pag"
        file.write_text(robots_at_least(robots))
        (built,) = interleaved([partial(built_twice, file)], 1)
    return {"rows": rows, "build": {"runs": len(built), **median(built)}}


def section(results: dict[str, Any]) -> str:
    """The report."""
    figures = {row["labels"]: row for row in results["rows"]}
    head = (
        *("labels", "parse [s]", "compile and prove [s]", "layout [s]", "certificate [s]"),
        *("memory [MB]", "`factory check` [s]", "its memory [MB]", "runs"),
    )
    keys = ("parse_s", "check_s", "layout_s", "certificate_s", "memory_MB")
    rows = [
        (
            row["labels"],
            *(round(row[key], 3) if key in row else None for key in keys),
            round(row["process_s"], 2),
            round(row["process_MB"]),
            row["runs"],
        )
        for row in results["rows"]
    ]
    aims = [
        (what, f"**{figures[labels][key]:.2f} s**", f"< {most:g} s")
        for what, labels, key, most in AIMS
        if labels in figures
    ]
    build = results["build"]
    said = f"build of {build['robots']} robots"
    aims.append((f"{said} the first time", f"{build['first_s']:.2f} s", "–"))
    aims.append((f"{said} the second time", f"**{build['second_s']:.2f} s**", f"< {BUILD_AIM:g} s"))
    return "\n\n".join(
        [
            "## From PAG to proof and layout",
            "Random PAGs are mixed trees of mates and parts without geometry. The stages are timed"
            " inside one process, `factory check` is a whole one: interpreter start, parse,"
            " compile, prove, print. Layout includes the certificate that `lay_out` asks for; the"
            " certificate's column is that once more, apart. Medians of fresh processes.",
            table(head, rows),
            "The build is `factory build -o` of a balanced tree, a whole process, with nothing"
            f" kept, and once more into the same folder (medians of {build['runs']}).",
            table(("what", "measured", "aim"), aims),
        ]
    )


if __name__ == "__main__":
    serve(work)
