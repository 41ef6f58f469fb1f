"""Contact that is meant: that of a pad with what it is to hold."""

from __future__ import annotations

from factory.layout.hands.holding import held
from factory.mjcf import names
from factory.plant.factory import Factory
from factory.support.engine import mujoco

PRESSED = 1e-4
"""So deep may a part lie in a pad that holds it, or is about to: its rubber gives way [m]."""


class Pressing:
    """The pads (geoms) of robots and feeders, each with the parts that it is to hold."""

    def __init__(self, m: mujoco.MjModel, factory: Factory) -> None:
        self._m, self._contents = m, factory.contents
        ever = {r.name: held(factory, r.index, at_last=True) for r in factory.robots}
        ever |= {names.feeder(leaf.label): leaf.label for leaf in factory.leaves}
        self._parts = {
            geom: frozenset(factory.contents[label])
            for geom in range(m.ngeom)
            if (label := ever.get(names.pad_of(m.geom(geom).name)))
        }

    def meant(self, one: int, other: int, apart: float) -> bool:
        """Whether of two geoms, so far `apart` [m], one is a pad and the other what that is to
        hold, and neither is deep in the other."""
        if apart < -PRESSED:
            return False
        return self._bears(one, other) or self._bears(other, one)

    def _bears(self, pad: int, geom: int) -> bool:
        if pad not in self._parts:
            return False
        label = names.label_of(self._m.body(self._m.geom_bodyid[geom]).name)
        return not self._parts[pad].isdisjoint(self._contents.get(label, ()))
