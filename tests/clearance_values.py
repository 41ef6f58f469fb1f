"""Clearance certificates for tests: of values in memory, which may have been changed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco

from factory.apps.exports.clearance.checking import faults_of
from factory.apps.exports.clearance.documents import DocumentReader, Row, proof_of

Json = dict[str, Any]


def check(m: mujoco.MjModel, ways: Json, clearance: Json) -> list[str]:
    """What is wrong, [] where no two machines ever meet; with the net that the ways refer to."""
    net = {row["place"]: Row(row["before"], row["after"], row["tokens"]) for row in ways["places"]}
    documents = (
        DocumentReader(Path("ways.json"), ways),
        DocumentReader(Path("clearance.json"), clearance),
    )
    return faults_of(proof_of(m, net, *documents))
