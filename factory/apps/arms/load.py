"""Whether an arm can bring a part: its drives have the torque, and the pad of its tool the pull."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.api import Diagnostic, Hand, RunError
from factory.apps.arms.burdens import Burden
from factory.apps.arms.cell import ToolGrip
from factory.apps.arms.chain import SerialChain, cross
from factory.apps.arms.crew import RAILS
from factory.apps.arms.dynamics import GRAVITY, PLACES, torque_share
from factory.apps.arms.joint_way import JointWay, WayLimits
from factory.support.arrays import Array

STEP = 1e-4
"""Between the places of a difference quotient [m]."""

AHEAD = np.array([0.0, 0.0, 1.0])
"""From a pad to its part, in the tool's frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Load:
    """A part that an arm brings on a way.

    Attributes:
        robot: the arm's name.
        label: of the part.
        burden: what it brings.
        grip: how it is held.
        chain: the arm with its tool, without the part.
        way: followed by it.
    """

    robot: str
    label: str
    burden: Burden
    grip: ToolGrip
    chain: SerialChain
    way: JointWay

    @property
    def center(self) -> Array:
        """The part's centre of mass in the tool's frame (3,) [m]."""
        return self.grip.local(self.burden.centre)

    @property
    def moment(self) -> Array:
        """Its inertia tensor about that centre, in the tool's frame (3, 3) [kg m²]."""
        return np.asarray(self.grip.turn.T @ self.burden.inertia @ self.grip.turn)

    def is_borne(self, pace: WayLimits, damping: Array) -> bool:
        """Whether neither a drive nor the tip of the tool needs more than it has (see `check`)."""
        needed = self.torques(pace, damping)
        return bool((needed <= 1.0).all()) and self.pull(pace) <= Hand.STRONG

    def check(self, pace: WayLimits, damping: Array) -> None:
        """Check that neither a drive nor the tip of the tool needs more than it has, anywhere on
        the way, at any speed and acceleration of a pace. Raises RunError (ArmLoad).

        Args:
            pace: limits of the way's coordinate.
            damping: of the joints (n,) [N m s/rad, N s/m].
        """
        slow = WayLimits(pace.speed / 2, pace.acceleration / 4)
        needed = self.torques(pace, damping)
        if (needed > 1.0).any():
            joint = int(needed.argmax())
            has = float(self.chain.limits.torque[joint])
            unit = "N" if self.chain.slides[joint] else "N m"
            said = (
                f"{self.chain.joints[joint]} needs {needed[joint] * has:.3g} of the {has:.3g}"
                f" {unit} that its drive has"
            )
            helps = bool((self.torques(slow, damping) <= 1.0).all())
            raise self._too_heavy(said, pace, self._most(pace, damping), slow if helps else None)
        used = self.pull(pace)
        if used > Hand.STRONG:
            what = {"suction": "pad", "pin": "pin"}[self.grip.kind]
            size = f"{1e3 * self.grip.radius:.3g} mm in radius"
            said = f"its {what}, {size}, bears {1 / used:.2g} times the load"
            helps = self.pull(slow) <= Hand.STRONG
            raise self._too_heavy(said, pace, self.burden.mass / used, slow if helps else None)

    def torques(self, pace: WayLimits, damping: Array, times: float = 1.0) -> Array:
        """Share (n,) of its limit that each drive needs, with so many times the part's mass."""
        mass, moment = times * self.burden.mass, times * self.moment
        loaded = self.chain.with_payload(mass, self.center, moment)
        return torque_share(loaded, self.way, pace, damping)

    def _most(self, pace: WayLimits, damping: Array) -> float:
        """The greatest mass that the drives can bring, shaped as the part is [kg]."""
        low, high = 0.0, 1.0
        for _ in range(20):
            middle = (low + high) / 2
            fits = (self.torques(pace, damping, middle) <= 1.0).all()
            low, high = (middle, high) if fits else (low, middle)
        return low * self.burden.mass

    def pull(self, pace: WayLimits) -> float:
        """Greatest share of the strength of the tool's tip that the part uses: by its
        weight, and by what it takes to accelerate and to turn it. It rests at both ends."""
        x = np.linspace(STEP, self.way.length - STEP, PLACES)
        (before, spun), (at, spin), (after, spins) = (self._moves(x + d) for d in (-STEP, 0, STEP))
        first, second = (after - before) / (2 * STEP), (after - 2 * at + before) / STEP**2
        turned = (spins - spun) / (2 * STEP)
        tool = np.swapaxes(self.chain.tool(self.way.at(x)[0])[1], -1, -2)
        run = np.minimum(x, self.way.length - x)  # from rest, and to rest
        most = np.minimum(pace.speed**2, 2 * pace.acceleration * run)[:, None]
        worst, radius = 0.0, np.array(self.grip.radius)
        for fast in (0.0 * most, most):
            for push in (-pace.acceleration, pace.acceleration):
                force = self.burden.mass * (GRAVITY - push * first - fast * second)
                force, twist = (
                    (tool @ v[..., None])[..., 0] for v in (force, -push * spin - fast * turned)
                )
                moment = twist + cross(np.broadcast_to(self.center, force.shape), force)
                used = Hand.tip_of(self.grip.kind).used(AHEAD, radius, np.zeros(3), force, moment)
                worst = max(worst, float(used.max()))
        return worst

    def _moves(self, x: Array) -> tuple[Array, Array]:
        """Place of the part's centre, and its angular momentum per unit of speed (m, 3), at
        coordinates (m,)."""
        q, first, _ = self.way.at(x)
        tip, tool, jacobian = self.chain.tool_and_jacobian(q)
        spin = (jacobian[:, 3:] @ first[..., None])[..., 0]
        tensor = tool @ self.moment @ np.swapaxes(tool, -1, -2)
        return tip + tool @ self.center, (tensor @ spin[..., None])[..., 0]

    def _too_heavy(
        self, said: str, pace: WayLimits, most: float, slow: WayLimits | None
    ) -> RunError:
        """What is said of a part that is too heavy at a pace: the greatest mass that is not, and
        a slower pace at which it is not, if it helps."""
        message = (
            f"{self.robot} brings '{self.label}' of {self.burden.mass:.3g} kg: {said}, at"
            f" {pace.speed:g} m/s and {pace.acceleration:g} m/s²"
        )
        mends = [f"a part of at most {most:.3g} kg", "another arm", RAILS]
        if slow:
            mends.insert(1, f"--speed {slow.speed:g} --acceleration {slow.acceleration:g}")
        return RunError(Diagnostic("ArmLoad", message, None, "; ".join(mends)))
