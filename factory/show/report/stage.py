"""What there is to be drawn of a factory in the engine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from factory.mjcf import names
from factory.mjcf.replica import Floats, Replica
from factory.mjcf.robots import ROLES
from factory.plant.factory import Factory, Operation
from factory.support.engine import mujoco


@dataclass(frozen=True)
class DrawnFactory:
    """A factory and the engine's model `m` of it. `position` (bodies, 3) [m] and `quaternion`
    (bodies, 4) of each body at the start, of one that has a parent relative to that or, of a run
    that is not over, to the world; `reach` (2, bodies, 3): the least and the greatest position;
    `places`: where the body of each part is in the finished product [m]; `stations`: where the
    payload is held as operations of several robots end (x, y) [m], each with the labels they make.
    """

    factory: Factory
    m: mujoco.MjModel = field(repr=False)
    position: Floats = field(repr=False)
    quaternion: Floats = field(repr=False)
    reach: Floats = field(repr=False)
    places: Mapping[str, Iterable[float]] = field(repr=False)
    stations: Mapping[tuple[float, float], list[str]] = field(repr=False)

    @cached_property
    def roles(self) -> tuple[str, ...]:
        """What each robot is for, as its paint shows: output, carrier, fed or tool, else shared."""
        m = self.m
        paints = {i: m.mat(i).name.removeprefix("role/") for i in range(m.nmat)}
        found = []
        for robot in self.factory.robots:
            body = m.body(names.carriage(robot.name))
            first = int(body.geomadr[0])
            worn = (int(m.geom_matid[g]) for g in range(first, first + int(body.geomnum[0])))
            roles = (paints[paint] for paint in worn if paints.get(paint) in ROLES)
            found.append(next(roles, "shared"))
        return tuple(found)


def stations(
    factory: Factory, m: mujoco.MjModel, ends: Iterable[tuple[Operation, Floats]]
) -> dict[tuple[float, float], list[str]]:
    """The stations of operations, each with the state of the engine (nq,) as it ends."""
    replica = Replica(m)
    found: dict[tuple[float, float], list[str]] = {}
    for operation, qpos in ends:
        nest = f"{factory.robots[operation.carrier].name}/nest"
        if len(operation.robots) < 2 or not _has_site(m, nest):
            continue
        replica.place(qpos)
        x, y = (round(float(v), 3) for v in replica.d.site_xpos[m.site(nest).id][:2])
        found.setdefault((x, y), []).append(operation.label)
    return found


def _has_site(m: mujoco.MjModel, name: str) -> bool:
    return int(mujoco.mj_name2id(m, mujoco.mjtObj.mjOBJ_SITE.value, name)) >= 0
