"""Faults matched with detected failures: missed faults and false alarms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from factory.record.failures import Failing, Failures, Stood

CAUSES = {
    "drop": "lost",
    "knocked": "lost",
    "misplaced": "misplaced",
    "bad_part": "rejected",
    "bad_joint": "residual",
    "dead": "jammed",
}
"""The test that finds each kind of fault, of those that some test finds."""


def summed(
    found: Sequence[Failing],
    struck: Mapping[str, int],
    undone: int,
    spares: int,
    contacts: int,
    stood: Sequence[Stood],
    binned: int = 0,
    spilled: tuple[str, ...] = (),
) -> Failures:
    """The failures of a run. A dead robot that was never asked to move does not count as missed. A
    robot that is stuck in its operation does not count as a false alarm: it indicates an input that
    has slipped."""
    stuck = sum(one.test == "jammed" and not one.is_death for one in found)
    tests, wanted = Counter(one.test for one in found), Counter[str]()
    tests["jammed"] -= stuck
    for kind, count in struck.items():
        if kind in CAUSES:
            wanted[CAUSES[kind]] += count
    wanted["jammed"] = min(wanted["jammed"], tests["jammed"])
    missed, alarms = wanted - tests, tests - wanted
    missed["residual"] -= min(stuck, missed["residual"])
    return Failures(
        tuple(found),
        {kind: count for kind, count in struck.items() if count},
        missed.total(),
        alarms.total(),
        undone,
        spares,
        contacts,
        tuple(stood),
        binned,
        spilled,
    )
