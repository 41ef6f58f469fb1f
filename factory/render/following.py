"""Which product a camera follows, and where it is.

Bodies never turn and have their places in the finished product, so any body that has become part
of a product tells where that product's frame is; and it stays the same frame when parts that are
joined for good become one body.
"""

from __future__ import annotations

import numpy as np

from factory.mjcf import names
from factory.record.monitor.subject import MonitorSubject
from factory.render.camera import Array
from factory.render.subject import SIGNS, Snapshot, corners
from factory.support.engine import mujoco

NEAR = 0.02
"""A body in the place of one that is gone is the same product where it is no further [m]."""


class Followed:
    """The product furthest on its way or, with a `part`, that which a copy of this part is in from
    its feeder to the dropoff, one copy after the other.

    A product is known by one of its parts, by itself that which the most robots carry.
    """

    def __init__(self, m: mujoco.MjModel, subject: MonitorSubject, part: str = "") -> None:
        self.part, self.places = part, subject.places
        self.kinds = [m.equality(e).name for e in range(m.neq)]
        factory, contents = subject.factory, subject.factory.contents
        carried = {
            robot.name: contents.get(factory.delivered(robot.index), ()) for robot in factory.robots
        }
        handled = [label for parts in carried.values() for label in parts]
        self.label = part or max(dict.fromkeys(handled), key=handled.count)
        parts = {robot: len(labels) for robot, labels in carried.items()}
        self.rank = {e: _rank(name, parts) for e, name in enumerate(self.kinds)}
        bodies = {m.body(b).name: b for b in range(m.nbody)}
        self.labels = {
            b: names.label_of(name) for name, b in bodies.items() if names.kind(name) == "part"
        }
        self.copies = [b for b, label in self.labels.items() if self.label in contents[label]]
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
        """Where the frame of the product is that a body belongs to (3,) [m]."""
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
        product that nobody holds any more is left when another copy is on its way."""
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
