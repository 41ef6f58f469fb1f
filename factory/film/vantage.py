"""Where an overview is taken from: the side from which what moves is large, and in front of which
neither the shed nor housings stand."""

from __future__ import annotations

import numpy as np
import shapely

from factory.film.action import Action, outlines
from factory.support.arrays import Array
from factory.support.pictures.sight import Framing, View, fit, towards

USUAL, STEP = -62.0, 15
"""The azimuth that is preferred, and between those that are tried [degrees]."""

BETTER = 1.05
"""How much better another side has to be."""

CLUTTER = 4.0
"""How much worse it is to see a shed in front than less of the factory, by the share of the
picture that it takes."""


def overview(action: Action, framing: Framing) -> View:
    """The view of an action, aslant: from the south or from the side that shows the most of it; the
    narrower the picture, the higher up."""
    elevation = 40.0 if framing.aspect > 1.2 else 46.0 if framing.aspect > 0.8 else 52.0
    points, framed = action.points, action.framed

    def view_from(azimuth: float) -> View:
        return fit(framed, towards(azimuth, elevation), framing)

    usual = view_from(USUAL)
    enough = BETTER * _worth(action, usual)
    best, views = usual, [view_from(float(a)) for a in range(-180, 180, STEP)]
    for view in sorted(views, key=lambda view: -_size(points, view)):
        if _size(points, view) <= enough:  # no side is worth more than its size
            break
        if (worth := _worth(action, view)) > enough:
            best, enough = view, worth
    return best


def _size(points: Array, view: View) -> float:
    """How large points (n, 3) are seen, on average [1/m]."""
    return float((1 / ((points - view.position) @ view.axes[2])).mean())


def _worth(action: Action, view: View) -> float:
    """How large an action is seen, less what is hidden and what stands in front [1/m]."""
    free = max(0.0, 1 - CLUTTER * _covered(action, view))
    return _size(action.points, view) * (1 - hidden(action, view)) * free


def hidden(action: Action, view: View) -> float:
    """The mean share of robots and payloads that housings and the shed hide in a view."""
    screens = np.concatenate([action.housings, action.shed])
    (front, before), (back, behind) = outlines(view, screens), outlines(view, action.robots)
    of, by = shapely.STRtree(front).query(back, predicate="intersects")
    nearer = before[by].mean(axis=1) < behind[of].mean(axis=1)
    of, by = of[nearer], by[nearer]
    areas = shapely.area(back)
    shares = shapely.area(shapely.intersection(back[of], front[by])) / np.maximum(areas[of], 1e-12)
    taken = np.bincount(of, shares, len(back))
    return float(np.minimum(taken, 1.0).mean())


def _covered(action: Action, view: View) -> float:
    """The share of a picture that the shed takes where it stands before the middle of all."""
    frame = shapely.box(-view.wide, -view.tall, view.wide, view.tall)
    front, ahead = outlines(view, action.shed)
    nearer = ahead.mean(axis=1) < ((action.points - view.position) @ view.axes[2]).mean()
    taken = shapely.intersection(shapely.union_all(front[nearer]), frame)
    return float(shapely.area(taken) / shapely.area(frame))
