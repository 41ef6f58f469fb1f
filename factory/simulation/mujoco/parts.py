"""The parts of a factory in the engine, and how they change hands when operations end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from factory.mjcf.masks import robot_code, tray_code
from factory.mjcf.model import Model
from factory.mjcf.weld_frames import held_at
from factory.plant.factory import Operation
from factory.simulation.mujoco.contacts import ContactMasks
from factory.simulation.mujoco.feeders import Feeders
from factory.simulation.mujoco.holdings import Holdings, copies_of
from factory.simulation.mujoco.joining import Joining
from factory.simulation.mujoco.motion import Motion
from factory.simulation.mujoco.passing import Passing
from factory.simulation.mujoco.product_error import Misfit
from factory.simulation.mujoco.strength import Strength
from factory.simulation.mujoco.supply import Supply
from factory.simulation.mujoco.welds import Welds
from factory.simulation.request import RunRequest
from factory.support.engine import mujoco

TICKS = 0.99
"""A tick, less what times are rounded by."""


class Parts:
    """The parts, what holds them, and what becomes of them, switched together.

    A weld is aimed at the copy it holds by writing its body at run time; its nominal frame is the
    same for all copies. `tray`: the code of the tray; `strength`: how much of that of robots' hands
    is used.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        model: Model,
        motion: Motion,
        request: RunRequest,
        counts: Mapping[int, int],
    ) -> None:
        factory, body = model.factory, copies_of(m, model)
        self.model, self._d = model, d
        self._labels = [model.carried.carried[product] for product in factory.products]
        self.tray = tray_code(factory)
        self.masks = ContactMasks(m, body, model.apart)
        radii = np.zeros(m.nbody)
        for label, ids in body.items():
            radii[ids] = model.carried.radius[label]
        self.welds = Welds(m, d, self.masks, motion.sleep, radii)
        self.holdings = Holdings(m, model, body, self.welds)
        passing, supply = Passing(m, d, model, request), Supply(model, request, counts)
        self.feeders = Feeders(model, self.holdings, self.welds, motion.sliders, passing, supply)
        self.strength = Strength(m, d, model, self.holdings.grips())
        self.joining = Joining(model, self.holdings, self.welds)
        self.joining.weigh(m, d)
        mujoco.mj_kinematics(m, d)
        for label, unit, robot in self._under_way(counts, passing):
            self._give(m, label, unit, robot)
        self.feeders.begin()
        self.welds.write()

    def bear(self) -> bool:
        """Open hands whose load exceeds their strength. Returns whether there are any. Their robots
        do not notice. Welds closed less than a tick ago may still pull their part into place, so
        nothing is measured then."""
        if self._d.time - self.welds.closed < TICKS * self.model.settings.tick:
            return False
        loose = self.strength.look()
        if loose:
            self.welds.loose(loose)
            self.welds.write()
        return bool(loose)

    def complete(self, ended: Sequence[tuple[Operation, int]]) -> None:
        """Fuse what robots of ending operations have joined, before it changes hands."""
        if self.joining.waiting:
            self.joining.fuse([robot for operation, _ in ended for robot in operation.robots])

    def hand_over(self, ended: Sequence[tuple[Operation, int]]) -> None:
        """Switch the grips at the ends of operations, each with its unit; a feeder's too, and at
        dropoff all of the output robot's for those of the tray."""
        for operation, unit in ended:
            if self.model.factory.drops(operation.index):
                self.holdings.move(self.holdings.hand(operation.carrier).values(), self.tray)
                self.feeders.supply.word.made += 1
            elif operation.inputs:
                self._pass_on(operation)
            else:
                self.feeders.taken(operation.label)
                taken = [self.holdings[operation.label, unit]]
                self.holdings.move(taken, robot_code(operation.carrier))
        self.feeders.end([operation for operation, _ in ended])
        self.welds.write()

    def _pass_on(self, operation: Operation) -> None:
        carrier = operation.carrier
        for robot in operation.robots:
            if robot != carrier:
                self.holdings.move(self.holdings.hand(robot).values(), robot_code(carrier))
        self.joining.joined(carrier, operation.label, float(self._d.time))

    def recycle(self) -> None:
        """Return the bodies of the product on the tray to the feeders, out of sight."""
        assert self.on_tray is not None
        self.joining.misfit.pop(self.on_tray, None)
        self.holdings.put_away(self.holdings.held(self.tray).values())
        self.welds.write()

    def finished(self, unit: int) -> tuple[np.ndarray, Misfit]:
        """The bodies of a finished product, in the order of its `labels`, and how far off its
        parts were when they became one body."""
        labels = self._labels[unit % len(self._labels)]
        bodies = [self.holdings[label, unit] for label in labels]
        return np.array(bodies), self.joining.misfit.get(unit, Misfit())

    @property
    def on_tray(self) -> int | None:
        """The unit on the outfeed's tray."""
        return self.holdings.unit(self.tray)

    def _under_way(
        self, counts: Mapping[int, int], passing: Passing
    ) -> Iterable[tuple[str, int, int]]:
        """The bodies that are in robots' hands in a marking: label, unit, and the robot (index) of
        the last operation on its way that has ended for its unit."""
        factory = self.model.factory
        for leaf in factory.leaves:
            gone = counts.get(factory.dropoffs[leaf.turn].end, 0)
            for count in range(gone, counts.get(leaf.end, 0)):
                unit, holder = factory.unit(leaf, count), leaf
                operation = leaf
                while not factory.drops(operation.index) and counts.get(operation.end, 0) > count:
                    holder = operation
                    operation = factory.operations[factory.parents[operation.index]]
                if holder.carrier == leaf.carrier:
                    passing.holding(leaf.carrier)
                for label in self.model.carried.carried[holder.label]:
                    if (label, unit) not in self.holdings:
                        yield label, unit, holder.carrier

    def _give(self, m: mujoco.MjModel, label: str, unit: int, robot: int) -> None:
        """Put a copy into a robot's hand, at the pose of the weld."""
        weld = np.array([self.holdings.weld[robot_code(robot), label]])
        x, y, z = held_at(m, weld, self._d.xpos, self._d.xmat)[0].tolist()
        self.welds.place(self.holdings.take(label, unit, robot_code(robot)), (x, y, z))
