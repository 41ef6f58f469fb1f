"""The product as the hero of a still: what stands in its way is left out, and it is seen from its
free side."""

from __future__ import annotations

import numpy as np
import shapely

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.film.action import Snapshot, outlines, placed
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.sight import Framing, View, fit, towards

USUAL, ELEVATION = -122.0, 38.0
"""From where a product is looked at if all sides are as free [degrees]."""

STEP = 15.0
"""Between the directions that are tried [degrees]."""

LIKING = 0.08
"""How much more of a product may be hidden from the usual side than from the opposite."""

SCENERY = ("outfeed/housing", "outfeed/upright", "outfeed/roof", "outfeed/back", "outfeed/wall")
"""The shed, by what the names of its geoms begin with; the belt stays."""


def clear_the_way(replica: Replica, shown: Snapshot) -> None:
    """Leave out the feeders with what hangs from them, the shed and its door."""
    m = replica.m
    hung = {
        body
        for e, body in zip(shown.active.tolist(), shown.body2.tolist(), strict=True)
        if names.kind(m.equality(e).name) == "feed"
    }
    bodies = [m.body(b).name for b in range(m.nbody)]
    away = {b for b, name in enumerate(bodies) if names.kind(name) == "feeder"} | hung
    away |= {b for b, name in enumerate(bodies) if name.startswith(names.SHUTTER)}
    for g in range(m.ngeom):
        body = int(m.geom_bodyid[g])
        if {body, int(m.body_parentid[body])} & away or m.geom(g).name.startswith(SCENERY):
            m.geom_group[g] = SHOWN


def free_side(replica: Replica, points: Array, box: Array, framing: Framing) -> View:
    """The view of points (n, 3) in which what is left hides least of a box (8, 3) [m]."""
    m, d = replica.m, replica.d
    boxes = np.array([placed(m, d, g) for g in range(m.ngeom) if _is_before(m, g)])
    tried = USUAL + np.arange(0.0, 360.0, STEP)
    views = [fit(points, towards(azimuth, ELEVATION), framing) for azimuth in tried]
    liking = LIKING / 2 * np.cos(np.radians(tried - USUAL))
    free = [like - _hidden(view, boxes, box) for like, view in zip(liking, views, strict=True)]
    return views[int(np.argmax(free))]


def _is_before(m: mujoco.MjModel, geom: int) -> bool:
    """Whether a geom may hide a product: one that is drawn, not of a part."""
    kind = names.kind(m.body(int(m.geom_bodyid[geom])).name)
    flat = m.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
    return bool(m.geom_group[geom] < SHOWN and not flat and kind not in ("part", names.SHELL))


def _hidden(view: View, boxes: Array, box: Array) -> float:
    """The share of a box (8, 3) that nearer boxes (n, 8, 3) hide in a view."""
    ahead = (boxes.mean(axis=1) - box.mean(axis=0)) @ view.axes[2]
    front, of = outlines(view, boxes[ahead < 0])[0], outlines(view, box[None])[0][0]
    taken = shapely.intersection(shapely.union_all(front), of)
    return float(shapely.area(taken) / max(float(shapely.area(of)), 1e-12))
