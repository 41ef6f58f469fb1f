"""The close-up view of one hand-over.

Its operation is the one that takes the label: the next in the product, or the dropoff. The camera
stands still, and sees the label as its carrier brings it there, with the hands of all robots that
hold something in that operation.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from factory.engine.mjcf import names
from factory.engine.mjcf.pads import Pads
from factory.engine.mjcf.replica import Geoms, Replica
from factory.engine.mjcf.weld_frames import held_at
from factory.engine.record.subject import MonitorSubject
from factory.film.action import box_of, is_stand, outlines, placed, shape_of
from factory.floor.geometry.sight import Framing, View, fit, towards
from factory.support.arrays import Array
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

ROOM = 1.3
"""What a label takes of the picture is so many times its size."""

ELEVATION = 6.0
"""How high the camera stands [degrees]: hands are below what they hold, and hardly stick out."""

AZIMUTH, STEP = -62.0, 15.0
"""From where it looks if all is equal, that of an overview, and what is between the directions that
are tried [degrees]."""


TOUCH = 1e-4
"""Penetration from which bodies count as touching [m]."""


def handover_view(
    replica: Replica, subject: MonitorSubject, label: str, framing: Framing
) -> tuple[Array, View]:
    """The subject of the hand-over of a label, as boxes (n, 8, 3) by their corners [m], and the
    view of it. The state of the replica is restored."""
    factory, before = subject.factory, replica.d.qpos.copy()
    made = factory.by_label[label]
    taking = factory.operations[factory.parents[made.index]]
    _gather(replica, subject, taking)
    load = _load(replica, subject, made)
    hands, arms = _hands(replica, subject, taking)
    stands, others = _stands(replica), _others(replica, subject, taking, made)
    replica.place(before)
    middle = load.mean(axis=0)
    reach = [hand + np.append(arm / 2, 0.0) for hand, arm in zip(hands, arms, strict=True)]
    points = np.concatenate([middle + ROOM * (load - middle), *hands, *reach])
    watched = np.array([load, *hands])
    tried = np.arange(AZIMUTH - 180.0, AZIMUTH + 180.0, STEP)
    views = [fit(points, towards(azimuth, ELEVATION), framing) for azimuth in tried]
    hidden = [_hidden(view, np.concatenate([stands, others]), load) for view in views]
    covered = [_covered(view, stands, middle) for view in views]
    seen = _along(tried, arms) - hidden - covered
    return watched, views[int(np.argmax(seen))]


def _gather(replica: Replica, subject: MonitorSubject, operation: Operation) -> None:
    """Put the robots of an operation at their goals, with lifts down."""
    m, qpos = replica.m, replica.d.qpos.copy()
    for robot in operation.robots:
        slide = m.joint(names.first_axis(subject.factory.robots[robot]))
        qpos[slide.qposadr[0]] = subject.goal(operation, robot)
    replica.place(qpos)


def _load(replica: Replica, subject: MonitorSubject, made: Operation) -> Array:
    """The corners (8, 3) of the box round a label in the hands of its carrier."""
    m, d = replica.m, replica.d
    robot, parts = subject.factory.robots[made.carrier].name, subject.factory.contents[made.label]
    wanted = {names.grip(robot, part) for part in parts}
    welds = np.array([e for e in range(m.neq) if m.equality(e).name in wanted], np.intp)
    at = held_at(m, welds, d.xpos, d.xmat)
    bodies = m.eq_obj2id[welds].tolist()
    return box_of(np.concatenate([p + shape_of(m, b) for p, b in zip(at, bodies, strict=True)]))


def _hands(
    replica: Replica, subject: MonitorSubject, operation: Operation
) -> tuple[list[Array], list[Array]]:
    """The corners (8, 3) of each pad of the robots that hold something in an operation, and the
    ways (2,), seen from above, from these to their carriages [m]."""
    m, d, pads = replica.m, replica.d, Pads(replica.m).of
    corners, arms = list[Array](), list[Array]()
    held = zip(operation.robots, operation.before, operation.after, strict=True)
    for name in (subject.factory.robots[r].name for r, *k in held if set(k) != {NOPART}):
        foot = m.body(names.carriage(name)).id
        for pad in (p for b, pads_of in pads.items() if m.body_rootid[b] == foot for p in pads_of):
            corners.append(placed(m, d, pad))
            arms.append((d.xpos[foot] - d.geom_xpos[pad])[:2])
    return corners, arms


def _along(tried: Array, arms: Sequence[Array]) -> Array:
    """How well arms are seen from directions [degrees], at most about 1: they should point neither
    to the camera nor away from it; rather away, and rather as an overview looks."""
    angles = np.radians(tried)
    towards_it = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    arms = [arm / max(float(np.linalg.norm(arm)), 1e-9) for arm in arms]
    along = np.stack([towards_it @ arm for arm in arms] or [np.zeros(len(tried))])
    seen = (np.sqrt(1 - np.minimum(along**2, 1.0)) - 0.2 * np.maximum(along, 0.0)).min(axis=0)
    return np.asarray(seen + 0.05 * np.cos(angles - np.radians(AZIMUTH)))


def _stands(replica: Replica) -> Array:
    """The boxes (n, 8, 3) round what stands still and does not fade: housings and the shed."""
    m, d = replica.m, replica.d
    bodies = [b for b in range(1, m.nbody) if names.kind(m.body(b).name) in ("feeder", "outfeed")]
    geoms = (g for b in bodies if m.body_weldid[b] == 0 for g in Geoms(m).shown(b))
    boxes = [placed(m, d, g) for g in geoms if not is_stand(m.geom(g).name)]
    return np.array(boxes).reshape(-1, 8, 3)


def _others(
    replica: Replica, subject: MonitorSubject, operation: Operation, made: Operation
) -> Array:
    """The boxes (n, 8, 3) round what else is brought to an operation, and the limbs of its
    robots."""
    m, d, factory = replica.m, replica.d, subject.factory
    loads = [
        _load(replica, subject, factory.by_label[label])
        for label in operation.before
        if label in factory.by_label and label != made.label
    ]
    feet = {m.body(names.carriage(factory.robots[r].name)).id for r in operation.robots}
    solid = np.isin(m.body_rootid[m.geom_bodyid], [*feet]) & (m.geom_contype > 0)
    limbs = [placed(m, d, g) for g in np.flatnonzero(solid).tolist()]
    return np.array([*loads, *limbs]).reshape(-1, 8, 3)


def _hidden(view: View, boxes: Array, load: Array) -> float:
    """The share of a box (8, 3) that others (n, 8, 3) hide in a view. All lie along the axes: one
    hides nothing of what it is apart from along an axis, where the camera is on the far side."""
    low, high = boxes.min(axis=1), boxes.max(axis=1)
    below, above = high <= load.min(axis=0) + TOUCH, low >= load.max(axis=0) - TOUCH
    behind = (below & (view.position >= high)) | (above & (view.position <= low))
    front = boxes[~behind.any(axis=1)]
    return _share(view, front, outlines(view, load[None])[0][0])


def _covered(view: View, stands: Array, middle: Array) -> float:
    """The share of a picture that boxes (n, 8, 3) take which are nearer than what is looked at."""
    ahead = (stands.mean(axis=1) - middle) @ view.axes[2]
    frame = shapely.box(-view.wide, -view.tall, view.wide, view.tall)
    return _share(view, stands[ahead < 0], frame)


def _share(view: View, boxes: Array, of: shapely.Geometry) -> float:
    """The share of an outline that boxes (n, 8, 3) are before."""
    taken = shapely.intersection(shapely.union_all(outlines(view, boxes)[0]), of)
    return float(shapely.area(taken) / max(float(shapely.area(of)), 1e-12))
