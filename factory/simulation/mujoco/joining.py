"""Joined sub-assemblies become one body each, once their parts have settled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from factory.mjcf.masks import robot_code
from factory.mjcf.model import Model
from factory.simulation.mujoco.fusing import RIGID, SETTLING, Fusion
from factory.simulation.mujoco.holdings import Holdings
from factory.simulation.mujoco.product_error import Misfit
from factory.simulation.mujoco.welds import Welds
from factory.support.engine import mujoco

NOTHING: Mapping[int, float] = MappingProxyType({})


class Joining:
    """Where the model has bodies for sub-assemblies: `waiting`, the label that each robot (index)
    has joined and since when [s]; `misfit`: how far out of place a unit's parts were when
    they became one."""

    def __init__(self, model: Model, holdings: Holdings, welds: Welds) -> None:
        self._model, self._holdings, self._welds = model, holdings, welds
        self.waiting: dict[int, tuple[str, float]] = {}
        self.misfit: dict[int, Misfit] = {}
        self._asleep: set[int] = set()

    def weigh(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        """From now on bodies have the masses that the model has."""
        places, radii = np.zeros((m.nbody, 3)), np.zeros(m.nbody)
        for label, ids in self._holdings.body.items():
            places[ids] = self._model.carried.centre[label]
            radii[ids] = self._model.carried.radius[label]
        self.fusion = Fusion(m, d, places, radii)

    def joined(self, robot: int, label: str, now: float) -> None:
        """A robot has joined the parts of a sub-assembly."""
        if label in self._model.carried.wholes:
            self.waiting[robot] = label, now

    def settle(self, now: float) -> None:
        """Let one body take the place of those that a robot has joined, once they have settled.
        What has been looked at asleep is not looked at again before it wakes."""
        late = [robot for robot, (_, since) in self.waiting.items() if now - since > SETTLING]
        asleep = {r for r in late if self.fusion.sleeps(self._holdings.hand(r))}
        late = [robot for robot in late if robot not in asleep or robot not in self._asleep]
        self._asleep = asleep
        if late:
            apart = dict(zip(late, self._misfits(late), strict=True))
            self.fuse([robot for robot in late if apart[robot] < RIGID], apart)
            self._welds.write()

    def fuse(self, robots: Iterable[int], apart: Mapping[int, float] = NOTHING) -> None:
        """Let one body each take the place of those that robots (index) have joined, if it has not
        yet. Where no copy of that body is free, its holder's bodies become one first. `apart`:
        misfits that are known [m]."""
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
        """How far out of place anything is of what each robot holds [m]."""
        held = [[*self._holdings.hand(robot).values()] for robot in robots]
        return list(map(float, self.fusion.misfits(held)))

    def _become_one(self, robot: int, label: str, misfit: float) -> None:
        """A robot gets one body, of this label, for all that it holds. A body that has just become
        free may be that one, so it is put away first."""
        self._welds.write()
        bodies = [*self._holdings.hand(robot).values()]
        unit = self._holdings.of(bodies[0]).unit
        off = Misfit(misfit, self.fusion.turns(bodies), label)
        self.misfit[unit] = off.worse(self.misfit.get(unit, Misfit()))
        self.fusion.fuse(bodies, self._holdings.take(label, unit, robot_code(robot)))
        self._holdings.put_away(bodies)
