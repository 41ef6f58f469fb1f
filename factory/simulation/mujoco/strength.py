"""How much of the strength of hands their loads use, as measured, and which hands let go.

A weld holds a body at its centre of mass. Its force and torque are the same load as a force and a
moment about the middle of the tips, which is what tips bear: a hand that holds far from the centre
of mass bears the moment of the weight, too. All of it is of where the engine's last step began.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from factory.control.mode import Array, Index
from factory.layout.hands.hand import Hand, Kind
from factory.layout.hands.tips import TipName, tip
from factory.layout.layout import Layout
from factory.mjcf.model import Model
from factory.simulation.world import Drop
from factory.support.engine import mujoco
from factory.support.errors import Diagnostic

UPWARDS: Mapping[Kind, float] = {"below": 1.0, "above": -1.0, "behind": 0.0}
"""How far up it is from the face of a tip to its payload, by the kind of hand."""

STRONGER = "hold it elsewhere or by another tip, drive it slower, or make it lighter"


@dataclass(frozen=True, slots=True)
class StrengthUse:
    """The `share` of the strength of a hand that its load used, the name of its `robot` and the
    `label` of what it held."""

    share: float
    robot: str
    label: str


class Strength:
    """The hands of a model's robots, whose grips are `welds` by robot (index) and label of a body.

    `most`: where the largest share of a hand's strength was used, None while there is no hand, or
    nothing in any. `dropped`: the first that was too weak, None while none was.
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
        self._tips = Tips.of(model.layout)
        number = {robot: n for n, robot in enumerate(self._tips.robots)}
        held = {weld: key for key, weld in welds.items() if key[0] in number}
        self._body = {weld: label for weld, (_, label) in held.items()}
        self._welds = np.array([*held], np.intp)
        self._hand = np.array([number[robot] for robot, _ in held.values()], np.intp)
        centres = np.array([model.carried.centre[label] for _, label in held.values()])
        self._arm = centres.reshape(-1, 3) - self._tips.middle[self._hand]
        self._dofs = m.jnt_dofadr[m.body_jntadr][:, None] + np.arange(6)

    def look(self) -> Index:
        """Measure all hands that hold something, after a step in which the welds were as they are
        now. Gives the welds of those whose load is more than they bear."""
        on = np.flatnonzero(self._d.eq_active[self._welds])
        if not len(on) or not self._d.ne:
            return on[:0]
        hand = self._hand[on]
        shares = self._tips.shares(self._loads(on, hand))
        worst = int(hand[shares[hand].argmax()])
        if self.most is None or shares[worst] > self.most.share:
            self.most = self._use(worst, float(shares[worst]), on)
        if shares[worst] <= 1.0:
            return on[:0]
        if self.dropped is None:
            self.dropped = self._drop(worst, self._use(worst, float(shares[worst]), on))
        return np.asarray(self._welds[on[shares[hand] > 1.0]])

    def _loads(self, on: Index, hand: Index) -> Array:
        """The forces [N] and the moments about the middle of the tips [Nm] that the bodies of some
        grips, in these hands, exert on each hand (hands, 6). Of all constraints only welds count:
        what else touches a body is a load."""
        m, d = self._m, self._d
        pull, found = np.zeros(d.nefc), np.zeros(m.nv)
        pull[: d.ne] = d.efc_force[: d.ne]
        mujoco.mj_mulJacTVec(m, d, found, pull)
        bodies = m.eq_obj2id[self._welds[on]]
        wrench = found[self._dofs[bodies]]
        force, arm = wrench[:, :3], self._arm[on]
        # a free body's force is in the frame of the world, its torque in its own
        torque = (d.xmat[bodies].reshape(-1, 3, 3) @ wrench[:, 3:, None])[:, :, 0]
        ahead, behind = [1, 2, 0], [2, 0, 1]
        wrench[:, 3:] = torque + arm[:, ahead] * force[:, behind] - arm[:, behind] * force[:, ahead]
        loads = np.zeros((len(self._tips.robots), 6))
        np.subtract.at(loads, hand, wrench)
        return loads

    def _use(self, hand: int, share: float, on: Index) -> StrengthUse:
        """What a hand holds, and how much of its strength that uses."""
        robot, model = self._tips.robots[hand], self._model
        bodies = [self._body[weld] for weld in self._welds[on[self._hand[on] == hand]].tolist()]
        parts = {part for body in bodies for part in model.carried.parts(body)}
        whole = (
            model.factory.operations[number].label
            for number in model.factory.robots[robot].operations
            if parts == {*model.factory.contents.get(model.factory.operations[number].label, ())}
        )
        return StrengthUse(share, model.factory.robots[robot].name, next(whole, bodies[0]))

    def _drop(self, hand: int, use: StrengthUse) -> Drop:
        """What is said of a hand that lets go."""
        shape, now = self._tips.hands[hand], float(self._d.time)
        tips = f"{'two' if len(shape.places) > 1 else 'a'} {shape.tip}"
        message = (
            f"{use.robot} drops '{use.label}' at {now:.2f} s: the load is {use.share:.3g} times"
            f" what its hand bears ({tips}, radius {1e3 * shape.radius:g} mm)"
        )
        where = self._model.factory.by_label[use.label].position
        return Drop(now, Diagnostic("Dropped", message, where, STRONGER))


@dataclass(frozen=True, eq=False)
class Tips:
    """The tips of n `hands`, of these `robots` (index): from them to the payload `outward` (n, 3),
    their `radius` (n,), from one to the other `apart` (n, 3), and their `middle` (n, 3) in the
    frame of the product [m]; `covered` (n,): which share of them has the surface before it.
    `alike`: the hands (their numbers) with a tip of a name."""

    hands: tuple[Hand, ...]
    robots: tuple[int, ...]
    outward: Array
    radius: Array
    apart: Array
    middle: Array
    covered: Array
    alike: Mapping[TipName, Index]

    @classmethod
    def of(cls, layout: Layout) -> Tips:
        """Those of a layout's robots that have any."""
        found = {
            robot: hand
            for robot, hand in enumerate(layout.hands)
            if hand is not None and hand.kind != "none"
        }
        hands = tuple(found.values())
        ends = np.array([(hand.places[0], hand.places[-1]) for hand in hands]).reshape(-1, 2, 3)
        alike: dict[TipName, list[int]] = {}
        for number, hand in enumerate(hands):
            alike.setdefault(hand.tip, []).append(number)
        ahead = [
            (*layout.guidepaths[robot].heading, 0.0) if hand.kind == "behind" else (0.0, 0.0, 0.0)
            for robot, hand in found.items()
        ]
        up = [(0.0, 0.0, UPWARDS[hand.kind]) for hand in hands]
        return cls(
            hands,
            tuple(found),
            np.array(ahead).reshape(-1, 3) + np.array(up).reshape(-1, 3),
            np.array([hand.radius for hand in hands]),
            ends[:, 1] - ends[:, 0],
            ends.mean(axis=1),
            np.array([hand.covered for hand in hands]),
            {name: np.array(numbers) for name, numbers in alike.items()},
        )

    def shares(self, loads: Array) -> Array:
        """The share (n,) of their strength that loads (n, 6) use, forces [N] before moments
        [Nm]."""
        found = np.zeros(len(self.hands))
        for name, which in self.alike.items():
            force, moment = loads[which, :3], loads[which, 3:]
            shape = self.outward[which], self.radius[which], self.apart[which]
            found[which] = tip(name).used(*shape, force, moment)
        return found / self.covered
