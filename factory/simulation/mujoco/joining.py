"""Sub-assemblies become one body each once their joined parts have settled."""

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
    """The fusions of a model that has bodies for sub-assemblies. `waiting`: the label that each
    robot (index) has joined, and when [s]; `misfit`: by unit, the misfit of its parts when they
    were fused."""

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
