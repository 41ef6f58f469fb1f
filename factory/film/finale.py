"""The end of a film: the finished product alone on the floor, on a turntable, with its name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.replica import SHOWN, Replica
from factory.film.action import Snapshot, placed
from factory.film.camerawork import Camerawork, Moment, Take
from factory.film.caption import draw_title
from factory.film.ink import Pixels
from factory.film.picture import orbit
from factory.floor.geometry.sight import Framing
from factory.support.arrays import Array
from factory.support.engine import mujoco
from factory.theory.lang.source import counted

LASTS = 2.0
"""How long a finished product is shown [s]."""

TURN = 45.0
"""How fast it turns [degrees/s]."""

MARGINS = 0.16
"""Free at each edge of the picture, as a fraction of its height."""


def finale(take: Take, whole: Moment, last: Moment, fps: float) -> Iterator[Pixels]:
    """The pictures of the product that was `whole` at a moment, for a film that has come to its
    `last`."""
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
        painter.viewpoint.goes = orbit(points, framing, TURN)
        title = take.picture.title or take.product
        made = f"{last.made} of {counted(take.units, 'unit')}, {counted(_parts(take), 'part')} each"
        for frame in range(round(LASTS * fps)):
            pixels = painter.paint(shown, time=frame / fps)
            draw_title(pixels, title, made, 0.0)
            yield pixels


def _parts(take: Take) -> int:
    """Number of parts of a product."""
    factory = take.subject.factory
    return len(factory.contents[next(iter(factory.products))])


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
