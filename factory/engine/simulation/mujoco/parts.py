"""The parts of a factory in the engine, and how they change hands when operations end."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from factory.engine.mjcf.masks import robot_code, tray_code
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.weld_frames import held_at
from factory.engine.simulation.mujoco.contacts import ContactMasks
from factory.engine.simulation.mujoco.feeders import Feeders
from factory.engine.simulation.mujoco.fusing import RIGID, SETTLING, Fusion
from factory.engine.simulation.mujoco.holdings import Holdings, copies_of
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.motion import Motion
from factory.engine.simulation.mujoco.passing import Passing
from factory.engine.simulation.mujoco.product_error import Misfit
from factory.engine.simulation.mujoco.strength import Strength
from factory.engine.simulation.mujoco.supply import Supply
from factory.engine.simulation.mujoco.welds import Welds
from factory.engine.simulation.request import RunRequest
from factory.support.engine import mujoco
from factory.theory.plant.operation import Operation

TICKS = 0.99
"""A tick, less what times are rounded by."""


NOTHING: Mapping[int, float] = MappingProxyType({})


class Joining:
    """The fusions of a model that has bodies for sub-assemblies.

    Attributes:
        waiting: by robot (index), the label that it has joined and the time when [s], until its
            parts are fused.
        misfit: by unit, the misfit of its parts when they were fused.
    """

    def __init__(self, model: Model, holdings: Holdings, welds: Welds) -> None:
        self._model, self._holdings, self._welds = model, holdings, welds
        self.waiting: dict[int, tuple[str, float]] = {}
        self.misfit: dict[int, Misfit] = {}
        self._asleep: set[int] = set()

    def weigh(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        """Take the masses of bodies from the model again."""
        places, radii = np.zeros((m.nbody, 3)), np.zeros(m.nbody)
        for label, ids in self._holdings.body.items():
            places[ids] = self._model.carried.centre[label]
            radii[ids] = self._model.carried.radius[label]
        self.fusion = Fusion(m, d, places, radii)

    def joined(self, robot: int, label: str, now: float) -> None:
        """Note that a robot has joined the parts of a sub-assembly."""
        if label in self._model.carried.wholes:
            self.waiting[robot] = label, now

    def settle(self, now: float) -> None:
        """Fuse joined parts that have settled. Parts once examined asleep are not examined again
        before they wake."""
        late = [robot for robot, (_, since) in self.waiting.items() if now - since > SETTLING]
        asleep = {r for r in late if self.fusion.sleeps(self._holdings.hand(r))}
        late = [robot for robot in late if robot not in asleep or robot not in self._asleep]
        self._asleep = asleep
        if late:
            apart = dict(zip(late, self._misfits(late), strict=True))
            self.fuse([robot for robot in late if apart[robot] < RIGID], apart)
            self._welds.write()

    def fuse(self, robots: Iterable[int], apart: Mapping[int, float] = NOTHING) -> None:
        """Fuse what robots (index) have joined, if not done yet. If no copy of that body is free,
        those of its holder are fused first. `apart`: known misfits [m]."""
        for robot in robots:
            if robot not in self.waiting:
                continue
            label, _ = self.waiting.pop(robot)
            if not self._holdings.free[label]:
                holders = (r for r in self.waiting if label in self._holdings.hand(r))
                self.fuse([next(holders)])
            misfit = apart[robot] if robot in apart else self._misfits([robot])[0]
            self._become_one(robot, label, misfit)

    def _misfits(self, robots: Sequence[int]) -> list[float]:
        """The misfit of each robot's payload [m]."""
        held = [[*self._holdings.hand(robot).values()] for robot in robots]
        return list(map(float, self.fusion.misfits(held)))

    def _become_one(self, robot: int, label: str, misfit: float) -> None:
        """Replace a robot's payload by one body of a label. That may be one that is being freed, so
        the payload is put away first."""
        self._welds.write()
        bodies = [*self._holdings.hand(robot).values()]
        unit = self._holdings.of(bodies[0]).unit
        off = Misfit(misfit, self.fusion.turns(bodies), label)
        self.misfit[unit] = off.worse(self.misfit.get(unit, Misfit()))
        self.fusion.fuse(bodies, self._holdings.take(label, unit, robot_code(robot)))
        self._holdings.put_away(bodies)


class Parts:
    """The parts of a factory and who holds them, switched together with welds and contact masks.

    The weld of a holder and a label is used for every copy of that label: it is aimed at the copy
    that is held, and its nominal frame is the same for all.

    Attributes:
        tray: the code of the tray as a holder.
        holdings: which holder has which part.
        welds: the welds, switched at once by `Welds.write`.
        masks: the contact masks of parts.
        feeders: the feeders.
        strength: the share of the strength of robots' hands that their loads use.
        joining: the fusions of parts that have been joined.
    """

    def __init__(
        self,
        arrays: ModelArrays,
        d: mujoco.MjData,
        model: Model,
        motion: Motion,
        request: RunRequest,
        counts: Mapping[int, int],
    ) -> None:
        m, factory = arrays.m, model.factory
        body = copies_of(m, model)
        self.model, self._d = model, d
        self._labels = [model.carried.carried[product] for product in factory.products]
        self.tray = tray_code(factory)
        self.masks = ContactMasks(arrays, body, model.apart)
        radii = np.zeros(m.nbody)
        for label, ids in body.items():
            radii[ids] = model.carried.radius[label]
        self.welds = Welds(arrays, d, self.masks, motion.sleep, radii)
        self.holdings = Holdings(m, model, body, self.welds)
        passing, supply = Passing(m, d, model, request, motion.axes), Supply(model, request, counts)
        self.feeders = Feeders(model, self.holdings, self.welds, motion.sliders, passing, supply)
        self.strength = Strength(m, d, model, self.holdings.grips())
        self.joining = Joining(model, self.holdings, self.welds)
        self.joining.weigh(m, d)
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
            self.welds.open(loose)
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
