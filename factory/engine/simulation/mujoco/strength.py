"""The share of hands' strength that their loads use, as measured, and hands that let go.

A weld holds a body at its centre of mass. Its force and torque are equivalent to a force and a
moment about the middle of the tips, which is what tips bear: a hand far from the centre of mass
bears the moment of the weight too. All values belong to the start of the engine's last step.
Carriages keep their bodies' axes along those of the world; chains turn what they hold.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from factory.engine.mjcf.grips import grips_of
from factory.engine.mjcf.model import Model
from factory.engine.mjcf.weld_frames import ROWS
from factory.engine.simulation.world import Drop
from factory.floor.layout.hands.gauges import gauge, middle
from factory.floor.layout.hands.hand import Hand
from factory.floor.layout.hands.tips import TERMS, shares
from factory.support.arrays import Array, Index, Truth
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic

OFTEN = 0.09
"""Hands are not measured more often than once in this time [s]: a robot gains and loses its speed
within a quarter of a second, a lift within a tenth."""

CALM, SELDOM = 0.02, 0.5
"""Production repeats itself: where the largest share has not risen for a while they are measured
once in this part of that while, but in this time [s] at least."""

RISE = 1.01
"""A share that is so many times the largest before is news."""

STRONGER = "let its robot accelerate less (--acceleration), or make the parts lighter"


@dataclass(frozen=True, slots=True)
class StrengthUse:
    """The largest use of a hand's strength.

    Attributes:
        share: the share of the strength that the load used.
        robot: the robot, by name.
        label: what it held.
    """

    share: float
    robot: str
    label: str


class Strength:
    """The hands of a model's robots, whose grips are `welds` by robot (index) and label of a body.

    `most`: where the largest share of a hand's strength was used, None while nothing was in any
    hand. `dropped`: the first load that was too much, None while none was.
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        model: Model,
        welds: Mapping[tuple[int, str], int],
    ) -> None:
        self.most: StrengthUse | None = None
        self.dropped: Drop | None = None
        self._m, self._d, self._model = m, d, model
        held = {grip: self._hand_on(*grip) for grip in welds}
        self._hands = {grip: hand for grip, hand in held.items() if hand and hand.kind.holds}
        self._robots = np.array(sorted({robot for robot, _ in self._hands}), np.intp)
        self._grips = [(grip, weld) for grip, weld in welds.items() if grip in self._hands]
        # the last grip is of all welds that are no grips, and of no hand
        self._grip = np.full(m.neq, len(self._grips))
        self._grip[[weld for _, weld in self._grips]] = np.arange(len(self._grips))
        holders = np.array([robot for (robot, _), _ in self._grips], np.intp)
        self._hand = np.append(np.searchsorted(self._robots, holders), len(self._robots))
        chains = model.layout.chains
        self._turns = np.append(np.isin(holders, chains.robots if chains else ()), False)
        self._gauges = self._of_grips()
        self._next, self._risen = -np.inf, float(d.time)

    def look(self) -> list[int]:
        """Measure all hands that hold something and are awake, unless just done. Returns the welds
        of overloaded hands."""
        d = self._d
        if not self._grips or not d.ne or d.time < self._next:
            return []
        self._next = d.time + min(SELDOM, max(OFTEN, CALM * (d.time - self._risen)))
        welds = d.efc_id[: d.ne : ROWS]
        grips, force = self._grip[welds], d.efc_force[: d.ne].reshape(-1, ROWS, 1)
        # of all constraints only welds count: what else touches a body is a load
        if (turned := self._turns[grips]).any():
            force = self._in_bodies(force, turned, welds)
        terms = self._gauges[grips] @ force
        loads = np.zeros((len(self._robots) + 1, TERMS))
        np.add.at(loads, self._hand[grips], terms[:, :, 0])
        use = shares(loads[:-1])
        share = float(use.max())
        if self.most is None or share > self.most.share:
            self._keep(use, grips)
        if share <= 1.0:
            return []
        worst = int(use.argmax())
        if self.dropped is None:
            self.dropped = self._drop(worst, self._use(worst, share, grips), grips)
        weak = np.append(use > 1.0, False)[self._hand[grips]]
        return [self._grips[grip][1] for grip in grips[weak].tolist()]

    def _hand_on(self, robot: int, label: str) -> Hand | None:
        """The hand by which a robot holds a body."""
        layout = self._model.layout
        if layout.chains is not None and robot in layout.chains.robots:
            return layout.chains.hand(label)
        return layout.hand(robot)

    def _in_bodies(self, force: Array, turned: Truth, welds: Index) -> Array:
        """The rows of welds (n, 6, 1), with the forces of those that are `turned` (n,) in the
        frames of the bodies that they hold, as the rows of rotation are."""
        turn = self._d.xmat[self._m.eq_obj2id[welds[turned]]].reshape(-1, 3, 3)
        force = force.copy()
        force[turned, :3] = np.swapaxes(turn, -1, -2) @ force[turned, :3]
        return force

    def _keep(self, use: Array, grips: Index) -> None:
        """Keep the largest share."""
        holding = np.unique(self._hand[grips[grips < len(self._grips)]])
        if len(holding):
            worst = int(holding[use[holding].argmax()])
            if self.most is None or use[worst] > RISE * self.most.share:
                self._risen = float(self._d.time)
            self.most = self._use(worst, max(0.0, float(use[worst])), grips)

    def _of_grips(self) -> Array:
        """For each grip the map from the rows of its weld to the terms of strength (grips + 1, 11,
        6). Position rows are the opposite of the force on the body, rotation rows twice the
        opposite of the torque: together the load at the body's centre of mass, in the frame of the
        product."""
        terms = np.zeros((len(self._grips) + 1, TERMS, ROWS))
        layout = self._model.layout
        grips = {(grip.robot, grip.label): grip for grip in grips_of(layout, self._model.carried)}
        for number, (key, _) in enumerate(self._grips):
            grip, hand = grips[key], self._hands[key]
            load = np.diag([1.0, 1.0, 1.0, 0.5, 0.5, 0.5])
            at, tour = grip.centre - middle(hand), 0
            if not self._turns[number]:
                tour = grip.layout.factory.turns[grip.begins, grip.robot]
                first = grip.layout.factory.robots[grip.robot].operations[0]
                at[:2] += grip.visit.shift
                at[2] += grip.visit.height
                at[2] -= grip.layout.visits[first, grip.robot].height
            load[3:, :3] = np.cross(at, np.eye(3)).T
            heading = layout.guidepaths[grip.robot].heading
            if layout.chains is not None and self._turns[number]:
                heading = layout.chains.heading(grip.label)
            terms[number] = gauge(hand, heading, tour) @ load
        return terms

    def _use(self, number: int, share: float, grips: Index) -> StrengthUse:
        """The payload of the n-th hand, and the share of its strength used."""
        factory, carried = self._model.factory, self._model.carried
        robot = factory.robots[int(self._robots[number])]
        held = grips[self._hand[grips] == number].tolist()
        bodies = [self._grips[grip][0][1] for grip in held]
        parts = {part for body in bodies for part in carried.parts(body)}
        made = (factory.operations[operation].label for operation in robot.operations)
        whole = (label for label in made if parts == {*factory.contents.get(label, ())})
        return StrengthUse(share, robot.name, next(whole, bodies[0]))

    def _drop(self, number: int, use: StrengthUse, grips: Index) -> Drop:
        """The diagnostic of the n-th hand, which lets go."""
        factory, now, robot = self._model.factory, float(self._d.time), int(self._robots[number])
        held = next(grip for grip in grips.tolist() if self._hand[grip] == number)
        bears = _told(self._hands[self._grips[held][0]])
        message = (
            f"{use.robot} drops '{use.label}' at {now:.2f} s: the load is {use.share:.4g} times"
            f" what its hand bears ({bears})"
        )
        source = factory.by_label.get(use.label, factory.robots[robot])
        return Drop(now, Diagnostic("Dropped", message, source.position, STRONGER))


def _told(hand: Hand) -> str:
    """The grip of a hand, in words."""
    if hand.clamp is not None:
        return hand.clamp.words
    what = {"suction": "suction pad", "pin": "pin"}[hand.tip]
    tips = f"two {what}s" if len(hand.places) > 1 else f"a {what}"
    return f"{tips}, radius {1e3 * hand.radius:g} mm"
