"""Where the camera stands, moment by moment, and which product it follows.

Bodies never turn and have their places in the finished product, so any body that has become part
of a product tells where that product's frame is; and it stays the same frame when parts that are
joined for good become one body.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Protocol

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import Replica
from factory.engine.record.subject import MonitorSubject
from factory.film.action import SIGNS, Action, Snapshot, action_of, corners
from factory.film.hero import clear_the_way, free_side
from factory.film.junction import Handover, handover_of
from factory.film.picture import HANDOVER, PART, Camera, from_above, orbit
from factory.film.vantage import overview
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.sight import Framing, View, fit, towards

LAG = 0.25
"""Time in which the camera goes from one product to the next [s]."""

NEAR = 0.02
"""A body in the place of one that is gone is the same product where it is no further [m]."""


class Lookout(Protocol):
    """Where the camera of consecutive pictures stands.

    Attributes:
        watched: boxes (n, 8, 3) around the subject of the last view, by their corners [m].
        concerned: the names of the robots that a hand-over concerns; None for all robots.
    """

    @property
    def watched(self) -> Array: ...
    @property
    def concerned(self) -> frozenset[str] | None: ...
    def view(self, shown: Snapshot, elapsed: float, time: float) -> View:
        """The view at a time, `elapsed` [s] after the last, of the replica's state."""
        ...


class Viewpoint:
    """The camera in consecutive pictures of a replica. Cameras that follow a product need the
    factory. A `still` of a product has nothing in its way. `watched` (n, 8, 3): boxes around the
    subject of the last view, by their corners [m]."""

    def __init__(
        self,
        replica: Replica,
        camera: Camera,
        framing: Framing,
        subject: MonitorSubject,
        still: bool = False,
    ) -> None:
        self.replica, self.d, self.framing = replica, replica.d, framing
        self.is_hero = still and camera == "product"
        action = action_of(replica.m, replica.d)
        self.watched: Array = action.robots
        self.points = action.points
        self.handover: Handover | None = None
        if camera.startswith(HANDOVER):
            label = camera.removeprefix(HANDOVER)
            near = self.handover = handover_of(replica, subject, label, framing)
            self.watched = near.watched
            self.goes: Callable[[float], View] = lambda time: near.view
        else:
            self.goes = _standing(camera, action, framing)
        self.followed: Followed | None = None
        if camera == "product" or camera.startswith(PART):
            part = camera.removeprefix(PART) if ":" in camera else ""
            self.followed = Followed(replica.m, subject, part)
        self.wanted: Array | None = None
        self.body = -1
        self.away, self.glide = np.zeros(3), np.zeros(3)

    @property
    def concerned(self) -> frozenset[str] | None:
        """The names of the robots that a hand-over concerns; None for all robots."""
        return self.handover.robots if self.handover else None

    def view(self, shown: Snapshot, elapsed: float, time: float) -> View:
        """The view at a time, `elapsed` [s] after the last, of the replica's state."""
        if self.followed is not None:
            return self._following(self.followed, shown, elapsed)
        return self.goes(time)

    def _following(self, followed: Followed, shown: Snapshot, elapsed: float) -> View:
        """From an even distance; after a change of body the way still to go glides to 0, by a
        critically damped spring."""
        wanted, body = self._wanted(followed, shown)
        if elapsed <= 0.0 or self.wanted is None:
            self.away, self.glide = np.zeros(3), np.zeros(3)
        else:
            if body != self.body:
                self.away = self.away + self.wanted - wanted
            decay, push = np.exp(-elapsed / LAG), (self.glide + self.away / LAG) * elapsed
            self.away = (self.away + push) * decay
            self.glide = (self.glide - push / LAG) * decay
        self.wanted, self.body = wanted, body
        middle = followed.box.mean(axis=0)
        about = middle + 1.45 * (followed.box - middle)
        box = wanted + self.away + followed.box
        self.watched = (box[:, None] + box) / 2  # each eighth: the least of it is to be seen
        if self.is_hero:
            clear_the_way(self.replica, shown)
            return free_side(self.replica, wanted + about, box, self.framing)
        return fit(wanted + self.away + about, towards(-122.0, 44.0), self.framing)

    def _wanted(self, followed: Followed, shown: Snapshot) -> tuple[Array, int]:
        """Where the camera should look, and the body it follows there. A product that no robot
        holds any more is let go: the camera stays until it is gone."""
        furthest = followed.furthest(self.d, shown)
        if furthest is None:
            return (self.points.mean(axis=0) if self.wanted is None else self.wanted), self.body
        body, rank = furthest
        if rank == np.inf and body == self.body and self.wanted is not None:
            return self.wanted, body
        return followed.origin(self.d, body), body


def _standing(camera: Camera, action: Action, framing: Framing) -> Callable[[float], View]:
    """The view at each time [s] of a camera that follows no product."""
    if camera == "orbit":
        return orbit(action.points, framing)
    view = from_above(action.points, framing) if camera == "top" else overview(action, framing)
    return lambda time: view


class Followed:
    """The product furthest on its way or, with a `part`, that which a copy of this part is in from
    its feeder to the dropoff, one copy after the other.

    A product is known by one of its parts, by itself that which the most robots carry; each unit of
    a period by one of its own.
    """

    def __init__(self, m: mujoco.MjModel, subject: MonitorSubject, part: str = "") -> None:
        self.part, self.places = part, subject.places
        self.kinds = [m.equality(e).name for e in range(m.neq)]
        factory, contents = subject.factory, subject.factory.contents
        carried = {
            robot.name: [x for label in factory.deliveries(robot.index) for x in contents[label]]
            for robot in factory.robots
        }
        handled = [label for parts in carried.values() for label in parts]
        most, unlike = Counter(handled), dict.fromkeys(handled)
        inside = [{part}] if part else [{*contents[product]} for product in factory.products]
        followed = {
            max((x for x in unlike if x in parts), key=most.__getitem__) for parts in inside
        }
        parts = {robot: len(labels) for robot, labels in carried.items()}
        self.rank = {e: _rank(name, parts) for e, name in enumerate(self.kinds)}
        bodies = {m.body(b).name: b for b in range(m.nbody)}
        self.labels = {
            b: names.label_of(name) for name, b in bodies.items() if names.kind(name) == "part"
        }
        self.copies = [b for b, label in self.labels.items() if followed & {*contents[label]}]
        self.box = self._box(m, {b for b, label in self.labels.items() if label in handled})
        self.last: tuple[int, Array] | None = None

    def _box(self, m: mujoco.MjModel, parts: set[int]) -> Array:
        """The corners (8, 3) of the finished product's box, in its own frame."""
        points = []
        for g in range(m.ngeom):
            body = int(m.geom_bodyid[g])
            if body not in parts or not m.body(body).name.endswith("#1"):
                continue
            turn = np.empty(9)
            mujoco.mju_quat2Mat(turn, m.geom_quat[g])
            place = m.geom_pos[g] + np.array(self.places[self.labels[body]])
            points.append(corners(m, g) @ turn.reshape(3, 3).T + place)
        if not points:
            return 0.1 * SIGNS
        every = np.concatenate(points)
        low, high = every.min(axis=0), every.max(axis=0)
        return np.asarray((low + high) / 2 + SIGNS * (high - low) / 2)

    def origin(self, d: mujoco.MjData, body: int) -> Array:
        """Origin of the frame of the product that a body belongs to (3,) [m]."""
        return np.asarray(d.xpos[body] - np.array(self.places[self.labels[body]]))

    def furthest(self, d: mujoco.MjData, shown: Snapshot) -> tuple[int, float] | None:
        """The body with the followed part in the product that is followed, and how far it is:
        infinitely where no robot holds it any more. None if no copy is in the factory."""
        rank = dict.fromkeys(self.copies, np.inf)
        for e, body in zip(shown.active.tolist(), shown.body2.tolist(), strict=True):
            if body in rank:
                rank[body] = min(rank[body], self.rank[e])
        seen = {b: rank[b] for b in self.copies if rank[b] >= 0 and d.xpos[b, 2] > 0}
        body = self._same(d, seen) if self.part else max(seen, key=lambda b: seen[b], default=None)
        self.last = None if body is None else (body, self.origin(d, body))
        return None if body is None else (body, seen[body])

    def _same(self, d: mujoco.MjData, seen: dict[int, float]) -> int | None:
        """The body that has been followed, or has taken its place; else one that has just come. A
        product that no robot holds any more is left when another copy is on its way."""
        fresh = min(seen, key=lambda b: seen[b], default=None)
        if self.last is None or fresh is None:
            return fresh
        body, origin = self.last
        if body not in seen:
            near = (b for b in seen if np.linalg.norm(self.origin(d, b) - origin) < NEAR)
            body = next(near, fresh)
        return fresh if seen[body] == np.inf and seen[fresh] < np.inf else body


def _rank(name: str, parts: dict[str, int]) -> float:
    """How far a body is that this constraint holds: parked, at its feeder, with a robot that
    carries so many parts."""
    kind, _, rest = name.partition("/")
    if kind == "grip":
        return float(parts[rest.partition("/")[0]])
    return {"park": -1.0, "feed": 0.0}.get(kind, np.inf)
