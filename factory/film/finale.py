"""The end of a film: the finished product alone on the floor, on a turntable, with its name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.film.action import Snapshot, placed
from factory.film.camerawork import Camerawork, Moment, Take
from factory.film.caption import draw_title
from factory.film.picture import orbit
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.support.pictures.ink import Pixels
from factory.support.pictures.sight import Framing, View
from factory.support.texts import counted

LASTS = 2.0
"""How long a finished product is shown [s]."""

TURN = 45.0
"""How fast it turns [degrees/s]."""

MARGINS = 0.16
"""Free at each edge of the picture, as a fraction of its height."""


class Turntable:
    """The viewpoint of what turns: it is seen from all sides in turn.

    Args:
        points: its corners (n, 3) [m].
        framing: the usable area of the picture.
    """

    concerned = None

    def __init__(self, points: Array, framing: Framing) -> None:
        self.watched, self.goes = points.reshape(-1, 8, 3), orbit(points, framing, TURN)

    def view(self, shown: Snapshot, elapsed: float, time: float) -> View:
        """The view at a time [s]."""
        return self.goes(time)


def finale(
    take: Take, whole: Moment, last: Moment, fps: float, contacts: int | None
) -> Iterator[Pixels]:
    """The pictures of the product that was `whole` at a moment, for a film that has come to its
    `last` moment with so many unintended contacts, None where that is not known."""
    size = take.picture.size
    alone = replace(take, picture=replace(take.picture, camera="overview", panels=()))
    with Camerawork(alone) as work:
        painter, replica = work.painter, work.painter.replica
        bodies = _product(replica.m, whole.shown)
        if not bodies:
            return
        shown, points = _on_the_floor(replica, whole.shown, bodies)
        _leave_only(replica.m, bodies)
        framing = Framing(size[0] / size[1], MARGINS, MARGINS, MARGINS)
        painter.viewpoint = Turntable(points, framing)
        title = take.picture.title or take.product
        parts = _parts(take, [replica.m.body(body).name for body in bodies])
        said = [f"{last.made} of {counted(take.units, 'unit')}", f"{counted(parts, 'part')} each"]
        said += [] if contacts is None else [counted(contacts, "unintended contact")]
        for frame in range(round(LASTS * fps)):
            pixels = painter.paint(shown, time=frame / fps)
            draw_title(pixels, title, ", ".join(said), 0.0)
            yield pixels


def _parts(take: Take, bodies: Iterable[str]) -> int:
    """Number of parts of the product that bodies, by name, make up."""
    contents = take.subject.factory.contents
    return sum(len(contents[names.label_of(body)]) for body in bodies)


def _product(m: mujoco.MjModel, shown: Snapshot) -> set[int]:
    """The bodies that the output robot, the first, holds."""
    grip = names.grip("r1", "")
    held = zip(shown.active.tolist(), shown.body2.tolist(), strict=True)
    return {body for e, body in held if m.equality(e).name.startswith(grip)}


def _on_the_floor(replica: Replica, shown: Snapshot, bodies: set[int]) -> tuple[Snapshot, Array]:
    """A state in which bodies stand on the floor, and the corners (n, 3) of the boxes around their
    geoms [m]."""
    m, d = replica.m, replica.d
    replica.place(shown.qpos)
    geoms = [g for g in range(m.ngeom) if _owner(m, g) in bodies]
    points = np.concatenate([placed(m, d, g) for g in geoms])
    low, qpos = float(points[:, 2].min()), shown.qpos.copy()
    for body in bodies:
        qpos[m.jnt_qposadr[m.body_jntadr[body]] + 2] -= low
    return replace(shown, qpos=qpos), points - np.array([0.0, 0.0, low])


def _owner(m: mujoco.MjModel, geom: int) -> int:
    """The free body that a geom is of."""
    return int(m.body_rootid[m.geom_bodyid[geom]])


def _leave_only(m: mujoco.MjModel, bodies: set[int]) -> None:
    """Leave out all but some bodies and the floor."""
    for g in range(m.ngeom):
        if m.geom_type[g] != mujoco.mjtGeom.mjGEOM_PLANE and _owner(m, g) not in bodies:
            m.geom_group[g] = SHOWN
