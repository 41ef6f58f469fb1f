"""Which holder has which part, for which unit: one table, from which welds and contact masks
follow."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Set
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from factory.engine.mjcf import names
from factory.engine.mjcf.grips import grips_of
from factory.engine.mjcf.masks import NOBODY, feeder_codes, robot_code, tray_code
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.parts import parked_at
from factory.engine.simulation.mujoco.welds import Welds
from factory.floor.layout.feeding import outlets_of
from factory.support.arrays import Index
from factory.support.engine import mujoco

NOTHING: Mapping[str, int] = MappingProxyType({})


class HeldPart(NamedTuple):
    """A part in the factory.

    Attributes:
        label: its label.
        unit: the unit that it is for.
        holder: the code of its holder: a robot, the tray or a feeder; NOBODY while it falls or
            lies about.
    """

    label: str
    unit: int
    holder: int


class Holdings:
    """The parts of a factory by body, each with its holder. Those in no unit are spares, parked out
    of sight.

    Attributes:
        body: by label, all bodies (copies,).
        free: by label, the bodies to spare, the next first.
        weld: by the code of a holder and a label, the weld that holds such a part there.
        parking: by body, the weld that parks it, and the position of that [m].
        changes: how often a part has changed its holder.
        returns: how often a part has been parked.
    """

    def __init__(
        self, m: mujoco.MjModel, model: Model, body: Mapping[str, Index], welds: Welds
    ) -> None:
        self.body, self._welds, self._mass = body, welds, model.carried.mass
        self.free = {label: deque(map(int, ids)) for label, ids in body.items()}
        self.weld, self._tray = _welds(m, model), tray_code(model.factory)
        self.changes = self.returns = 0
        self._of: dict[int, HeldPart] = {}
        self._present: dict[tuple[str, int], int] = {}
        self._held: dict[int, dict[str, int]] = {}
        copies = [(label, n, int(b)) for label, ids in body.items() for n, b in enumerate(ids, 1)]
        self.parking = {
            each: (m.equality(names.park(label, n)).id, parked_at(model.layout, label, n))
            for label, n, each in copies
        }
        for each in self.parking:
            self._hide(each)
        self._welds.open(w for (holder, _), w in self.weld.items() if holder >= self._tray)

    def __contains__(self, part: tuple[str, int]) -> bool:
        return part in self._present

    def __getitem__(self, part: tuple[str, int]) -> int:
        """The body of a label in a unit."""
        return self._present[part]

    def of(self, body: int) -> HeldPart:
        """The label, unit and holder of a body in the factory."""
        return self._of[body]

    def rows(self) -> Iterator[tuple[int, HeldPart]]:
        """All bodies in the factory, in the order of their coming."""
        return iter(self._of.items())

    @property
    def holders(self) -> Set[int]:
        """The codes of holders that have something."""
        return self._held.keys()

    def held(self, holder: int) -> Mapping[str, int]:
        """The bodies of a holder (code), by label."""
        return self._held.get(holder, NOTHING)

    def unit(self, holder: int) -> int | None:
        """The unit of a holder's parts (code); None if it has nothing."""
        body = next(iter(self.held(holder).values()), None)
        return None if body is None else self._of[body].unit

    @staticmethod
    def code(robot: int) -> int:
        """The code of a robot (index) as a holder."""
        return robot_code(robot)

    def hand(self, robot: int) -> Mapping[str, int]:
        """The bodies in a robot's hand (index), by label."""
        return self.held(robot_code(robot))

    def in_hands(self) -> dict[int, Mapping[str, int]]:
        """The bodies in each robot's hand (index), by label."""
        return {code - 1: held for code, held in self._held.items() if code < self._tray}

    def loads(self) -> dict[int, float]:
        """Mass of each robot's payload (index) [kg]."""
        held = self.in_hands().items()
        return {robot: sum(self._mass[label] for label in bodies) for robot, bodies in held}

    def grips(self) -> dict[tuple[int, str], int]:
        """The welds by which robots hold parts, by robot (index) and label."""
        return {(code - 1, label): w for (code, label), w in self.weld.items() if code < self._tray}

    def welds(self) -> Iterator[tuple[int, int]]:
        """All welds by which holders hold parts, each with the code of its holder."""
        return ((weld, holder) for (holder, _), weld in self.weld.items())

    def take(self, label: str, unit: int, holder: int) -> int:
        """Give a spare part to a holder (code), for a unit. Returns its body."""
        body = self.free[label].popleft()
        self._welds.open([self.parking[body][0]])
        self._enter(body, HeldPart(label, unit, NOBODY))
        self._set_holder(body, holder)
        self._welds.close({self.weld[holder, label]: body})
        return body

    def move(self, bodies: Iterable[int], holder: int) -> None:
        """Hand bodies over to a holder (code). The gaps of its grips are measured."""
        for body in [*bodies]:
            self._let_go(body)
            self._set_holder(body, holder)
            self._welds.close_and_measure({self.weld[holder, self._of[body].label]: body})

    def drop(self, holder: int) -> dict[str, int]:
        """Release all bodies of a holder (code), which fall; returns them by label. They collide
        with each other, too, from now on."""
        bodies = dict(self.held(holder))
        for body in bodies.values():
            self._let_go(body)
        return bodies

    def put_away(self, bodies: Iterable[int]) -> None:
        """Park bodies as spares, out of sight."""
        for body in [*bodies]:
            self.returns += 1
            self._let_go(body)
            self._leave(body)
            self._hide(body)
            self.free[self._of.pop(body).label].append(body)

    def assign(self, units: Mapping[int, int]) -> None:
        """Assign bodies to other units."""
        for body in units:
            self._leave(body)
        for body, unit in units.items():
            self._enter(body, self._of[body]._replace(unit=unit))

    def _enter(self, body: int, holding: HeldPart) -> None:
        self._of[body] = holding
        self._present[holding.label, holding.unit] = body
        self._welds.masks.enter(holding.label, holding.unit, body)

    def _leave(self, body: int) -> None:
        label, unit, _ = self._of[body]
        del self._present[label, unit]
        self._welds.masks.leave(label, body)

    def _set_holder(self, body: int, holder: int) -> None:
        self.changes += 1
        holding = self._of[body] = self._of[body]._replace(holder=holder)
        self._held.setdefault(holder, {})[holding.label] = body
        self._welds.set_holder([body], holder)

    def _let_go(self, body: int) -> None:
        """Release a body from its holder."""
        label, _, holder = self._of[body]
        if holder == NOBODY:
            return
        self.changes += 1
        del self._held[holder][label]
        if not self._held[holder]:
            del self._held[holder]
        self._welds.open([self.weld[holder, label]])
        self._of[body] = self._of[body]._replace(holder=NOBODY)

    def _hide(self, body: int) -> None:
        weld, place = self.parking[body]
        self._welds.place(body, place)
        self._welds.set_holder([body], NOBODY)
        self._welds.close({weld: body})


def _welds(m: mujoco.MjModel, model: Model) -> dict[tuple[int, str], int]:
    """The weld by which each holder (code) holds a label: robots first, then the tray, then
    feeders."""
    factory, outlets, weld_names = (
        model.factory,
        outlets_of(model.layout),
        dict[tuple[int, str], str](),
    )
    for grip in grips_of(model.layout, model.carried):
        name = names.grip(factory.robots[grip.robot].name, grip.label)
        weld_names[robot_code(grip.robot), grip.label] = name
    for product in factory.products:
        for label in model.carried.carried[product]:
            weld_names[tray_code(factory), label] = names.hold(label)
    codes = feeder_codes(factory, outlets)
    weld_names |= {
        (codes[outlet.robot], outlet.label): names.feed(outlet.label) for outlet in outlets
    }
    return {part: m.equality(name).id for part, name in weld_names.items()}


def copies_of(m: mujoco.MjModel, model: Model) -> dict[str, Index]:
    """The bodies of each label, by number in the engine's model."""
    return {
        label: np.array([m.body(names.part(label, n + 1)).id for n in range(count)])
        for label, count in model.copies.items()
    }
