"""Planted faults: what each run with one fails by."""

from __future__ import annotations

from benches.tables import table
from tests.planted import BENIGN, PLANTS

WHERE = {
    "xml": "text of the model",
    "engine": "engine's model",
    "run": "engine, at 1 s",
    "while": "engine, for 0.2 s",
    "mesh": "engine's model",
    "disturbance": "a disturbance",
    "switch": "bodies, before a weld switches",
    "product": "PAG",
    "log": "log",
    "settings": "settings",
}


def measure(quick: bool = False) -> dict:
    """A run of each plant of the table; of a few if it is to be quick."""
    rows = []
    for plant in (*PLANTS, *BENIGN)[:: 20 if quick else 1]:
        verdict = plant.verdict()
        codes = dict.fromkeys(failure.code for failure in verdict.failures)
        rows.append(
            {
                "plant": plant.name,
                "where": WHERE[plant.kind],
                "benign": not plant.codes,
                "status": int(not verdict.succeeded),
                "codes": list(codes),
            }
        )
    return {"plants": rows}


def section(results: dict) -> str:
    """The report."""
    plants = results["plants"]
    faults = [plant for plant in plants if not plant["benign"]]
    found = sum(plant["status"] for plant in faults)
    missed = [plant["plant"] for plant in faults if not plant["status"]]
    quiet = sum(not plant["status"] for plant in plants if plant["benign"])
    rows = [
        (p["plant"], p["where"], "benign" if p["benign"] else None, p["status"], codes)
        for p in plants
        for codes in [", ".join(p["codes"]) or None]
    ]
    return "\n\n".join(
        [
            "## Planted faults",
            "Runs of 1 or 2 units of the paper's example, or of two boxes, each with one fault"
            " (`tests/planted.py`). The codes are all by which the run fails, in the order of"
            " time: the first names the cause. Benign ones are what a factory is made to bear.",
            table(("planted", "where", "", "status", "found as"), rows),
            f"**{found} of {len(faults)} faults found, {quiet} of {len(plants) - len(faults)}"
            f" benign ones let pass.**" + (f" Missed: {', '.join(missed)}." if missed else ""),
        ]
    )
