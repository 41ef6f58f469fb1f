"""Faults of bodies: hands that open, inputs that slip, parts that lie askew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from factory.api import MujocoWorld, Operation
from factory.apps.deviations.deviation import Deviation
from factory.apps.recovery.mujoco.fallen import Fallen
from factory.support.engine import mujoco

FAR = 1.0
"""Contact of what lies askew is counted to this depth, and presses on nothing [m]."""

UP = np.array([0, 0, 1, 0, 0, 0, 0])
"""Upwards, in the place of a body in its holder."""

SETTLES = 0.5
"""What has slipped is back in its place in the hand so long after it is held right [s]."""


@dataclass(frozen=True, slots=True)
class Slip:
    """A slip of an input in its hand.

    Attributes:
        robot: the robot (index).
        welds: the welds of its hand.
        bodies: all bodies of the operation, which press on each other.
    """

    robot: int
    welds: tuple[int, ...]
    bodies: tuple[int, ...]


class Mishaps:
    """The faults of a world, as deviations have caused them.

    Attributes:
        slips: by operation under way (index), the input that has slipped.
        opened: robots (index) whose hands have opened undetected.
        bad: by defective body, whether the defect is hidden from feeders' cameras.
        unseen: by body that no camera has examined yet, its fault.
        askew: by body that lies askew in a feeder, the code and the pad (a geom) of the feeder.
        gone: faults that no camera can find any more.
    """

    def __init__(self, world: MujocoWorld, fallen: Fallen) -> None:
        self._world, self._fallen = world, fallen
        self._settling: list[tuple[float, tuple[int, ...]]] = []
        self.slips: dict[int, Slip] = {}
        self.opened: set[int] = set()
        self.bad: dict[int, bool] = {}
        self.unseen: dict[int, str] = {}
        self.askew: dict[int, tuple[int, int]] = {}
        self.gone: list[str] = []

    def open(self, robot: int) -> None:
        """Open a robot's hand."""
        parts = self._world.parts
        held = parts.holdings.hand(robot)
        parts.welds.open([parts.holdings.weld[parts.holdings.code(robot), label] for label in held])
        parts.welds.write()
        self._fallen.watch(held.values())
        self.opened.add(robot)

    def slip(self, operation: Operation, metres: float) -> None:
        """Let the last input of an operation slip upwards in its hand."""
        holdings, robot = self._world.parts.holdings, operation.robots[operation.last]
        welds = tuple(holdings.weld[holdings.code(robot), label] for label in holdings.hand(robot))
        for weld in welds:
            place = self._world.m.eq_data[weld, 3:10]
            self._world.parts.welds.offset(weld, place + metres * UP)
        bodies = tuple(body for r in operation.robots for body in holdings.hand(r).values())
        self.slips[operation.index] = Slip(robot, welds, bodies)
        self._fallen.watch(bodies)

    def restore(self, operations: Iterable[int]) -> None:
        """Put slipped inputs of operations (index) back into place."""
        for number in {*operations} & self.slips.keys():
            slip = self.slips.pop(number)
            self._world.parts.welds.end_offset(slip.welds)
            self._settling.append((self._world.time + SETTLES, slip.bodies))

    def fresh(self) -> Sequence[tuple[str, int]]:
        """The parts that feeders have begun to present since the last call, all of them
        straight."""
        back = self._world.parts.feeders.back
        shown, back.fresh = [*back.fresh.items()], {}
        return shown

    def spoil(self, label: str, fault: Deviation) -> None:
        """Make the part that a feeder presents defective, or misplace it."""
        parts, m = self._world.parts, self._world.m
        unit = parts.feeders.shown().get(label)
        if unit is None:
            self.gone.append(fault.kind)
            return
        body, weld = parts.holdings[label, unit], parts.feeders.welds[label]
        self.unseen[body] = fault.kind
        if fault.kind == "bad_part":
            self.bad[body] = fault.hidden
            return
        half, place = np.radians(fault.number("degrees")) / 2, m.eq_data[weld, 3:10].copy()
        about_x, turn, pose = np.array([np.cos(half), np.sin(half), 0, 0]), np.zeros(4), np.zeros(4)
        mujoco.mju_mulQuat(turn, place[3:], about_x)
        slider = self._world.d.xquat[m.eq_obj1id[weld]]
        mujoco.mju_mulQuat(pose, slider, turn)
        aside = np.zeros(3)
        mujoco.mju_rotVecQuat(aside, np.array([0, fault.way, 0]), slider)
        parts.welds.offset(weld, np.array([place[0], place[1] + fault.way, place[2], *turn]))
        parts.welds.turn(body, pose, aside)
        self._fallen.watch([body])
        pad = int(m.body_geomadr[m.eq_obj1id[weld]])
        self.askew[body] = int(parts.masks.code[body]), pad
        self._press(body, False)

    def _press(self, body: int, presses: bool) -> None:
        """Let a body press on what it touches, or only touch it: a housing is as narrow as a part
        that hangs straight in it."""
        arrays, geoms = self._world.arrays, self._world.parts.masks.solid[body]
        gap, margin = arrays["geom_gap"], arrays["geom_margin"]
        gap[geoms], margin[geoms] = (0.0, 0.0) if presses else (FAR, -FAR)
        inspection = self._world.inspection
        for ghosts in (inspection.pressing.askew, inspection.soundness.askew):
            (ghosts.discard if presses else ghosts.add)(body)

    def _touches(self, body: int, pad: int) -> None:
        """Count a contact of a body with the pad that holds it: the engine excludes that pair."""
        world, pressing = self._world, self._world.inspection.pressing
        for geom in world.parts.masks.solid[body].tolist():
            apart = mujoco.mj_geomDistance(world.m, world.d, pad, geom, 0.0, None)
            if apart < -pressing.PRESSED:
                pressing.touched.add((pad, geom))

    def take_back(self, body: int) -> None:
        """Withdraw a part, whether a camera has examined it or not."""
        if fault := self.unseen.pop(body, ""):
            self.gone.append(fault)

    def tick(self) -> None:
        """At the end of a tick, forget slips of finished joints and faults of bodies out of
        sight."""
        world = self._world
        self.restore(
            [n for n, slip in self.slips.items() if not world.parts.holdings.hand(slip.robot)]
        )
        for _, bodies in [one for one in self._settling if one[0] <= world.time]:
            self._fallen.calm(bodies)
        self._settling = [one for one in self._settling if one[0] > world.time]
        units, code = world.parts.masks.unit, world.parts.masks.code
        for body, (feeder, pad) in [*self.askew.items()]:
            if code[body] == feeder:
                self._touches(body, pad)
            else:
                del self.askew[body]
                self._press(body, True)
        self.bad = {body: hidden for body, hidden in self.bad.items() if units[body] >= 0}
