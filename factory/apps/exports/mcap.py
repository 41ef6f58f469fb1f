"""MCAP of a log for Foxglove and Rerun, with Foxglove's Protobuf schemas: `/tf` poses of
the bodies, `/scene` their shapes, `/events` the transitions that fired.

Frames are named as the links of the URDF, and have the same parents.
"""

from __future__ import annotations

import io
from collections import deque
from typing import Any

import numpy as np

from factory.apps.exports.csv import EventRow, rows
from factory.apps.exports.motion import BodyMotion, motion_of
from factory.apps.exports.subject import Subject
from factory.apps.log import Log
from factory.support.arrays import Array, Truth
from factory.support.version import optional

FORMAT, TAKES, BINARY = "mcap", "log", True


def export(subject: Subject) -> bytes:
    """The whole log. Raises MissingError where there is no foxglove-sdk."""
    foxglove = optional("foxglove", "foxglove-sdk", "MCAP", "export")
    motion = motion_of(subject.log)
    events = list(rows(subject.log))
    content = io.BytesIO()
    context = foxglove.Context()
    options = foxglove.mcap.MCAPWriteOptions(compression_threads=0)
    with foxglove.open_mcap(content, context=context, writer_options=options):
        _Recorder(context, motion, subject.log).record(events)
    return content.getvalue()


class _Recorder:
    """Writes a motion and events to the channels of a context, in the order of time."""

    def __init__(self, context: Any, motion: BodyMotion, log: Log) -> None:
        channels = optional("foxglove.channels", "foxglove-sdk", "MCAP", "export")
        self.messages = optional("foxglove.messages", "foxglove-sdk", "MCAP", "export")
        self.motion, self.log, self.m = motion, log, motion.m
        self.tf = channels.FrameTransformsChannel("/tf", context=context)
        self.scene = channels.SceneUpdateChannel("/scene", context=context)
        self.events = channels.LogChannel("/events", context=context)

    def record(self, events: list[EventRow]) -> None:
        """Everything."""
        unseen, coming = self.motion.unseen(), deque(events)
        before = np.ones(unseen.shape[1], bool)
        for frame, bodies in enumerate(self.motion.shown()):
            time = float(self.log.time[self.motion.rows[frame]])
            while coming and coming[0].time_s <= time:
                self._event(coming.popleft())
            self._scene(time, before, unseen[frame])
            before = unseen[frame]
            self._transforms(time, frame, bodies)
        for late in coming:
            self._event(late)

    def _transforms(self, time: float, frame: int, bodies: list[int]) -> None:
        transforms = [
            self.messages.FrameTransform(
                timestamp=self._stamp(time),
                parent_frame_id=self.motion.parent(body),
                child_frame_id=self.motion.name(body),
                translation=self._vector(self.motion.position[frame, body]),
                rotation=self._quaternion(self.motion.quaternion[frame, body]),
            )
            for body in bodies
        ]
        if transforms:
            message = self.messages.FrameTransforms(transforms=transforms)
            self.tf.log(message, log_time=_nanoseconds(time))

    def _scene(self, time: float, before: Truth, now: Truth) -> None:
        """Add the bodies that have come into sight, delete those that have gone out of it."""
        stamp, entities = {"timestamp": self._stamp(time)}, []
        for body in np.flatnonzero(before & ~now).tolist():
            shapes, name = self._shapes(body), self.motion.name(body)
            if any(shapes.values()):
                frame = {"frame_id": name, "id": name, "frame_locked": True}
                entities.append(self.messages.SceneEntity(**stamp, **frame, **shapes))
        deletions = [
            self.messages.SceneEntityDeletion(**stamp, id=self.motion.name(int(body)))
            for body in np.flatnonzero(now & ~before)
        ]
        if entities or deletions:
            message = self.messages.SceneUpdate(deletions=deletions, entities=entities)
            self.scene.log(message, log_time=_nanoseconds(time))

    def _event(self, event: EventRow) -> None:
        what = f"{event.template}({event.operation}) {event.kind}, unit {event.unit}"
        message = self.messages.Log(
            timestamp=self._stamp(event.time_s),
            level=self.messages.LogLevel.Info,
            name=event.transition,
            message=f"{what}: {' '.join(event.robots)}",
            file=event.file,
            line=event.line,
        )
        self.events.log(message, log_time=_nanoseconds(event.time_s))

    def _shapes(self, body: int) -> dict[str, list[Any]]:
        """Foxglove's primitives of a body by the field of the entity that they belong to."""
        from factory.api import Geoms
        from factory.apps.exports.geoms import half_sizes
        from factory.support.engine import mujoco

        m, kinds, messages = self.m, mujoco.mjtGeom, self.messages
        shapes = {name: list[Any]() for name in ("cubes", "cylinders", "spheres", "triangles")}
        for geom in Geoms(m).shown(body):
            red, green, blue, alpha = (round(float(c), 4) for c in Geoms(m).colour(geom))
            at, turn = self._vector(m.geom_pos[geom]), self._quaternion(m.geom_quat[geom])
            pose = messages.Pose(position=at, orientation=turn)
            look = {"pose": pose, "color": messages.Color(r=red, g=green, b=blue, a=alpha)}
            kind, size = m.geom_type[geom], 2 * m.geom_size[geom]
            if kind == kinds.mjGEOM_MESH:
                vertices, faces = Geoms(m).mesh(geom)
                points = [messages.Point3(x=x, y=y, z=z) for x, y, z in vertices.tolist()]
                look |= {"points": points, "indices": faces.ravel().tolist()}
                shapes["triangles"].append(messages.TriangleListPrimitive(**look))
            elif kind == kinds.mjGEOM_SPHERE:
                look["size"] = self._vector(size[[0, 0, 0]])
                shapes["spheres"].append(messages.SpherePrimitive(**look))
            elif kind == kinds.mjGEOM_CYLINDER:
                look |= {"size": self._vector(size[[0, 0, 1]])}
                look |= {"bottom_scale": 1.0, "top_scale": 1.0}
                shapes["cylinders"].append(messages.CylinderPrimitive(**look))
            else:
                look["size"] = self._vector(2 * half_sizes(m, geom))
                shapes["cubes"].append(messages.CubePrimitive(**look))
        return shapes

    def _vector(self, at: Array) -> Any:
        x, y, z = at.tolist()
        return self.messages.Vector3(x=x, y=y, z=z)

    def _quaternion(self, turn: Array) -> Any:
        w, x, y, z = turn.tolist()
        return self.messages.Quaternion(x=x, y=y, z=z, w=w)

    def _stamp(self, time: float) -> Any:
        seconds, rest = divmod(_nanoseconds(time), 10**9)
        return self.messages.Timestamp(seconds, rest)


def _nanoseconds(time: float) -> int:
    return round(time * 1e9)
