"""Certify a layout: machines that are ever in one place at once keep apart.

Guarantees nothing about how the layout was made, and uses nothing of it. There is one rule: any two
machines that come near each other in two places of the coordinated net are never in both
(`exclusions`). What stands is there in all places, so all else stays clear of it. Beside that rule
stand what the net says nothing about: guidepaths that meet and cross as they may, and the ends of
operations.
"""

from __future__ import annotations

from itertools import chain, islice

from factory.floor.layout.certificate import NAMES, Certificate, Exclusions
from factory.floor.layout.crossings import embedding_faults
from factory.floor.layout.dimensions import BELT_GAP, FINGER_LOW, FINGER_TOP, PAYLOAD
from factory.floor.layout.exclusions import exclusions
from factory.floor.layout.layout import Layout
from factory.floor.layout.meeting import collisions, meeting_faults
from factory.floor.layout.sweeps import piles_of, regions
from factory.theory.problem.robot_bodies import ARM_LOW, ARM_TOP, CARRIAGE_TOP

MOST = 100
"""So many faults are listed; there is no use in more."""


def certify(layout: Layout) -> Certificate:
    """The clearance certificate of a layout, computed without anything of the search. Never raises;
    see `Certificate.holds`.

    Args:
        layout: the layout.
    """
    factory, by_label = layout.factory, piles_of(layout)
    swept, apart = regions(layout), Exclusions()
    faults = [*islice(embedding_faults(layout), MOST)]
    if not faults:  # what the net says nothing about comes first: it is found at once
        faults += islice(chain(meeting_faults(layout, by_label), collisions(layout)), MOST)
    if not faults:
        apart = exclusions(layout)
    top = max(region.z[1] for region in swept)
    return Certificate(
        layout.clearance,
        tuple(zip(NAMES, (0.0, CARRIAGE_TOP, PAYLOAD), (CARRIAGE_TOP, ARM_TOP, top), strict=True)),
        (
            ("carriages to arms", ARM_LOW - CARRIAGE_TOP),
            ("masts and arms to fingers", FINGER_LOW - ARM_TOP),
            ("masts and arms to payloads", PAYLOAD - ARM_TOP),
            ("fingers to payloads", PAYLOAD - FINGER_TOP),
            ("outfeed to payloads", BELT_GAP),
        ),
        tuple(robot.name for robot in factory.robots),
        tuple(operation.label for operation in factory.operations),
        tuple(swept),
        (*faults, *apart.faults[:MOST]),
        apart,
    )
