"""How the parts of each product come together, and what contact is left out when it is made."""

from __future__ import annotations

from time import perf_counter
from typing import Any

from benches.fidelity.products import BRICKS_NAMES, REAL, file_of, is_here, layout, over_cores
from benches.tables import table
from factory.engine.simulation.request import RunRequest
from factory.engine.simulation.simulation import Simulation
from factory.floor.mating.findings import Level
from factory.floor.mating.paths import CLEAR, TOLERANCE
from factory.pipeline import read

PRODUCTS = (*REAL, "chest", "stool", "lamp", "shelf", *BRICKS_NAMES[:-1])
"""Products whose parts have shapes of their own (203 bricks take twice as long as all of them)."""

FORCED = 2
"""Units made to see the forces of mating."""


def judged(name: str) -> dict[str, Any]:
    """The three figures of one product, and a run with contact on."""
    source = read(file_of(name))
    assert source.product
    begin = perf_counter()
    found = source.matings
    assert found is not None
    seconds = perf_counter() - begin
    run = Simulation(layout(name), RunRequest(units=FORCED, jitter=0.3)).run()
    assert run.physics is not None
    forces = run.physics.mating_forces
    return {
        "product": name,
        "operations": len(found.all),
        "left_out": found.count(Level.LEFT_OUT),
        "no_deeper": found.count(Level.NO_DEEPER),
        "strict": found.count(Level.STRICT),
        **{kind: len(found.of_kind(kind)) for kind in ("slide", "lower", "blocked")},
        "seconds": round(seconds, 2),
        "excluded": len(run.physics.excluded),
        "force_n": run.physics.mating_force_max_n,
        "where": max(forces, key=forces.__getitem__) if forces else None,
        "contacts": run.physics.unintended_contacts,
        "products": run.products,
    }


def measure(quick: bool = False) -> dict[str, Any]:
    """All products that are here."""
    names = [*filter(is_here, PRODUCTS[:2] if quick else PRODUCTS)]
    return {"products": over_cores(judged, names)}


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = (
        "product",
        "operations",
        "overlaps left out",
        "no deeper",
        "strictly",
        "slide",
        "lowered",
        "blocked",
        "analysis [s]",
        "pairs excluded",
        "mating force [N]",
        "in",
        "unintended contacts",
    )
    rows = [
        tuple(
            p[key]
            for key in (
                "product",
                "operations",
                "left_out",
                "no_deeper",
                "strict",
                "slide",
                "lower",
                "blocked",
                "seconds",
                "excluded",
                "force_n",
                "where",
                "contacts",
            )
        )
        for p in results["products"]
    ]
    return "\n\n".join(
        [
            "## How parts come together",
            "How many operations are clean on the approach chosen: with pairs that overlap in the"
            " finished product left out, with paths no deeper than that overlap, and strictly, with"
            f" no overlap over {1e3 * TOLERANCE:g} mm and {1e3 * CLEAR:g} mm of room on the way."
            f" Then {FORCED} units are made at jitter 0.3 with contact on for all pairs but the"
            " excluded ones: the largest force between inputs while they are joined.",
            table(head, rows),
        ]
    )
