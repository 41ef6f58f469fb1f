"""Inherited entries of a clearance certificate (Theorem 12): what a certificate says of a pair of
regions depends on these two alone, and on the modes that they are in.

So where both robots of a pair are where they were and hold what they held, what was certified of
them still holds, word for word; only pairs with a region that is new are computed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from factory.api import Layout, Point2
from factory.apps.revise.pairing import Pairing
from factory.floor.layout.certificate import ALWAYS, Region


@dataclass(frozen=True)
class Inheritance:
    """Which `regions` of a certificate (index) are which of another's, and how many `pairs` there
    are of different robots in one layer, of which so many are `inherited`. `shift`: by how much
    the floor of the new layout lies elsewhere [m]."""

    regions: Mapping[int, int] = field(repr=False)
    pairs: int
    inherited: int
    shift: Point2

    @classmethod
    def of(cls, old: Layout, new: Layout, pairing: Pairing, shift: Point2) -> Inheritance:
        """What the certificate of a layout has from that of another. Both have one."""
        assert old.certificate is not None and new.certificate is not None, "both are certified"
        named = {_named(r, pairing, shift): n for n, r in enumerate(old.certificate.regions)}
        mine = [_key(region) for region in new.certificate.regions]
        regions = {n: named[key] for n, key in enumerate(mine) if key in named}
        kept = [r for n, r in enumerate(new.certificate.regions) if n in regions]
        counts = pairs_of([*new.certificate.regions]), pairs_of(kept)
        return cls(regions, *counts, shift)


def _key(region: Region) -> tuple[object, ...]:
    box = tuple(round(value, 6) + 0.0 for value in region.box)
    return region.robot, region.layer, region.kind, box, region.z, region.label, region.mode


def _named(region: Region, pairing: Pairing, shift: Point2) -> tuple[object, ...]:
    """The key of an old region as it would be in the new certificate."""
    old, new = pairing.old, pairing.new
    label = region.label
    if label in old.by_label:
        number = pairing.operations.get(old.by_label[label].index)
        label = f"no longer {label}" if number is None else new.operations[number].label
    moved = np.array(region.box) + np.repeat(shift, 2)
    box = tuple(round(value, 6) + 0.0 for value in moved.tolist())
    mode = region.mode if region.mode == ALWAYS else pairing.operations.get(region.mode, -2)
    robot = pairing.robots.get(region.robot, -1)
    return robot, region.layer, region.kind, box, region.z, label, mode


def pairs_of(regions: list[Region]) -> int:
    """How many pairs of regions in one layer are of different robots."""
    layers = Counter(region.layer for region in regions)
    robots = Counter((region.layer, region.robot) for region in regions)
    return sum(n * (n - 1) // 2 for n in layers.values()) - sum(
        n * (n - 1) // 2 for n in robots.values()
    )
