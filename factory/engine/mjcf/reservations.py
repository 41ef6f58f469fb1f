"""What a run of a model does not show: labels that are held without a hand, and pairs of parts that
are left out of contact."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

from factory.floor.layout.layout import Layout
from factory.theory.plant.approaches import Pair

SHOWN = 4
"""The most labels that are named."""


def reservations_of(layout: Layout, excluded: Sequence[Pair]) -> tuple[str, ...]:
    """What a run of a layout with these pairs left out of contact does not show, in words."""
    words, labels = list[str](), unheld(layout)
    if labels:
        listed = ", ".join(f"'{label}'" for label in labels[:SHOWN])
        more = f" and {len(labels) - SHOWN} more" if len(labels) > SHOWN else ""
        words.append(f"no hand holds {listed}{more}")
    if excluded:
        pairs = comb(len(layout.factory.leaves), 2)
        words.append(f"{len(excluded)} of {pairs} pairs of parts were not tested for contact")
    return tuple(words)


def unheld(layout: Layout) -> list[str]:
    """The labels that robots hold without a hand, where hands are chosen."""
    factory, labels = layout.factory, list[str]()
    for robot, hand in enumerate(layout.hands):
        if hand is None or hand.kind.holds:
            continue
        for tour in factory.tours[robot]:
            last = factory.operations[tour[-1]]
            labels.append(last.before[last.robots.index(robot)])
    return list(dict.fromkeys(labels))
