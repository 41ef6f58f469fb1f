"""Copies of bodies: which copy is in which unit, and which are to spare, parked out of sight."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping

import numpy as np

from factory.mjcf import names
from factory.mjcf.masks import NOBODY
from factory.mjcf.model import Model
from factory.mjcf.parts import parked_at
from factory.simulation.mujoco.welds import Welds
from factory.support.engine import mujoco


class Copies:
    """The bodies of each label, `body[label]` (copies,); `free`: numbers of those to spare."""

    def __init__(
        self, m: mujoco.MjModel, model: Model, body: dict[str, np.ndarray], welds: Welds
    ) -> None:
        self.body, self._welds = body, welds
        self.free = {label: deque(range(len(ids))) for label, ids in body.items()}
        spares = [(label, n) for label, ids in body.items() for n in range(len(ids))]
        self._park = {(k, n): m.equality(names.park(k, n + 1)).id for k, n in spares}
        self._at = {(k, n): parked_at(model.layout, k, n + 1) for k, n in spares}
        self._number: dict[tuple[str, int], int] = {}
        for label, copy in spares:
            self._put_away(label, copy)

    def __contains__(self, part: tuple[str, int]) -> bool:
        return part in self._number

    def __getitem__(self, part: tuple[str, int]) -> int:
        """The body of a label in a unit."""
        label, unit = part
        return int(self.body[label][self._number[label, unit]])

    def of(self, labels: Iterable[str], unit: int) -> dict[str, int]:
        """The bodies of labels in a unit."""
        return {label: self[label, unit] for label in labels}

    def take(self, label: str, unit: int) -> int:
        """Take a free copy into the factory for a unit; gives its body."""
        copy = self._number[label, unit] = self.free[label].popleft()
        self._welds.loose([self._park[label, copy]])
        body = self[label, unit]
        self._welds.masks.enter(label, unit, body)
        return body

    def put_back(self, label: str, unit: int) -> None:
        """Put the copy of a unit out of sight again."""
        copy = self._number.pop((label, unit))
        self._welds.masks.leave(label, unit)
        self._put_away(label, copy)
        self.free[label].append(copy)

    def renumber(self, units: Mapping[tuple[str, int], int]) -> None:
        """Copies are for other units from now on, by label and the unit that they were for."""
        bodies = {part: self[part] for part in units}
        copies = {part: self._number.pop(part) for part in units}
        for label, unit in units:
            self._welds.masks.leave(label, unit)
        for (label, old), new in units.items():
            self._number[label, new] = copies[label, old]
            self._welds.masks.enter(label, new, bodies[label, old])

    def _put_away(self, label: str, copy: int) -> None:
        body = int(self.body[label][copy])
        self._welds.place(body, self._at[label, copy])
        self._welds.hold([body], NOBODY)
        self._welds.join({self._park[label, copy]: body})


def copies_of(m: mujoco.MjModel, model: Model) -> dict[str, np.ndarray]:
    """The bodies of each label, by number in the engine's model."""
    return {
        label: np.array([m.body(names.part(label, n + 1)).id for n in range(count)])
        for label, count in model.copies.items()
    }
