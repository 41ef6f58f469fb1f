"""Posts and booms of feeders fade where they hide the action. Housings and the shed do not fade,
since their contents must stay out of sight.

The opacity follows from the view alone, so a still, a film of a run and a film of its log show the
same.
"""

from __future__ import annotations

import numpy as np
import shapely

from factory.geometry.sight import Array, View
from factory.mjcf import names
from factory.mjcf.replica import Replica, paint, shown
from factory.rendering.action import placed

FAINT = 0.16
"""Opacity of a geom that hides the action."""

SEEN, HIDDEN = 0.05, 0.20
"""Hidden shares of a box at which geoms begin to fade, and are fully faded."""

ROUND = 0.03
"""How far about a box counts as that box [m]: what is thin is not hidden all of a sudden."""

STANDS = ("post", "boom")
"""Geoms of a feeder that fade."""


class Fading:
    """Fades geoms of a replica of the model."""

    def __init__(self, replica: Replica) -> None:
        self.m, d = replica.m, replica.d
        self.last: View | None = None
        stands: list[tuple[int, str]] = []
        for body in range(1, self.m.nbody):
            if names.kind(name := self.m.body(body).name) == "feeder":
                geoms = shown(self.m, body)
                stands += [(g, name) for g in geoms if self.m.geom(g).name.endswith(STANDS)]
        self.geoms = np.array([g for g, _ in stands], np.intp)
        self.groups = np.unique([group for _, group in stands], return_inverse=True)[1]
        self.paint = np.array([paint(self.m, g) for g in self.geoms]).reshape(-1, 4)
        self.boxes = np.array([placed(self.m, d, g) for g in self.geoms]).reshape(-1, 8, 3)

    def fade(self, view: View, watched: Array) -> None:
        """Fade geoms that hide much of any of the boxes `watched` (n, 8, 3) in a view."""
        if view is self.last or not len(self.geoms):
            return
        self.last = view
        share = (self.hidden(view, watched) - SEEN) / (HIDDEN - SEEN)
        share = np.clip(share, 0.0, 1.0)[self.groups]
        self.m.geom_rgba[self.geoms] = self.paint
        self.m.geom_rgba[self.geoms, 3] *= 1.0 - (1.0 - FAINT) * share * share * (3 - 2 * share)

    def hidden(self, view: View, watched: Array) -> Array:
        """For each group of geoms the greatest share of a watched box that it hides in a view."""
        watched = watched + ROUND * np.sign(watched - watched.mean(axis=1, keepdims=True))
        (front, before), (back, behind) = outlines(view, self.boxes), outlines(view, watched)
        one, other = shapely.STRtree(back).query(front, predicate="intersects")
        shared = shapely.area(shapely.intersection(front[one], back[other]))
        shared /= np.maximum(shapely.area(back[other]), 1e-12)
        ahead = behind[other].mean(axis=1) - before[one].mean(axis=1)
        deep = (np.ptp(behind[other], axis=1) + np.ptp(before[one], axis=1)) / 2
        shared *= np.clip(2 * ahead / deep - 1, 0.0, 1.0)
        count = len(watched)
        pairs, number = np.unique(self.groups[one] * count + other, return_inverse=True)
        together = np.bincount(number, shared, len(pairs))
        greatest = np.zeros(int(self.groups.max()) + 1)
        np.maximum.at(greatest, pairs // count, together)
        return greatest


def outlines(view: View, boxes: Array) -> tuple[Array, Array]:
    """The outlines (n,) of boxes (n, 8, 3) in a view, as polygons, and how far ahead (n, 8) their
    corners are."""
    seen = (boxes - view.position) @ view.axes.T
    ahead = np.maximum(seen[:, :, 2], 1e-3)
    points = shapely.multipoints(shapely.points(seen[:, :, :2] / ahead[:, :, None]))
    return shapely.convex_hull(points), seen[:, :, 2]
