"""The finished product against its geometry: position and angle of every part."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index
from factory.mjcf import names
from factory.mjcf.model import Model
from factory.mjcf.weld_frames import HOLD
from factory.simulation.mujoco.fusing import angles
from factory.study.fidelity.readings import ActiveWelds
from factory.study.fidelity.record import Misplaced


class Finished:
    """The worst displacement of every part over all products, after a rigid fit on the first."""

    def __init__(self, model: Model) -> None:
        product = model.layout.product
        contents = model.factory.contents
        found = [contents[label] for label in model.factory.products]
        self.parts = found[0]
        self._number = {part: n for parts in found for n, part in enumerate(parts)}
        solids = [product.solids[part] for part in self.parts]
        self._centres = np.array([s.centre for s in solids]) - solids[0].centre
        counts = [len(s.corners) for s in solids]
        self._owner = np.repeat(np.arange(len(solids)), counts)
        self._local = np.concatenate([s.corners - s.centre for s in solids])
        self._starts = np.cumsum([0, *counts[:-1]])
        self.position = np.zeros(len(solids))
        self.angle = np.zeros(len(solids))
        self.vertex = np.zeros(len(solids))
        self.products = 0
        self._held: Index | None = None

    def tick(self, welds: ActiveWelds, fresh: Index, xpos: Array, xmat: Array) -> None:
        """Welds have been switched, with bodies at `xpos`, `xmat`, those in `fresh` on. A product
        is measured when the outfeed takes it and when it has gone."""
        if self._held is not None and not (welds.kind[self._held] == HOLD).all():
            self.measure(self._held, xpos, xmat)
            self._held = None
        held = welds.target[fresh[welds.kinds[fresh] == HOLD]]
        if len(held):
            labels = [names.label_of(welds.m.body(int(body)).name) for body in held]
            self._held = held[np.argsort([self._number[label] for label in labels])]
            self.measure(self._held, xpos, xmat)

    def measure(self, bodies: Index, xpos: Array, xmat: Array) -> None:
        """A product made of `bodies`, in the order of `parts`."""
        turn = xmat[bodies].reshape(-1, 3, 3)
        turn = turn[0].T @ turn
        place = (xpos[bodies] - xpos[bodies[0]]) @ xmat[bodies[0]].reshape(3, 3)
        off = place - self._centres
        spin = np.einsum("nij,nj->ni", turn[self._owner] - np.eye(3), self._local)
        far = np.linalg.norm(off[self._owner] + spin, axis=1)
        self.position = np.maximum(self.position, np.linalg.norm(off, axis=1))
        self.angle = np.maximum(self.angle, angles(turn))
        self.vertex = np.maximum(self.vertex, np.maximum.reduceat(far, self._starts))
        self.products += 1

    def found(self) -> tuple[Misplaced, ...]:
        """Every part at its worst; none where no product was finished."""
        if not self.products:
            return ()
        rows = zip(
            self.parts,
            1e3 * self.position,
            np.degrees(self.angle),
            1e3 * self.vertex,
            strict=True,
        )
        return tuple(Misplaced(part, float(p), float(a), float(v)) for part, p, a, v in rows)
