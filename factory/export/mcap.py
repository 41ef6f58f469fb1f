"""MCAP of a log for Foxglove and Rerun, with Foxglove's Protobuf schemas: `/tf` where each body is,
`/scene` what it looks like, `/joints` the robots' positions and speeds, `/events` what fired.

Frames and joints are named as the links and joints of the URDF, and have the same parents.
"""

from __future__ import annotations

import io
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from factory.control.mode import Truth
from factory.export.events import EventRow, rows
from factory.export.motion import BodyMotion, motion_of
from factory.export.subject import Subject
from factory.geometry.meshes import Array
from factory.record.log import Log
from factory.support.extras import optional

if TYPE_CHECKING:
    from factory.support.engine import mujoco

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
        self.channels = optional("foxglove.channels", "foxglove-sdk", "MCAP", "export")
        self.schemas = optional("foxglove.messages", "foxglove-sdk", "MCAP", "export")
        self.motion, self.log = motion, log
        self.looks = Looks(motion.m, self.schemas)
        self.tf = self.channels.FrameTransformsChannel("/tf", context=context)
        self.scene = self.channels.SceneUpdateChannel("/scene", context=context)
        self.joints = self.channels.JointStatesChannel("/joints", context=context)
        self.events = self.channels.LogChannel("/events", context=context)

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
            self._joints(time, int(self.motion.rows[frame]))
        for late in coming:
            self._event(late)

    def _transforms(self, time: float, frame: int, bodies: list[int]) -> None:
        found = []
        for body in bodies:
            x, y, z = self.motion.position[frame, body].tolist()
            w, i, j, k = self.motion.quaternion[frame, body].tolist()
            found.append(
                self.schemas.FrameTransform(
                    timestamp=self._stamp(time),
                    parent_frame_id=self.motion.parent(body),
                    child_frame_id=self.motion.name(body),
                    translation=self.schemas.Vector3(x=x, y=y, z=z),
                    rotation=self.schemas.Quaternion(x=i, y=j, z=k, w=w),
                )
            )
        if found:
            message = self.schemas.FrameTransforms(transforms=found)
            self.tf.log(message, log_time=_nanoseconds(time))

    def _scene(self, time: float, before: Truth, now: Truth) -> None:
        """What has come into sight is added, what has gone out of it deleted."""
        entities = []
        for body in np.flatnonzero(before & ~now).tolist():
            shapes = self.looks.of(body)
            if any(shapes.values()):
                name = self.motion.name(body)
                frame = {"timestamp": self._stamp(time), "frame_id": name, "id": name}
                entities.append(self.schemas.SceneEntity(**frame, frame_locked=True, **shapes))
        deletions = [
            self.schemas.SceneEntityDeletion(
                timestamp=self._stamp(time), id=self.motion.name(int(body))
            )
            for body in np.flatnonzero(now & ~before)
        ]
        if entities or deletions:
            message = self.schemas.SceneUpdate(deletions=deletions, entities=entities)
            self.scene.log(message, log_time=_nanoseconds(time))

    def _joints(self, time: float, row: int) -> None:
        from factory.support.engine import mujoco

        m, found = self.motion.m, []
        for joint in range(m.njnt):
            if m.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
                position = float(self.log.qpos[row][m.jnt_qposadr[joint]])
                speed = float(self.log.qvel[row][m.jnt_dofadr[joint]])
                name = m.joint(joint).name
                state = self.schemas.JointState(name=name, position=position, velocity=speed)
                found.append(state)
        message = self.schemas.JointStates(timestamp=self._stamp(time), joints=found)
        self.joints.log(message, log_time=_nanoseconds(time))

    def _event(self, event: EventRow) -> None:
        what = f"{event.template}({event.operation}) {event.kind}, unit {event.unit}"
        message = self.schemas.Log(
            timestamp=self._stamp(event.time_s),
            level=self.schemas.LogLevel.Info,
            name=event.transition,
            message=f"{what}: {' '.join(event.robots)}",
            file=event.file,
            line=event.line,
        )
        self.events.log(message, log_time=_nanoseconds(event.time_s))

    def _stamp(self, time: float) -> Any:
        seconds, rest = divmod(_nanoseconds(time), 10**9)
        return self.schemas.Timestamp(seconds, rest)


class Looks:
    """What the bodies of a model look like, in Foxglove's primitives."""

    def __init__(self, m: mujoco.MjModel, schemas: Any) -> None:
        self.m, self.schemas = m, schemas

    def of(self, body: int) -> dict[str, list[Any]]:
        """The primitives of a body by the field of the entity that they belong to."""
        from factory.mjcf.replica import half_sizes, paint, shown
        from factory.support.engine import mujoco

        found: dict[str, list[Any]] = {"cubes": [], "cylinders": [], "spheres": [], "triangles": []}
        for geom in shown(self.m, body):
            red, green, blue, alpha = (round(float(c), 4) for c in paint(self.m, geom))
            look = {
                "pose": self._pose(geom),
                "color": self.schemas.Color(r=red, g=green, b=blue, a=alpha),
            }
            kind, size = mujoco.mjtGeom(self.m.geom_type[geom]), self.m.geom_size[geom]
            if kind == mujoco.mjtGeom.mjGEOM_MESH:
                found["triangles"].append(self._triangles(geom, look))
            elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
                ball = self._vector(size[[0, 0, 0]])
                found["spheres"].append(self.schemas.SpherePrimitive(size=ball, **look))
            elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
                ends = {"bottom_scale": 1.0, "top_scale": 1.0}
                whole = self._vector(size[[0, 0, 1]])
                found["cylinders"].append(
                    self.schemas.CylinderPrimitive(size=whole, **ends, **look)
                )
            else:
                cube = self._vector(half_sizes(self.m, geom))
                found["cubes"].append(self.schemas.CubePrimitive(size=cube, **look))
        return found

    def _triangles(self, geom: int, look: dict[str, Any]) -> Any:
        from factory.mjcf.replica import mesh_of

        vertices, faces = mesh_of(self.m, geom)
        points = [self.schemas.Point3(x=x, y=y, z=z) for x, y, z in vertices.tolist()]
        indices = faces.ravel().tolist()
        return self.schemas.TriangleListPrimitive(points=points, indices=indices, **look)

    def _pose(self, geom: int) -> Any:
        x, y, z = self.m.geom_pos[geom].tolist()
        w, i, j, k = self.m.geom_quat[geom].tolist()
        return self.schemas.Pose(
            position=self.schemas.Vector3(x=x, y=y, z=z),
            orientation=self.schemas.Quaternion(x=i, y=j, z=k, w=w),
        )

    def _vector(self, half: Array) -> Any:
        """Full lengths from half lengths."""
        x, y, z = (2 * np.asarray(half, float)).tolist()
        return self.schemas.Vector3(x=x, y=y, z=z)


def _nanoseconds(time: float) -> int:
    return round(time * 1e9)
