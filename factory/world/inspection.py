"""What is measured in the engine while a factory runs: gaps, residuals, contacts, finished
products."""

from __future__ import annotations

import numpy as np

from factory.engine import mujoco
from factory.factory import Operation
from factory.mjcf.model import Model
from factory.trace import PhysicsFigures
from factory.world.contacts import Contacts
from factory.world.gaps import Gaps


class Inspection:
    """Keeps the worst figures of a run. Contacts are looked at after every step of the engine."""

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, model: Model, held: Contacts, gaps: Gaps
    ) -> None:
        self.m, self.d, self.model, self.held, self.gaps = m, d, model, held, gaps
        self.joining: dict[int, int] = {}
        self.force: dict[str, float] = {}
        self.handoffs = 0
        self.residual = 0.0
        self.error: float | None = None
        self.unintended: list[tuple[str, str]] = []
        self._touching: frozenset[tuple[int, int]] = frozenset()
        self._wrench = np.zeros(6)
        solids, bodies = model.layout.product.solids, model.carried
        found = bodies.carried[model.factory.pag.root]
        corners = [
            np.concatenate([solids[part].corners for part in bodies.parts(body)]) for body in found
        ]
        self._owner = np.repeat(np.arange(len(found)), [len(points) for points in corners])
        self._nominal = np.concatenate(corners) - bodies.centre[found[0]]
        places = np.array([bodies.centre[body] for body in found])
        self._local = np.concatenate(corners) - places[self._owner]

    def welds(self) -> None:
        """Keep the largest residual of the active welds' positions."""
        rows = self.d.ne
        if rows:
            position = self.d.efc_pos[:rows].reshape(-1, 6)[:, :3]
            self.residual = max(self.residual, float(np.abs(position).max()))

    def tick(self) -> None:
        """A tick is over. What touched may be apart: a step without contacts is not looked at."""
        if self._touching and not self.d.ncon:
            self._touching = frozenset()

    def started(self, operation: Operation, unit: int) -> None:
        """The inputs of an operation are being joined from now on."""
        self.joining[operation.index] = unit

    def ended(self, operation: Operation) -> None:
        """They are joined."""
        self.joining.pop(operation.index, None)

    def contacts(self) -> None:
        """Keep the forces between inputs that are being joined, and count the onsets of all other
        contacts: nothing intends those."""
        pairs = self.d.contact.geom[: self.d.ncon]
        now = set()
        for number in np.flatnonzero(self.d.contact.dist[: self.d.ncon] < 0).tolist():
            a, b = (int(geom) for geom in pairs[number])
            operation = self._joined(a, b)
            if operation is None:
                now.add((a, b))
            else:
                self._press(operation, number)
        for a, b in sorted(now - self._touching):
            self.unintended.append((self.m.geom(a).name, self.m.geom(b).name))
        self._touching = frozenset(now)

    def _joined(self, one: int, other: int) -> str | None:
        """The label of the operation that is joining the parts of two geoms, None for none."""
        a, b = (int(self.m.geom_bodyid[geom]) for geom in (one, other))
        unit, code = self.held.unit, self.held.code
        if unit[a] < 0 or unit[a] != unit[b]:
            return None
        for number, worked_on in self.joining.items():
            operation = self.model.factory.operations[number]
            if unit[a] == worked_on and {code[a] - 1, code[b] - 1} <= {*operation.robots}:
                return operation.label
        return None

    def _press(self, label: str, contact: int) -> None:
        mujoco.mj_contactForce(self.m, self.d, contact, self._wrench)
        force = float(np.linalg.norm(self._wrench[:3]))
        self.force[label] = max(self.force.get(label, 0.0), force)

    def measure(self, bodies: np.ndarray) -> float:
        """The largest displacement [m] of any vertex of any part from its place in the product,
        after a rigid fit on the first part."""
        turn = self.d.xmat[bodies].reshape(-1, 3, 3)
        here = (
            np.einsum("nij,nj->ni", turn[self._owner], self._local)
            + self.d.xpos[bodies][self._owner]
        )
        fitted = (here - self.d.xpos[bodies[0]]) @ turn[0]
        return float(np.linalg.norm(fitted - self._nominal, axis=1).max())

    def measured(self, bodies: np.ndarray, misfit: float) -> None:
        """Keep the error of a finished product, and how far off [m] its parts were when they became
        one body."""
        self.error = max(self.error or 0.0, self.measure(bodies), misfit)

    def figures(self) -> PhysicsFigures:
        """The figures of the run so far."""
        pairs = dict.fromkeys(f"{a} - {b}" for a, b in self.unintended)
        return PhysicsFigures(
            self.handoffs,
            1e3 * self.gaps.largest(),
            1e3 * self.residual,
            None if self.error is None else 1e3 * self.error,
            len(self.unintended),
            int(sum(w.number for w in self.d.warning)),
            tuple(pairs),
            dict(self.force),
            self.model.excluded,
            bool(self.model.carried.wholes),
            float(self.m.opt.timestep),
        )
