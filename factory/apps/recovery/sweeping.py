"""Floor over which machines pass."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from factory.api import Dimensions, Layout, LayoutMachines, Mode
from factory.support.arrays import Array, Index


@dataclass(frozen=True, eq=False, slots=True)
class SweptFloor:
    """The rectangles (n, 4) [m] that robots (n,) and what they carry sweep, seen from above: least
    and greatest x, least and greatest y."""

    boxes: Array = field(repr=False)
    robots: Index = field(repr=False)

    @classmethod
    def of(cls, layout: Layout) -> SweptFloor:
        """The swept floor of a layout."""
        occupied = LayoutMachines(layout).regions
        robots = np.array([region.robot for region in occupied], np.intp)
        return cls(np.array([region.box for region in occupied]), robots)

    def near(self, places: Array, radii: Array) -> frozenset[int]:
        """The robots that come near balls with `radii` (k,) about `places` (k, 2) [m]."""
        least, most = places.min(axis=0), places.max(axis=0)
        far = float(radii.max()) + Dimensions.APART + Mode.ROUNDING
        about = (self.boxes[:, [1, 3]] > least - far) & (self.boxes[:, [0, 2]] < most + far)
        here = about.all(axis=1)
        (x, y), box = places.T[:, :, None], self.boxes[here][None]
        away = np.maximum(np.maximum(box[..., 0] - x, x - box[..., 1]), 0.0) ** 2
        away += np.maximum(np.maximum(box[..., 2] - y, y - box[..., 3]), 0.0) ** 2
        hit = (away < (radii[:, None] + Dimensions.APART) ** 2).any(axis=0)
        return frozenset(self.robots[here][hit].tolist())
