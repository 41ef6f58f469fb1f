"""Planted faults: what each run with one, and each forged certificate, fails by."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benches.tables import table
from factory.apps.exports.clearance.checking import faults_of
from factory.apps.exports.clearance.documents import read_folder
from tests.apps.exports.test_clearance_files import FORGERIES, Forgery, built
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

DETECTORS = {
    "watch of the model": "NotSolid Options Mass Shape Altered Frame",
    "loading of the model": "Engine",
    "monitor": "Order Early Missed Dropped TwoHolders Exchanged Stuck",
    "figures of the bodies": "Contact EngineWarning HandOffGap HandOffTurn GripGap ProductError"
    " ProductTurn",
    "shapes of the product": "Overlap",
    "comparison of the log with its run": "Record NotJudged",
    "`check --clearance`": "BadProof",
}
"""What finds the failures of these codes."""


def measure(quick: bool = False) -> dict:
    """A run of each plant of the table, and a check of each forgery; of a few if it is to be
    quick."""
    step = 20 if quick else 1
    return {"plants": [*_runs(step), *_checks(step)]}


def _runs(step: int) -> Iterator[dict[str, Any]]:
    for plant in (*PLANTS, *BENIGN)[::step]:
        verdict = plant.verdict()
        failures = [(failure.code, failure.message) for failure in verdict.failures]
        yield _row(plant.name, WHERE[plant.kind], not plant.codes, not verdict.succeeded, failures)


def _checks(step: int) -> Iterator[dict[str, Any]]:
    """What is said of the certificate of the stool, as it is and forged."""
    forgeries = {
        "nothing in a certificate": (lambda _: None),
        **{n: c for n, (c, _) in FORGERIES.items()},
    }
    for name, change in [*forgeries.items()][::step]:
        with TemporaryDirectory() as folder:
            forgery = Forgery(Path(shutil.copytree(built("stool"), Path(folder) / "built")))
            change(forgery)
            faults = [("BadProof", words) for words in faults_of(read_folder(forgery.folder))]
        yield _row(name, "certificate", name not in FORGERIES, bool(faults), faults)


def _row(
    name: str, where: str, benign: bool, status: bool, failures: list[tuple[str, str]]
) -> dict[str, Any]:
    return {
        "plant": name,
        "where": where,
        "benign": benign,
        "status": int(status),
        "codes": [*dict.fromkeys(code for code, _ in failures)],
        "said": failures[0][1] if failures else "",
    }


def _detector(codes: list[str]) -> str | None:
    """What finds the first of these codes."""
    by_code = {code: name for name, all_of in DETECTORS.items() for code in all_of.split()}
    return by_code[codes[0]] if codes else None


def section(results: dict) -> str:
    """The report."""
    plants = results["plants"]
    faults = [plant for plant in plants if not plant["benign"]]
    found = sum(plant["status"] for plant in faults)
    missed = [plant["plant"] for plant in faults if not plant["status"]]
    quiet = sum(not plant["status"] for plant in plants if plant["benign"])
    rows = [
        (
            p["plant"],
            f"{p['where']}{', benign' if p['benign'] else ''}",
            p["status"],
            _detector(p["codes"]),
            p["said"].replace("|", "\\|").replace("<", "&lt;") or None,
            ", ".join(p["codes"]) or None,
        )
        for p in plants
    ]
    return "\n\n".join(
        [
            "## Planted faults",
            "Runs of 1 or 2 units of the paper's example, or of two boxes, each with one fault"
            " (`tests/planted.py`), and the files of the stool's certificate, forged"
            " (`tests/apps/exports/test_clearance_files.py`). The codes are all by which the run or"
            " the check fails, in the order of time: the first names the cause. Shown are what"
            " finds it, and what is said. Benign ones are what a factory is made to bear.",
            table(("planted", "where", "status", "found by", "said first", "codes"), rows),
            f"**{found} of {len(faults)} faults found, {quiet} of {len(plants) - len(faults)}"
            f" benign ones let pass.**" + (f" Missed: {', '.join(missed)}." if missed else ""),
        ]
    )
