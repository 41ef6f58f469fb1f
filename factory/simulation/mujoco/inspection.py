"""What is measured in the engine while a factory runs: residuals, contacts, finished products."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import comb

import numpy as np

from factory.layout.layout import Layout
from factory.mjcf.model import Model
from factory.mjcf.weld_frames import residuals
from factory.simulation.keeping import Keeper, is_size, is_text, maybe_size, one_of, up_to
from factory.simulation.mujoco.contacts import ContactMasks
from factory.simulation.mujoco.pressing import Pressing
from factory.simulation.mujoco.product_error import ProductError
from factory.simulation.mujoco.strength import StrengthUse
from factory.simulation.mujoco.welds import Welds
from factory.simulation.run import PhysicsFigures
from factory.support.engine import mujoco

MOST_ONSETS = 10**7
"""So many onsets of contact are taken up at most."""


class Inspection:
    """Keeps the worst figures of a run. Contacts are looked at after every step of the engine.

    `joining`: for each operation under way (index) the unit whose inputs it joins. `unintended`:
    onsets of contact that nothing intends, by the names of geoms; `pressing`: what is no such
    contact. `residual` [m]: the largest of a weld's position. `error` [m]: that of a product.
    """

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, model: Model, masks: ContactMasks
    ) -> None:
        self._m, self._d, self._model, self._masks = m, d, model, masks
        self._product = ProductError(model)
        self.pressing = Pressing(m, model, masks)
        self._touching: frozenset[tuple[int, int]] = frozenset()
        self.joining: dict[int, int] = {}
        self.force: dict[str, float] = {}
        self.residual = 0.0
        self.error: float | None = None
        self.unintended: list[tuple[str, str]] = []

    def exchange(self, layout: Layout) -> None:
        """From now on robots do what a layout says."""
        self._model = replace(self._model, layout=layout)

    def welds(self) -> None:
        """Keep the largest residual of the active welds' positions."""
        if self._d.ne:
            self.residual = max(self.residual, float(np.abs(residuals(self._d)).max()))

    def tick(self) -> None:
        """A tick is over: what touched in it may be apart."""
        if self._touching and not self._d.ncon:
            self._touching = frozenset()

    def contacts(self) -> None:
        """Keep the forces between inputs that are being joined, and count the onsets of all other
        contacts but those of pads with what they hold: nothing intends those."""
        found = self._d.contact
        now = set()
        for number in np.flatnonzero(found.dist[: self._d.ncon] < 0).tolist():
            a, b = found.geom[number].tolist()
            label = self._joined(a, b)
            if label is not None:
                self._press(label, number)
                self.pressing.knocked(a, b)
            elif not self.pressing.meant(a, b, float(found.dist[number])):
                now.add((a, b))
        for a, b in sorted(now - self._touching):
            self.unintended.append((self._m.geom(a).name, self._m.geom(b).name))
        self._touching = frozenset(now)

    def keep(self, keeper: Keeper) -> None:
        """The figures, what touches, and what is being joined."""
        operations, a_geom = self._model.factory.operations, up_to(self._m.ngeom)
        labels = {operation.label for operation in operations}
        an_operation = up_to(len(operations))
        joins = keeper.rows("joins", self.joining.items(), an_operation, up_to(np.inf))
        force = keeper.rows("forces", self.force.items(), one_of(labels), is_size)
        touching = keeper.rows("touching", sorted(self._touching), a_geom, a_geom)
        onsets = [(*pair, count) for pair, count in Counter(self.unintended).items()]
        onsets = keeper.rows("onsets", onsets, is_text, is_text, up_to(MOST_ONSETS))
        self.residual = keeper.number("residual", self.residual, 0)
        self.error = keeper.value("error", self.error, maybe_size)
        self.joining = dict(joins)
        self.force = dict(force)
        self._touching = frozenset(touching)
        if sum(count for _, _, count in onsets) > MOST_ONSETS:
            raise ValueError(f"'onsets' are more than {MOST_ONSETS}")
        self.unintended = [(a, b) for a, b, count in onsets for _ in range(count)]

    def _joined(self, one: int, other: int) -> str | None:
        """The label of the operation that is joining the parts of two geoms, None for none."""
        a, b = self._m.geom_bodyid[[one, other]].tolist()
        unit, code = self._masks.unit, self._masks.code
        if unit[a] < 0 or unit[a] != unit[b]:
            return None
        for number, worked_on in self.joining.items():
            operation = self._model.factory.operations[number]
            if unit[a] == worked_on and {code[a] - 1, code[b] - 1} <= {*operation.robots}:
                return operation.label
        return None

    def _press(self, label: str, contact: int) -> None:
        wrench = np.zeros(6)
        mujoco.mj_contactForce(self._m, self._d, contact, wrench)
        force = float(np.linalg.norm(wrench[:3]))
        self.force[label] = max(self.force.get(label, 0.0), force)

    def measure(self, bodies: np.ndarray, misfit: float) -> None:
        """Keep the error of a finished product, and how far off [m] its parts were when they became
        one body."""
        self.error = max(self.error or 0.0, self._product.measure(self._d, bodies), misfit)

    def figures(self, welds: Welds, strength: StrengthUse | None = None) -> PhysicsFigures:
        """The figures of the run so far; `strength`: the largest share of a hand's strength that
        was used."""
        pairs = dict.fromkeys(f"{a} - {b}" for a, b in self.unintended)
        pads = welds.pads.largest
        return PhysicsFigures(
            welds.taken.count,
            1e3 * welds.taken.gap,
            1e3 * self.residual,
            None if self.error is None else 1e3 * self.error,
            len(self.unintended),
            int(sum(w.number for w in self._d.warning)),
            tuple(pairs),
            dict(self.force),
            comb(len(self._model.factory.leaves), 2),
            self._model.excluded,
            bool(self._model.carried.wholes),
            float(self._m.opt.timestep),
            grip_gap_max_mm=None if pads is None else 1e3 * pads,
            joining_error_max_mm=1e3 * welds.taken.off,
            grip_strength_share_max=None if strength is None else strength.share,
            grip_strength_robot=None if strength is None else strength.robot,
            grip_strength_label=None if strength is None else strength.label,
        )
