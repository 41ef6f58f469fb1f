"""Forks: the guidepaths of tees, made of those of a layout in which the robots of each tee are one.

The first robot of a tee goes straight, and a bit further than that one did; the second leaves its
line where that one received, goes across it, and on beside the first. So their arms point the same
way, and their branches lie beside each other, each as the one branch lay. Arms are so long that
a robot and what is behind it are clear of the other's way. What lies beyond a fork may be in the
way of others: then it is further out, or to the other side.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from factory.floor.layout.bending import Detour, bent
from factory.floor.layout.branches import branch_of, carriers
from factory.floor.layout.certificate import (
    ARM_BODY,
    CARRIAGE_BODY,
    MAST_BODY,
)
from factory.floor.layout.clearance import certify
from factory.floor.layout.dimensions import ARMS, CARRIAGES
from factory.floor.layout.hands.leaving import SPARE
from factory.floor.layout.layout import Layout
from factory.floor.layout.sweeps import regions
from factory.floor.layout.way import Bend
from factory.support.boxes import Extent
from factory.support.decimals import up
from factory.support.errors import Diagnostic, RunError
from factory.theory.plant.factory import Factory
from factory.theory.problem.robot_bodies import MAST

OUT = 0.02
"""Step by which a fork is moved outwards where something is in its way [m]."""

MOST = 40
"""Most such steps."""


NO_ARMS: Mapping[int, float] = MappingProxyType({})
"""No arm is longer than it needs."""


@dataclass(frozen=True, slots=True)
class Fork:
    """The fork of a robot on a stem: how much further it is to go out, the length of its arms
    `back`, and how far the second arm is `aside` of the first, to the robot's side t; all [m]."""

    robot: int
    out: float
    back: float
    aside: float

    def detours(self, layout: Layout, rounding: float) -> tuple[Detour, Detour]:
        """The guidepaths of both robots."""
        travel = round(layout.guidepaths[self.robot].travel + self.out, 3)
        corner = round(layout.guidepaths[self.robot].reach + travel, 3)
        straight = round(travel + self.back, 3)
        bend = Bend(corner, self.aside)
        return Detour(straight), Detour(round(straight + abs(self.aside), 3), (bend,), rounding)


def forked(
    stems: Layout,
    factory: Factory,
    place: tuple[int, ...],
    rounding: float,
    arms: Mapping[int, float] = NO_ARMS,
) -> Layout:
    """The layout of a factory with tees, from that of the factory on stems; `place`: the robot
    there of each robot; `rounding`: that of corners [m]; `arms`: how much longer the arms of a
    robot there are to be than they need for what stands on them [m]. It is not certified. Raises
    RunError (Layout) where there is no room for a second arm."""
    on, made = carriers(stems.factory), _Making(stems, factory, place, rounding)
    twice = {robot for robot in place if place.count(robot) > 1}
    tees = sorted(robot for robot in twice if on[robot] not in twice)
    forks = dict[int, Fork]()
    for number, robot in enumerate(tees):
        later = {member for tee in tees[number + 1 :] for member in branch_of(on, tee)}
        names = {factory.robots[r].name for r, at in enumerate(place) if at in later}
        for fork in _forks(stems, robot, rounding, arms.get(robot, 0.0)):
            certificate = certify(made.layout({**forks, robot: fork}))
            faults = [fault for fault in certificate.faults if names.isdisjoint(fault.robots)]
            if not faults:
                forks[robot] = fork
                break
        else:
            message = f"there is no room for a second arm: {faults[0].message}"
            position = stems.factory.robots[robot].position
            raise RunError(Diagnostic("Layout", message, position, "leave it at one branch here"))
    return made.layout(forks)


@dataclass(frozen=True, slots=True)
class _Making:
    """The data of a layout with tees, apart from the forks; see `forked`."""

    stems: Layout
    factory: Factory
    place: tuple[int, ...]
    rounding: float

    def layout(self, forks: Mapping[int, Fork]) -> Layout:
        """The layout with some forks."""
        both = {robot: fork.detours(self.stems, self.rounding) for robot, fork in forks.items()}
        arms = [
            bent(self.stems, {robot: detours[arm] for robot, detours in both.items()})
            for arm in (0, 1)
        ]
        second = list[bool]()
        for robot, carrier in enumerate(carriers(self.factory)):  # carriers come first
            twin = self.place.index(self.place[robot]) != robot
            second.append(twin or (carrier >= 0 and second[carrier]))
        of = [arms[arm] for arm in second]
        hands = self.stems.hands
        return replace(
            self.stems,
            factory=self.factory,
            guidepaths=tuple(on.guidepaths[at] for on, at in zip(of, self.place, strict=True)),
            visits={
                (o.index, robot): of[robot].visits[o.index, self.place[robot]]
                for o in self.factory.operations
                for robot in o.robots
            },
            hands=tuple(hands[at] for at in self.place) if hands else (),
            certificate=None,
        )


def _forks(layout: Layout, robot: int, rounding: float, longer: float) -> Iterator[Fork]:
    """The forks of a robot on a stem, the nearest first, to either side; arms are `longer` than
    they need [m]."""
    path, c = layout.guidepaths[robot], layout.clearance
    takes = [*_beside(layout, robot)]
    low, high = min(t for _, (_, _, t, _) in takes), max(t for _, (_, _, _, t) in takes)
    aside = max(up(high - low + c), 2 * rounding)
    rears = _behind(layout, robot)
    spare = SPARE, SPARE, 0.0  # a robot has gone by a point short of its home
    ahead = max(front - rears[layer] + spare[layer] for layer, (_, front, _, _) in takes)
    back, least = up(max(up(ahead + c), rounding) + longer), max(up(rounding - path.travel), 0.0)
    for step in range(MOST):
        out = round(least + step * OUT, 3)
        for more, far in ((0.0, 0.0), (0.0, rounding), (rounding, 0.0)):  # for boxes of corners
            arm, across = round(back + more, 3), round(aside + far, 3)
            yield from (Fork(robot, out, arm, side * across) for side in (-1, +1))


def _beside(layout: Layout, robot: int) -> Iterator[tuple[int, Extent]]:
    """The floor, by layer, of a receiving robot and its branch, about the product's middle
    there."""
    path, branch = layout.guidepaths[robot], branch_of(carriers(layout.factory), robot)
    x, y = path.middle(path.length)
    lane = path.offset
    half = layout.factory.carriage / 2
    yield CARRIAGES, (-path.reach - half, half - path.reach, lane - half, lane + half)
    yield ARMS, (-path.reach - MAST / 2, -path.arm, lane - MAST / 2, lane + MAST / 2)
    for region in regions(layout):
        is_robots = region.robot == robot and region.kind in (CARRIAGE_BODY, MAST_BODY, ARM_BODY)
        if (
            region.robot in branch
            and not is_robots
            and (region.robot != robot or not region.is_coupled)
        ):
            xlo, xhi, ylo, yhi = region.box
            yield region.layer, path.frame((xlo - x, xhi - x, ylo - y, yhi - y))


def _behind(layout: Layout, robot: int) -> tuple[float, ...]:
    """How far behind the product's middle a moving robot with its payload reaches, by layer."""
    path, grip = layout.guidepaths[robot], layout.grip(robot)
    brought = [path.frame(layout.payloads[label])[0] for label in layout.factory.deliveries(robot)]
    loads = min([*brought, *(grip[:1] if grip else ())])
    return -path.reach - layout.factory.carriage / 2, -path.reach - MAST / 2, loads
