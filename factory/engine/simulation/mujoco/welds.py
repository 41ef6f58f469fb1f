"""Switches the welds of a run, and places bodies.

All changes between two steps of the engine are gathered, and `Welds.write` writes them at once. No
other function of a run switches a weld (`eq_active`) or aims one (`eq_obj2id`). Which welds are
closed, and on which bodies, follows from who holds what (`holdings.py`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.engine.mjcf.pads import Pads
from factory.engine.mjcf.weld_frames import WeldFrames
from factory.engine.simulation.mujoco.contacts import ContactMasks
from factory.engine.simulation.mujoco.fusing import rotations
from factory.engine.simulation.mujoco.model_arrays import ModelArrays
from factory.engine.simulation.mujoco.sleep import Sleep
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

Place = tuple[float, float, float]


class Takeovers:
    """Measurements of hand-overs: how far off a body was when the weld of its new holder closed.

    Args:
        m: the engine's model.
        d: its data, whose kinematics are up to date.
        radii: largest distance of a vertex from its body's origin [m] (nbody,).

    Attributes:
        count: number of bodies handed over.
        gap: largest distance between the two frames that a weld joined [m].
        turn: largest angle between them [rad].
        off: largest displacement of a vertex by its weld, turns included [m].
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, radii: Array) -> None:
        self.count, self.gap, self.turn, self.off = 0, 0.0, 0.0, 0.0
        self._d, self._frames, self._radii = d, WeldFrames.of(m, d), radii
        self._qpos = m.jnt_qposadr[m.body_jntadr][:, None] + np.arange(7)

    def measure(self, welds: Index, bodies: Index) -> None:
        """Measure bodies on which welds close, at their current places; `xpos` belongs to the start
        of the last step."""
        q, frames = self._d.qpos, self._frames.chosen(welds)
        pose = q[self._qpos[bodies]]
        gap = np.linalg.norm(pose[:, :3] - frames.at(q[frames.along]), axis=1)
        turn = frames.turned(q[frames.along])
        sine = np.sqrt(np.maximum(0.0, 1.0 - (pose[:, 3:] * turn).sum(axis=1) ** 2))
        turned = 2 * sine * self._radii[bodies]
        self.count += len(welds)
        self.gap = max(self.gap, float(gap.max()))
        self.turn = max(self.turn, 2 * float(np.arcsin(np.minimum(sine.max(), 1.0))))
        self.off = max(self.off, float((gap + turned).max()))


class PadGaps:
    """Distances between holders' pads and their payloads. Pads are measured at a holder's first
    payload: welds are rigid, so further bodies bring the nearest no farther away.

    Attributes:
        largest: largest distance between the pads of a holder and the nearest of its bodies [m];
            None while no holder with pads has taken anything.
    """

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData) -> None:
        self.largest: float | None = None
        self._m, self._d = m, d
        self._frames = WeldFrames.of(m, d)
        self._pads = Pads(m)
        self._at_zero, self._turned = d.geom_xpos.copy(), rotations(m.geom_quat)
        self._stood = d.geom_xmat.reshape(-1, 3, 3).copy()
        self._welds = {h: np.flatnonzero(m.eq_obj1id == h) for h in self._pads.of}
        for holder, welds in self._welds.items():
            pads, weld = self._pads.of[holder], welds[0]
            moved = d.qpos[self._frames.along[weld]] @ self._frames.way[weld]
            self._at_zero[pads] = d.geom_xpos[pads] - moved

    def measure(self, on: Mapping[int, int]) -> None:
        """Measure welds that are about to close, each with its body. A holder that exchanges parts
        for their fused body has been measured before."""
        taken: dict[int, tuple[int, list[int]]] = {}
        for weld, body in on.items():
            holder = int(self._m.eq_obj1id[weld])
            if holder in self._pads.of and body in self._pads.solid:
                taken.setdefault(holder, (weld, []))[1].append(body)
        for holder, (weld, bodies) in taken.items():
            if not self._d.eq_active[self._welds[holder]].any():
                self._pads_of(holder, weld, bodies)

    def beside(self, jaws: Iterable[int], bodies: Sequence[int]) -> None:
        """Measure jaws (geoms) that have closed on bodies, each by itself."""
        geoms = self._pads.geoms(bodies)
        for jaw in jaws:
            self.largest = max(self.largest or 0.0, self._pads.nearest(self._d, [jaw], geoms))

    def _pads_of(self, holder: int, weld: int, bodies: Sequence[int]) -> None:
        m, d, pads, flat = self._m, self._d, self._pads.of[holder], np.empty(9)
        slides = d.qpos[self._frames.along[weld]][None]
        d.geom_xpos[pads] = self._at_zero[pads] + slides[0] @ self._frames.way[weld]
        if self._frames.deep[weld]:
            frame = self._frames.chosen(np.array([weld]))
            turn = rotations(frame.turned(slides))[0] @ rotations(frame.turn)[0].T
            off = self._at_zero[pads] - frame.base[0]
            d.geom_xpos[pads] = frame.at(slides)[0] + off @ turn.T
            d.geom_xmat[pads] = (turn @ self._stood[pads]).reshape(-1, 9)
        for body in bodies:
            geoms = self._pads.solid[body]
            at = m.jnt_qposadr[m.body_jntadr[body]] + np.arange(7)
            mujoco.mju_quat2Mat(flat, d.qpos[at[3:]])
            turn = flat.reshape(3, 3)
            d.geom_xpos[geoms] = d.qpos[at[:3]] + m.geom_pos[geoms] @ turn.T
            d.geom_xmat[geoms] = (turn @ self._turned[geoms]).reshape(-1, 9)
        apart = self._pads.apart(d, holder, self._pads.geoms(bodies))
        self.largest = max(self.largest or 0.0, apart)


@dataclass(slots=True)
class Gathered:
    """Changes that are not written yet. Welds and bodies are given by number in the engine's model.

    Attributes:
        on: welds to be closed, each with the body that it is to hold.
        off: welds to be opened.
        gripped: of `on`, those that hand a body over, so that they are measured.
        held: bodies whose holder changes, each with the code of the new one.
        placed: bodies to be placed, each with its position [m].
    """

    on: dict[int, int] = field(default_factory=dict)
    off: set[int] = field(default_factory=set)
    gripped: dict[int, int] = field(default_factory=dict)
    held: dict[int, int] = field(default_factory=dict)
    placed: dict[int, Place] = field(default_factory=dict)


class Welds:
    """The welds of a model, switched by `write`. Of several changes of a weld or body the last
    counts. Holders are given by their codes (`mjcf/masks.py`).

    Args:
        radii: largest distance of a vertex from its body's origin [m] (nbody,).

    Attributes:
        masks: the contact masks of parts, which follow from their holders.
        taken: measurements of hand-overs.
        pads: distances between holders' pads and their payloads.
        closed: when a weld was closed last [s].
    """

    def __init__(
        self, arrays: ModelArrays, d: mujoco.MjData, masks: ContactMasks, sleep: Sleep, radii: Array
    ) -> None:
        self.masks, m = masks, arrays.m
        self._frames, self._aims = arrays["eq_data"], arrays["eq_obj2id"]
        self._m, self._d, self._sleep = m, d, sleep
        mujoco.mj_kinematics(m, d)
        self.taken = Takeovers(m, d, radii)
        self.pads = PadGaps(m, d)
        self.closed = -np.inf
        self._next = Gathered()
        self._nominal: dict[int, Array] = {}

    def open(self, welds: Iterable[int]) -> None:
        """Open welds."""
        for weld in welds:
            self._next.on.pop(weld, None)
            self._next.gripped.pop(weld, None)
            self._next.off.add(weld)

    def close(self, welds: Mapping[int, int]) -> None:
        """Close welds, each on a body."""
        self._next.on.update(welds)

    def close_and_measure(self, welds: Mapping[int, int]) -> None:
        """Close the welds of bodies that are handed over, and measure how far off these are."""
        self.close(welds)
        self._next.gripped.update(welds)

    def set_holder(self, bodies: Iterable[int], holder: int) -> None:
        """Set the holder of parts, from which their contact masks follow. Switches no weld."""
        self._next.held.update(dict.fromkeys(bodies, holder))

    def place(self, body: int, at: Place) -> None:
        """Place a free body [m], at rest, in the orientation in which it is presented."""
        self._next.placed[body] = at

    def offset(self, weld: int, pose: Array) -> None:
        """Let a weld hold its body at another pose in its holder (7,), until it is closed again or
        its offset ended."""
        self._nominal.setdefault(weld, self._frames.now[weld, 3:10].copy())
        self._frames[weld, 3:10] = pose

    def end_offset(self, welds: Iterable[int]) -> None:
        """Let welds hold their bodies at their nominal poses again."""
        for weld in self._nominal.keys() & welds:
            self._frames[weld, 3:10] = self._nominal.pop(weld)

    def turn(self, body: int, quaternion: Array, aside: Array) -> None:
        """Turn a free body, displaced by `aside` (3,) [m]."""
        address = self._m.jnt_qposadr[self._m.body_jntadr[body]]
        self._d.qpos[address : address + 3] += aside
        self._d.qpos[address + 3 : address + 7] = quaternion
        self._d.xquat[body] = quaternion
        self._sleep.wake([body])

    def write(self) -> None:
        """Write all gathered changes into the engine, and wake the bodies concerned."""
        if self._next == Gathered():
            return
        self.end_offset(self._next.on)
        self._put()
        self.pads.measure(self._next.on)
        if self._next.gripped:
            welds, bodies = np.array([*self._next.gripped.items()]).T
            self.taken.measure(welds, bodies)
        m, d = self._m, self._d
        off, on = np.array([*self._next.off], np.intp), np.array([*self._next.on], np.intp)
        bodies = np.array([*self._next.on.values()], np.intp)
        loose = {*m.eq_obj2id[off[d.eq_active[off] != 0]].tolist()} - {*bodies.tolist()}
        touched = [m.eq_obj1id[off], m.eq_obj2id[off], m.eq_obj1id[on], bodies]
        d.eq_active[off] = False
        self._aims[on], d.eq_active[on] = bodies, True
        if len(on):
            self.closed = float(d.time)
        self._sleep.wake({*np.concatenate(touched).tolist(), *self._next.placed})
        self.masks.hold(self._next.held)
        self.masks.let_go(loose - self._next.held.keys())
        self._next = Gathered()

    def _put(self) -> None:
        """Place bodies; `xpos` too, which the engine renews in its next step."""
        if not self._next.placed:
            return
        bodies, at = np.array([*self._next.placed]), np.array([*self._next.placed.values()])
        joint, d = self._m.body_jntadr[bodies], self._d
        address = self._m.jnt_qposadr[joint][:, None] + np.arange(7)
        d.qpos[address] = np.hstack([at, self._m.qpos0[address[:, 3:]]])
        d.qvel[self._m.jnt_dofadr[joint][:, None] + np.arange(6)] = 0.0
        d.xpos[bodies] = at
