"""Contacts that are no fault of the factory: of pads with their payloads, and of fallen bodies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.masks import NOBODY
from factory.engine.mjcf.model import Model
from factory.engine.simulation.mujoco.contacts import ContactMasks
from factory.floor.layout.feeding import outlets_of
from factory.floor.layout.hands.holding import held
from factory.support.engine import mujoco

PRESSED = 1e-4
"""So deep may a part lie in a pad that holds it, or is about to: its rubber gives way [m]."""

FREE = 6
"""Degrees of freedom of a part's body."""


class Pressing:
    """The payloads that pads of robots and feeders may touch. `fallen`: bodies that lie about or
    askew in a feeder; `askew`: the latter, which press on nothing; `shaken`: bodies touched by
    fallen ones, with all in the same hands; `touched`: the pairs of geoms that involve any of
    these; `PRESSED`: so deep may a part lie in a pad that holds it [m]."""

    PRESSED: ClassVar[float] = PRESSED

    def __init__(self, m: mujoco.MjModel, model: Model, masks: ContactMasks) -> None:
        factory, layout = model.factory, model.layout
        self._m, self._contents, self._masks = m, factory.contents, masks
        self.fallen: set[int] = set()
        self.askew: set[int] = set()
        self.shaken: set[int] = set()
        self.touched: set[tuple[int, int]] = set()
        self._holds = {r.name: {held(factory, r.index, at_last=True)} for r in factory.robots}
        for outlet in outlets_of(layout):
            slider = m.body(int(m.eq_obj1id[m.equality(names.feed(outlet.label)).id])).name
            self._holds.setdefault(slider.rpartition("/")[0], set()).add(outlet.label)

    def meant(self, one: int, other: int, apart: float) -> bool:
        """Whether a contact of two geoms, `apart` [m], is intended: one is a pad and the other its
        payload, neither deep in the other; or one has fallen."""
        if (self.fallen or self.shaken) and self._has_fallen(one, other):
            return True
        if apart < -PRESSED:
            return False
        return self._bears(one, other) or self._bears(other, one)

    def _has_fallen(self, one: int, other: int) -> bool:
        """Whether one of two geoms belongs to a fallen or shaken body."""
        bodies = {*self._m.geom_bodyid[[one, other]].tolist()}
        if bodies.isdisjoint(self.fallen | self.shaken):
            return False
        self.touched.add((one, other))
        if bodies.isdisjoint(self.askew):
            self._shake(bodies)
        return True

    def knocked(self, one: int, other: int) -> None:
        """Two geoms of joined parts touch: one becomes shaken if only the other has fallen."""
        bodies = {*self._m.geom_bodyid[[one, other]].tolist()}
        if self.fallen and len(bodies & self.fallen) == 1:
            self._shake(bodies)

    def _shake(self, bodies: Iterable[int]) -> None:
        for body in bodies:
            if self._m.body_dofnum[body] == FREE and body not in self.shaken:
                self.shaken |= self._together(body)

    def _together(self, body: int) -> set[int]:
        """A part's body, and those in the same hands."""
        code, free = self._masks.code, self._m.body_dofnum == FREE
        if code[body] == NOBODY:
            return {body}
        return {*np.flatnonzero((code == code[body]) & free).tolist()}

    def _bears(self, pad: int, geom: int) -> bool:
        holds = self._holds.get(names.pad_of(self._m.geom(pad).name), set())
        held = {part for label in holds for part in self._contents.get(label, ())}
        label = names.label_of(self._m.body(self._m.geom_bodyid[geom]).name)
        return not held.isdisjoint(self._contents.get(label, ()))
