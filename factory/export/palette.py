"""The colours of gears in drawings of a net, told apart by people who see few (Okabe and Ito)."""

from __future__ import annotations

from collections.abc import Sequence

COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00", "#56b4e9", "#7f3c8d", "#e73f74",
)  # fmt: skip

SHARED = "#333333"
"""The colour of what belongs to several robots, or to none."""


def colour(owners: Sequence[int]) -> str:
    """The colour of what belongs to these gears (indices)."""
    return COLOURS[owners[0] % len(COLOURS)] if len(owners) == 1 else SHARED
