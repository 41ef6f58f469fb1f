"""Measurements in the engine during a run: weld residuals, contacts, finished products."""

from __future__ import annotations

from collections.abc import Callable
from math import comb, degrees, sqrt

import numpy as np

from factory.engine.mjcf.model import Model
from factory.engine.mjcf.reservations import reservations_of
from factory.engine.mjcf.weld_frames import residuals
from factory.engine.record.figures import PhysicsFigures
from factory.engine.simulation.mujoco.pressing import Pressing
from factory.engine.simulation.mujoco.product_error import Misfit, product_errors
from factory.engine.simulation.mujoco.soundness import Soundness
from factory.engine.simulation.mujoco.strength import StrengthUse
from factory.engine.simulation.mujoco.welds import Welds
from factory.support.engine import mujoco


class Onsets:
    """The contacts that began, in the order of time.

    Args:
        name: gives the name of a geom, by number.

    Attributes:
        pairs: the pairs of geoms that came to touch, by name.
        begun: time of the first [s]; None while there was none.
    """

    def __init__(self, name: Callable[[int], str]) -> None:
        self.pairs: list[tuple[str, str]] = []
        self.begun: float | None = None
        self._name = name
        self._touching: frozenset[tuple[int, int]] = frozenset()

    def note(self, now: set[tuple[int, int]], t: float) -> None:
        """Record the touching pairs of geoms at a time [s], after a step of the engine."""
        fresh = sorted(now - self._touching)
        if fresh and self.begun is None:
            self.begun = t
        self.pairs += [(self._name(a), self._name(b)) for a, b in fresh]
        self._touching = frozenset(now)

    def apart(self) -> None:
        """Forget which geoms touch."""
        self._touching = frozenset()


class Inspection:
    """The worst figures of a run so far. Contacts are inspected after every step of the engine.

    Attributes:
        joining: for each operation under way (index) the unit whose inputs it joins.
        onsets: unintended contacts.
        pressing: intended contacts.
        residual: largest position error of a weld [m].
        error: the error of a product; None before the first.
        soundness: whether the engine's model is that of the factory.
    """

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, model: Model, soundness: Soundness
    ) -> None:
        self._m, self._d, self._model, self.soundness = m, d, model, soundness
        self._masks = soundness.masks
        self._products, self._body = product_errors(model), m.geom_bodyid.tolist()
        self._wrench = np.zeros(6)
        self._push = self._wrench[:3]
        self.pressing = Pressing(m, model, self._masks)
        self.onsets = Onsets(lambda geom: str(m.geom(geom).name))
        self.joining: dict[int, int] = {}
        self.force: dict[str, float] = {}
        self.residual = 0.0
        self.error: Misfit | None = None

    @property
    def unintended(self) -> list[tuple[str, str]]:
        """The pairs of geoms, by name, of unintended contacts."""
        return self.onsets.pairs

    def welds(self) -> None:
        """Keep the largest residual of the active welds' positions."""
        if self._d.ne:
            self.residual = max(self.residual, float(np.abs(residuals(self._d)).max()))

    def tick(self) -> None:
        """At the end of a tick, forget which geoms touched."""
        if not self._d.ncon:
            self.onsets.apart()

    def contacts(self) -> None:
        """Record the forces between inputs that are being joined, and count the onsets of all other
        contacts except between pads and their payloads."""
        pairs, now = self._d.contact, set[tuple[int, int]]()
        apart = pairs.dist
        touching = np.flatnonzero(apart[: self._d.ncon] < 0)
        for number, (a, b) in zip(touching.tolist(), pairs.geom[touching].tolist(), strict=True):
            label = self._joined(a, b)
            if label is not None:
                self._press(label, number)
                self.pressing.knocked(a, b)
            elif not self.pressing.meant(a, b, float(apart[number])):
                now.add((a, b))
        self.onsets.note(now, float(self._d.time))

    def _joined(self, one: int, other: int) -> str | None:
        """The label of the operation that joins the parts of two geoms; "" for none."""
        a, b = self._body[one], self._body[other]
        unit, code = self._masks.unit, self._masks.code
        if unit[a] < 0 or unit[a] != unit[b]:
            return None
        for number, worked_on in self.joining.items():
            operation = self._model.factory.operations[number]
            if unit[a] == worked_on and {code[a] - 1, code[b] - 1} <= {*operation.robots}:
                return operation.label
        return None

    def _press(self, label: str, contact: int) -> None:
        mujoco.mj_contactForce(self._m, self._d, contact, self._wrench)
        force = sqrt(self._push.dot(self._push))
        self.force[label] = max(self.force.get(label, 0.0), force)

    def measure(self, unit: int, bodies: np.ndarray, misfit: Misfit) -> None:
        """Record the error of the finished product of a unit, with the misfit of its parts when
        they were fused."""
        product = self._products[unit % len(self._products)]
        measured = product.measure(self._d, bodies).worse(misfit)
        self.error = measured.worse(self.error or Misfit())

    def figures(self, welds: Welds, strength: StrengthUse | None = None) -> PhysicsFigures:
        """The figures of the run so far; `strength`: the largest share of a hand's strength that
        was used."""
        pairs = dict.fromkeys(f"{a} - {b}" for a, b in self.unintended)
        pads, misfit = welds.pads.largest, self.error
        self.soundness.look()
        return PhysicsFigures(
            welds.taken.count,
            1e3 * welds.taken.gap,
            1e3 * self.residual,
            None if misfit is None else 1e3 * misfit.vertex,
            len(self.unintended),
            int(sum(w.number for w in self._d.warning)),
            tuple(pairs),
            dict(self.force),
            comb(len(self._model.factory.leaves), 2),
            self._model.excluded,
            bool(self._model.carried.wholes),
            float(self._m.opt.timestep),
            grip_gap_max_mm=None if pads is None else 1e3 * pads,
            product_angle_max_deg=None if misfit is None else degrees(misfit.angle),
            faults=(*self.soundness.found, *self._model.overlaps),
            reservations=reservations_of(self._model.layout, self._model.excluded),
            contact_first_s=self.onsets.begun,
            misplaced=() if misfit is None else (misfit.label,),
            handoff_angle_max_deg=degrees(welds.taken.turn),
            joining_error_max_mm=1e3 * welds.taken.off,
            grip_strength_share_max=None if strength is None else strength.share,
            grip_strength_robot=None if strength is None else strength.robot,
            grip_strength_label=None if strength is None else strength.label,
        )
