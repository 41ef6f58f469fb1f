"""LDraw sets and the rocket of ConstructionBots.jl: from a tree of parts to a proved factory."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benches.fidelity.products import BRICKS, BRICKS_NAMES, EXAMPLES, file_of, is_here
from benches.speed.processes import FACTORY, run
from benches.tables import table

ROCKET = BRICKS.parent / "rocket.pag"
"""LEGO set 21309 without geometry: 1,845 parts."""

KEYS = (
    *("robots", "products", "refines_net", "handoff_gap_max_mm", "product_error_max_mm"),
    *("unintended_contacts", "sim_time_s", "area_m2"),
)
"""What is kept of what the commands say."""


def measure(quick: bool = False) -> Iterator[dict[str, Any]]:
    """`check`, `build` and `run --units 1` of each product, the rocket without `run`, each once, in
    a process of its own, with a cache that is empty before the first."""
    names = ["lamp"] if quick else [*filter(is_here, BRICKS_NAMES)]
    products: list[tuple[Path, tuple[str, ...]]]
    products = [(file_of(name), ("check", "build", "run")) for name in names]
    if ROCKET.is_file() and not quick:
        products.append((ROCKET, ("check", "build")))
    rows: list[dict[str, Any]] = []
    for file, commands in products:
        row: dict[str, Any] = {"product": file.stem, "bricks": file.parent != EXAMPLES}
        with tempfile.TemporaryDirectory() as folder:
            more = {"check": (), "build": ("--mjcf", Path(folder) / "x.xml"), "run": ("--units", 1)}
            for command in commands:
                words = (*FACTORY, command, file, *more[command], "--json", "-q")
                done = run(words, True, XDG_CACHE_HOME=folder)
                said = json.loads(done.text)
                row[command] = {
                    **{key: said[key] for key in KEYS if key in said},
                    "why": reasons(said),
                    "status": done.status,
                    "seconds": done.seconds,
                    "processor_s": done.processor,
                    "megabytes": done.megabytes,
                }
                if command == "check":
                    row["parts"] = len(said["part_pool"])
                    row["blocked"] = (said.get("approaches") or {}).get("blocked")
                    row["proved"] = all(said[k] for k in ("live", "safe", "reversible", "legal"))
                print(".", end="", flush=True)
        rows.append(row)
        yield {"rows": rows}
    print()


def reasons(said: dict[str, Any]) -> list[str]:
    """The codes of the failures of a run."""
    failures = said.get("verdict", {}).get("failures", [])
    return sorted({failure["code"] for failure in failures})


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        *("product", "parts", "robots", "proved live, safe, reversible", "`check` [s]"),
        *("`build` [s]", "memory [MB]", "floor [m²]", "`run --units 1` [s]", "clean run"),
        *("blocked", "gap [mm]", "error [mm]", "contacts", "reason"),
    )
    rows = []
    for row in results["rows"]:
        build, ran = row["build"], row.get("run", {})
        rows.append(
            (
                *(row["product"], row["parts"], build["robots"], row["proved"]),
                *(f"{row['check']['processor_s']:.1f}", f"{build['processor_s']:.1f}"),
                *(f"{build['megabytes']:.0f}", f"{build['area_m2']:.1f}"),
                f"{ran['processor_s']:.1f}" if ran else "not run",
                not ran["status"] if ran else None,
                row["blocked"],
                *(ran.get(key) for key in ("handoff_gap_max_mm", "product_error_max_mm")),
                ran.get("unintended_contacts"),
                ", ".join(ran.get("why", ())) or None,
            )
        )
    return "\n\n".join(["## Bricks", TEXT, table(head, rows)])


TEXT = """\
`factory check FILE`, `factory build FILE --mjcf OUT.xml` and `factory run FILE --units 1`, each
once, in a process of its own; the cache is empty when a product's first one begins. Times are of
the processor. *Clean run*:
exit status 0, that is, all units made, the record refines the net, the monitor agrees, no
unintended contact. *Reason*: the [codes](reference/index.md) of the
verdict. *Blocked*: operations of the tree, taken as it is drawn, in which parts pass through each
other on straight ways, as `check` says; such pairs do not collide, and a run names them.

What ConstructionBots.jl publishes for LEGO models:

| model | parts | assemblies | robots | plan |
|---|---|---|---|---|
| Saturn V (set 21309) | 1,845 | 306 | 250 | "under three minutes on a standard laptop" |
| Imperial Shuttle, mini (set 4494) | 84 | 5 | not stated where read | not stated where read |

Sources: K. Brown, D. M. Asmar, M. Schwager, M. J. Kochenderfer, *Large-Scale Multi-Robot Assembly
Planning for Autonomous Manufacturing*, [arXiv 2311.00192](https://arxiv.org/abs/2311.00192)
(abstract: parts, assemblies, robots, three minutes), and the list of models in
[`scripts/demos.jl`](https://github.com/sisl/ConstructionBots.jl/blob/main/scripts/demos.jl).

Not the same problem. Theirs: mobile robots that carry parts over a free floor, several tasks each,
alone or in teams, kept apart while they move; how parts are joined is abstracted away. Ours: as
many robots as the tree has roles, on guidepaths, laid out and proved free of deadlock before
anything moves; with hands, contact and welds when it runs. The rocket is the same set as a tree
without shapes: each part is a default box. Its factory is built, not run, here.
Fewer robots for it (`--robots 250`, as many as theirs) need a search that was not measured."""
