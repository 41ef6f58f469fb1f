"""What the world does to bodies: hands that open, inputs that slip, parts that lie askew."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from factory.mjcf.masks import robot_code
from factory.plant.factory import Operation
from factory.simulation.mujoco.failing.fallen import Fallen
from factory.simulation.mujoco.pressing import PRESSED
from factory.simulation.mujoco.world import MujocoWorld
from factory.simulation.recovery.faults import WorldFault
from factory.support.engine import mujoco

FAR = 1.0
"""Contact of what lies askew is counted to this depth, and presses on nothing [m]."""

SETTLES = 0.5
"""What has slipped is back in its place in the hand so long after it is held right [s]."""


@dataclass(frozen=True, slots=True)
class Slip:
    """The `welds` of a robot's hand in which something has slipped, and all the `bodies` of the
    operation, which press on each other."""

    robot: int
    welds: tuple[int, ...]
    bodies: tuple[int, ...]


class Mishaps:
    """Those of a world. `slips`: by operation under way (index); `opened`: robots (index) whose
    hands have opened and that do not know; `bad`: bodies that are no good, and whether that is
    hidden from feeders' cameras; `unseen`: bodies that no camera has looked at, and the fault;
    `askew`: bodies that lie so in a feeder, whose code and pad (a geom) are given; `gone`: faults
    that none will look at any more."""

    def __init__(self, world: MujocoWorld, fallen: Fallen) -> None:
        self._world, self._fallen, self._nominal = world, fallen, world.m.eq_data.copy()
        self._settling: list[tuple[float, tuple[int, ...]]] = []
        self.slips: dict[int, Slip] = {}
        self.opened: set[int] = set()
        self.bad: dict[int, bool] = {}
        self.unseen: dict[int, str] = {}
        self.askew: dict[int, tuple[int, int]] = {}
        self.gone: list[str] = []

    def open(self, robot: int) -> None:
        """A robot's hand opens."""
        parts = self._world.parts
        held = parts.holdings.hand(robot)
        parts.welds.loose([parts.holdings.weld[robot_code(robot), label] for label in held])
        parts.welds.write()
        self._fallen.watch(held.values())
        self.opened.add(robot)

    def slip(self, operation: Operation, metres: float) -> None:
        """The last input of an operation slips up in its hand."""
        holdings, robot = self._world.parts.holdings, operation.robots[operation.last]
        welds = tuple(holdings.weld[robot_code(robot), label] for label in holdings.hand(robot))
        self._world.m.eq_data[[*welds], 5] += metres
        bodies = tuple(body for r in operation.robots for body in holdings.hand(r).values())
        self.slips[operation.index] = Slip(robot, welds, bodies)
        self._fallen.watch(bodies)

    def restore(self, operations: Iterable[int]) -> None:
        """What has slipped in operations (index) is held as it should be."""
        for number in {*operations} & self.slips.keys():
            slip = self.slips.pop(number)
            self._world.m.eq_data[[*slip.welds]] = self._nominal[[*slip.welds]]
            self._settling.append((self._world.time + SETTLES, slip.bodies))

    def fresh(self) -> Sequence[tuple[str, int]]:
        """The parts that feeders have begun to show since the last question, none of them askew."""
        feeders = self._world.parts.feeders
        found, feeders.back.fresh = [*feeders.back.fresh.items()], {}
        welds = [feeders.welds[label] for label, _ in found]
        self._world.m.eq_data[welds] = self._nominal[welds]
        return found

    def spoil(self, label: str, fault: WorldFault) -> None:
        """What a feeder shows is askew or no good."""
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
        half = np.radians(fault.degrees) / 2
        about_x, turn, pose = np.array([np.cos(half), np.sin(half), 0, 0]), np.zeros(4), np.zeros(4)
        mujoco.mju_mulQuat(turn, self._nominal[weld, 6:10], about_x)
        slider = self._world.d.xquat[m.eq_obj1id[weld]]
        mujoco.mju_mulQuat(pose, slider, turn)
        aside = np.zeros(3)
        mujoco.mju_rotVecQuat(aside, np.array([0, fault.way, 0]), slider)
        m.eq_data[weld, 4] += fault.way
        m.eq_data[weld, 6:10] = turn
        parts.welds.turn(body, pose, aside)
        self._fallen.watch([body])
        pad = int(m.body_geomadr[m.eq_obj1id[weld]])
        self.askew[body] = int(parts.masks.code[body]), pad
        self._press(body, False)

    def _press(self, body: int, presses: bool) -> None:
        """From now on a body presses on what it touches, or only touches it: a housing is as narrow
        as what hangs straight in it."""
        m, geoms = self._world.m, self._world.parts.masks.solid[body]
        m.geom_gap[geoms], m.geom_margin[geoms] = (0.0, 0.0) if presses else (FAR, -FAR)
        inspection = self._world.inspection
        for ghosts in (inspection.pressing.askew, inspection.soundness.gone):
            (ghosts.discard if presses else ghosts.add)(body)

    def _touches(self, body: int, pad: int) -> None:
        """Count that a body reaches into the pad that holds it: the engine leaves that pair out."""
        world, touched = self._world, self._world.inspection.pressing.touched
        for geom in world.parts.masks.solid[body].tolist():
            if mujoco.mj_geomDistance(world.m, world.d, pad, geom, 0.0, None) < -PRESSED:
                touched.add((pad, geom))

    def take_back(self, body: int) -> None:
        """A part is taken back, whether it has been looked at or not."""
        if fault := self.unseen.pop(body, ""):
            self.gone.append(fault)

    def tick(self) -> None:
        """A tick is over: what has been joined has not slipped any more, and what is out of sight
        is as good as new."""
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
