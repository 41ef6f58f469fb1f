"""The close-up view of one hand-over.

Its operation is the one that takes the label: the next in the product, or the dropoff. The camera
stands still, and sees the label as its carrier brings it there, with the hands of the robots that
hold something in that operation and what it is joined to, as far as the label stays large.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from factory.engine.mjcf import names
from factory.engine.mjcf.pads import Pads
from factory.engine.mjcf.replica import Geoms, Replica
from factory.engine.mjcf.weld_frames import held_at
from factory.engine.record.subject import MonitorSubject
from factory.film.action import box_of, is_stand, outlines, placed, shape_of
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.sight import Framing, View, fit, towards
from factory.support.rotations import rotation
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART

ROOM = 1.3
"""What a label takes of the picture is so many times its size."""

ZOOM = 4.5
"""A picture is at most about so many times as high as the label is large."""

ELEVATION = 35.0
"""How high the camera stands [degrees]: high enough to look on what is joined, and low enough to
see the hands below it."""

AZIMUTH, STEP = -62.0, 15.0
"""From where it looks if all is equal, that of an overview, and what is between the directions that
are tried [degrees]."""


OUTSIDE = 0.4
"""How much it counts to look from the side on which a label is joined."""

THERE = 0.6
"""A robot is in its place as far as a picture shows that is off it by such a share of half the
picture's height."""

TOUCH = 1e-4
"""Penetration from which bodies count as touching [m]."""


@dataclass(frozen=True, slots=True)
class Handover:
    """What a picture of a hand-over shows.

    Attributes:
        watched: the boxes (n, 8, 3) of the label and of the hands, by their corners [m].
        view: the camera.
        robots: the names of the robots that take part.
        merit: how well it is seen: the more, the less is hidden and the more from aside.
        foot: the carriage (body) of the robot that it is handed to.
        place: where that is then, seen from above (2,) [m].
    """

    watched: Array
    view: View
    robots: frozenset[str]
    merit: float
    foot: int
    place: Array

    def is_there(self, m: mujoco.MjModel, qpos: Array) -> bool:
        """Whether the carriage is in its place in a configuration (nq,), or about there."""
        off = float(np.linalg.norm(foot_at(m, qpos, self.foot) - self.place))
        return off < THERE * self.view.distance * self.view.tall


def foot_at(m: mujoco.MjModel, qpos: Array, foot: int) -> Array:
    """Where a carriage (body) is in a configuration (nq,), seen from above (2,) [m]."""
    first = int(m.body_jntadr[foot])
    at, frame = np.array(m.body_pos[foot]), rotation(m.body_quat[foot])
    for joint in range(first, first + int(m.body_jntnum[foot])):
        address = m.jnt_qposadr[joint]
        at += frame @ m.jnt_axis[joint] * (qpos[address] - m.qpos0[address])
    return at[:2]


def handover_of(
    replica: Replica, subject: MonitorSubject, label: str, framing: Framing
) -> Handover:
    """The hand-over of a label. The state of the replica is restored."""
    factory, before = subject.factory, replica.d.qpos.copy()
    made = factory.by_label[label]
    taking = factory.operations[factory.parents[made.index]]
    foot = replica.m.body(names.carriage(factory.robots[taking.carrier].name)).id
    _gather(replica, subject, taking)
    place = replica.d.xpos[foot][:2].copy()
    load = _load(replica, subject, made)
    hands, arms = _hands(replica, subject, taking)
    joined, limbs = _joined(replica, subject, taking, made), _limbs(replica, subject, taking)
    stands, others = _stands(replica), np.concatenate([joined, limbs])
    replica.place(before)
    middle = load.mean(axis=0)
    reach = [hand + np.append(arm / 2, 0.0) for hand, arm in zip(hands, arms, strict=True)]
    points = np.concatenate([middle + ROOM * (load - middle), *hands, *reach, *joined])
    limit = ZOOM / 2 * float(np.ptp(load, axis=0).max())
    if np.abs(points - middle).max() > limit:
        points = middle + limit * np.concatenate([np.eye(3), -np.eye(3)])
    watched = np.array([load, *hands])
    tried = np.arange(AZIMUTH - 180.0, AZIMUTH + 180.0, STEP)
    views = [fit(points, towards(azimuth, ELEVATION), framing) for azimuth in tried]
    hidden = [_hidden(view, np.concatenate([stands, others]), load) for view in views]
    covered = [_covered(view, stands, middle) for view in views]
    seen = _along(tried, arms) + OUTSIDE * _outwards(tried, load, joined) - hidden - covered
    best = int(np.argmax(seen))
    view, merit = views[best], float(seen[best])
    robots = frozenset(factory.robots[robot].name for robot in taking.robots)
    return Handover(watched, replace(view, depth=view.distance), robots, merit, foot, place)


def _gather(replica: Replica, subject: MonitorSubject, operation: Operation) -> None:
    """Put the robots of an operation at their goals, with lifts down as at the start."""
    m, qpos = replica.m, replica.m.qpos0.copy()
    for robot in operation.robots:
        of, goal, chains = (
            subject.factory.robots[robot],
            subject.goal(operation, robot),
            subject.chains,
        )
        if of.body.first.moves and chains is not None:
            row = np.array([chains.row(operation.index, robot)])
            joints = [m.joint(joint).qposadr[0] for joint, _ in names.moved_along(of)]
            qpos[joints] = chains.curves.at(row, np.array([goal]))[0][0]
        else:
            qpos[m.joint(names.first_axis(of)).qposadr[0]] = goal
    replica.place(qpos)


def _load(replica: Replica, subject: MonitorSubject, made: Operation) -> Array:
    """The corners (8, 3) of the box round a label in the hands of its carrier."""
    m, d, contents = replica.m, replica.d, subject.factory.contents
    robot, inside = subject.factory.robots[made.carrier].name, {*contents[made.label]}
    bodies = [body for body, parts in contents.items() if inside.issuperset(parts)]
    wanted = {names.grip(robot, body) for body in bodies}
    welds = np.array([e for e in range(m.neq) if m.equality(e).name in wanted], np.intp)
    at = held_at(m, welds, d.xpos, d.xmat)
    held = m.eq_obj2id[welds].tolist()
    return box_of(np.concatenate([p + shape_of(m, b) for p, b in zip(at, held, strict=True)]))


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
    """The boxes (n, 8, 3) round what does not fade: housings, and the shed with its shutter."""
    m, d = replica.m, replica.d
    called = {b: m.body(b).name for b in range(1, m.nbody)}
    bodies = [b for b, name in called.items() if names.kind(name) in ("feeder", "outfeed")]
    still = (b for b in bodies if m.body_weldid[b] == 0 or called[b] == names.SHUTTER)
    geoms = (g for b in still for g in Geoms(m).shown(b))
    boxes = [placed(m, d, g) for g in geoms if not is_stand(m.geom(g).name)]
    return np.array(boxes).reshape(-1, 8, 3)


def _joined(
    replica: Replica, subject: MonitorSubject, operation: Operation, made: Operation
) -> Array:
    """The boxes (n, 8, 3) round what else is brought to an operation."""
    by_label = subject.factory.by_label
    labels = [x for x in operation.before if x in by_label and x != made.label]
    loads = [_load(replica, subject, by_label[label]) for label in labels]
    return np.array(loads).reshape(-1, 8, 3)


def _limbs(replica: Replica, subject: MonitorSubject, operation: Operation) -> Array:
    """The boxes (n, 8, 3) round the limbs of an operation's robots."""
    m, d, robots = replica.m, replica.d, subject.factory.robots
    feet = {m.body(names.carriage(robots[r].name)).id for r in operation.robots}
    solid = np.isin(m.body_rootid[m.geom_bodyid], [*feet]) & (m.geom_contype > 0)
    limbs = [placed(m, d, g) for g in np.flatnonzero(solid).tolist()]
    return np.array(limbs).reshape(-1, 8, 3)


def _outwards(tried: Array, load: Array, joined: Array) -> Array:
    """How far, from -1 to 1, a box (8, 3) lies to the side of directions [degrees] of the others
    (n, 8, 3) that it is joined to."""
    if not len(joined):
        return np.zeros(len(tried))
    whole = joined.reshape(-1, 3)
    half = np.maximum(np.ptp(whole, axis=0), 1e-9) / 2
    off = (load.mean(axis=0) - whole.min(axis=0) - half) / half
    x, y = np.clip(off[:2], -1.0, 1.0)
    angles = np.radians(tried)
    return np.asarray((x * np.cos(angles) + y * np.sin(angles)) / 2**0.5)


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
