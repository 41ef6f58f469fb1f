"""Serial chains of hinge and slide joints: forward kinematics and Jacobians, many configurations at
once.

Frame 0 is that of the base. Frame j + 1 moves with joint j and has its origin at the joint's
anchor. A configuration is a vector of n joint positions, in radians for hinges and metres for
slides; functions take arrays (..., n) of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from factory.support.arrays import Array, Truth


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """The limits of n joints.

    Attributes:
        low: least position (n,) [rad, m].
        high: greatest position (n,) [rad, m].
        speed: greatest speed (n,) [rad/s, m/s].
        acceleration: greatest acceleration (n,) [rad/s², m/s²].
        torque: greatest torque or force of the drive (n,) [N m, N]; infinite where there is no
            limit.
    """

    low: Array
    high: Array
    speed: Array
    acceleration: Array
    torque: Array


@dataclass(frozen=True, slots=True, eq=False)
class LinkInertia:
    """The inertia of n links: of all that is rigidly joined to frame j + 1.

    Attributes:
        mass: (n,) [kg].
        center: centre of mass in the link's frame (n, 3) [m].
        moment: inertia tensor about the centre of mass, in the link's frame (n, 3, 3) [kg m²].
        weight: mass that its drives bear (n,), less what is compensated [kg].
        weight_center: centre of that mass in the link's frame (n, 3) [m].
        rotor: inertia of the drive, seen at the joint (n,) [kg m², kg].
    """

    mass: Array
    center: Array
    moment: Array
    weight: Array
    weight_center: Array
    rotor: Array


@dataclass(frozen=True, slots=True, eq=False)
class ConvexBody:
    """A convex body of a chain: the hull of points, grown by a radius.

    Attributes:
        name: unique in the chain.
        frame: number of the frame that it moves with; 0 for the base.
        points: in that frame (k, 3) [m].
        radius: [m].
    """

    name: str
    frame: int
    points: Array
    radius: float = 0.0


@dataclass(frozen=True, eq=False)
class SerialChain:
    """A serial chain of n joints from a fixed base to a tool.

    Attributes:
        joints: names of the joints (n,).
        slides: whether a joint is a slide (n,); a hinge otherwise.
        anchor: place of a joint in the frame before it (n, 3) [m].
        turn: orientation of a joint's frame in the frame before it, at `zero` (n, 3, 3).
        axis: unit vector along a joint's axis in its frame (n, 3).
        zero: positions at which `anchor` and `turn` hold (n,) [rad, m].
        tool_place: place of the tool in the last frame (3,) [m].
        tool_turn: orientation of the tool in the last frame (3, 3); its z points out of the tool.
        limits: those of the joints.
        inertia: that of the links.
        bodies: the convex bodies of base and links.
    """

    joints: tuple[str, ...]
    slides: Truth
    anchor: Array
    turn: Array
    axis: Array
    zero: Array
    tool_place: Array
    tool_turn: Array
    limits: JointLimits
    inertia: LinkInertia
    bodies: tuple[ConvexBody, ...] = ()

    def __len__(self) -> int:
        return len(self.joints)

    @cached_property
    def _turns(self) -> Array:
        """Matrices (3, n, 3, 3): a joint turns its frame by the first + sin q · the second +
        (1 - cos q) · the third (Rodrigues' formula)."""
        cross = cross_matrix(self.axis) * ~self.slides[:, None, None]
        return np.stack([self.turn, self.turn @ cross, self.turn @ cross @ cross])

    @cached_property
    def _slid(self) -> Array:
        """How far each frame goes in the frame before it per metre of its joint (n, 3); 0 for
        hinges."""
        return np.asarray(np.einsum("jab,jb->ja", self.turn, self.axis) * self.slides[:, None])

    def frames(self, q: Array) -> tuple[Array, Array]:
        """Origins (..., n + 1, 3) [m] and orientations (..., n + 1, 3, 3) of the frames.

        Args:
            q: configurations (..., n) [rad, m].
        """
        off = q - self.zero
        still, sine, versine = self._turns
        turned = np.sin(off)[..., None, None] * sine
        turned += (1 - np.cos(off))[..., None, None] * versine
        turned += still
        step = self.anchor + off[..., None] * self._slid
        place = np.zeros((*off.shape[:-1], len(self) + 1, 3))
        turn = np.zeros((*place.shape, 3))
        turn[..., 0, :, :] = np.eye(3)
        for j in range(len(self)):
            moved = (turn[..., j, :, :] @ step[..., j, :, None])[..., 0]
            place[..., j + 1, :] = place[..., j, :] + moved
            turn[..., j + 1, :, :] = turn[..., j, :, :] @ turned[..., j, :, :]
        return place, turn

    def tool(self, q: Array) -> tuple[Array, Array]:
        """Places (..., 3) [m] and orientations (..., 3, 3) of the tool in the base frame.

        Args:
            q: configurations (..., n) [rad, m].
        """
        place, turn = self.frames(q)
        return place[..., -1, :] + turn[..., -1, :, :] @ self.tool_place, (
            turn[..., -1, :, :] @ self.tool_turn
        )

    def jacobian(self, q: Array) -> Array:
        """Jacobians (..., 6, n) of the tool: its velocity [m/s], then its angular velocity [rad/s],
        per unit of joint speed.

        Args:
            q: configurations (..., n) [rad, m].
        """
        return self.tool_and_jacobian(q)[2]

    def tool_and_jacobian(self, q: Array) -> tuple[Array, Array, Array]:
        """What `tool` and `jacobian` give, at the price of one.

        Args:
            q: configurations (..., n) [rad, m].
        """
        place, turn = self.frames(q)
        tool = place[..., -1, :] + turn[..., -1, :, :] @ self.tool_place
        return tool, turn[..., -1, :, :] @ self.tool_turn, self._columns(place, turn, tool)

    def _columns(self, place: Array, turn: Array, at: Array) -> Array:
        """The Jacobian of points (..., 3) that all joints move."""
        axis = (turn[..., 1:, :, :] @ self.axis[..., None])[..., 0]
        arm = at[..., None, :] - place[..., 1:, :]
        slides = self.slides[:, None]
        line = np.where(slides, axis, cross(axis, arm))
        columns = np.concatenate([line, np.where(slides, 0.0, axis)], axis=-1)
        return np.swapaxes(columns, -1, -2)

    @cached_property
    def spans(self) -> Array:
        """Greatest distance of each frame's origin from that of the frame before (n,), whatever the
        configuration [m]."""
        ends = np.stack([self.limits.low, self.limits.high]) - self.zero
        places = self.anchor + ends[..., None] * self._slid
        return np.asarray(np.linalg.norm(places, axis=2).max(axis=0))

    @cached_property
    def length(self) -> float:
        """Length of the chain from its first joint to the tool [m]."""
        return float(self.spans[1:].sum() + np.linalg.norm(self.tool_place))

    def lever(self, frame: int, points: Array, radius: float = 0.0) -> Array:
        """Greatest speed (n,) of a point of a body per unit of each joint's speed, in all
        configurations [m/rad, 1]: for a hinge R_j, the length of the chain from it to the farthest
        point of the body; 1 for a slide; 0 for a joint that does not move the body.

        Args:
            frame: number of the frame that the body moves with.
            points: the body's points in the frame (k, 3) [m].
            radius: by which the body is grown [m].
        """
        far = float(np.linalg.norm(points, axis=1).max()) + radius
        lengths = [self.spans[j + 1 : frame].sum() + far for j in range(frame)]
        padded = np.array([*lengths, *[0.0] * (len(self) - frame)])
        return np.where(self.slides & (padded > 0.0), 1.0, padded)

    def levers(self, bodies: Sequence[ConvexBody] | None = None) -> Array:
        """`lever` of each body (bodies, n) [m/rad, 1].

        Args:
            bodies: those of the chain, unless others that move with its frames.
        """
        each = self.bodies if bodies is None else bodies
        rows = [self.lever(body.frame, body.points, body.radius) for body in each]
        return np.array(rows).reshape(len(rows), len(self))

    def with_payload(self, mass: float, center: Array, moment: Array) -> SerialChain:
        """The chain with a payload at its tool.

        Args:
            mass: of the payload [kg].
            center: its centre of mass in the tool's frame (3,) [m].
            moment: its inertia tensor about that centre, in the tool's frame (3, 3) [kg m²].
        """
        at = self.tool_place + self.tool_turn @ center
        tensor = self.tool_turn @ moment @ self.tool_turn.T
        return replace(self, inertia=add_load(self.inertia, mass, at, tensor))


def add_load(inertia: LinkInertia, mass: float, at: Array, moment: Array) -> LinkInertia:
    """The inertia of links of which the last bears a load.

    Args:
        inertia: that of the links without it.
        mass: of the load [kg].
        at: its centre of mass in the last link's frame (3,) [m].
        moment: its inertia tensor about that centre, in that frame (3, 3) [kg m²].
    """
    values = [np.array(getattr(inertia, name)) for name in LinkInertia.__slots__]
    masses, centers, moments, weights, weight_centers, rotor = values
    total = masses[-1] + mass
    middle = (masses[-1] * centers[-1] + mass * at) / total
    moments[-1] = moments[-1] + moment
    moments[-1] += steiner(masses[-1], centers[-1] - middle) + steiner(mass, at - middle)
    weight_centers[-1] = (weights[-1] * weight_centers[-1] + mass * at) / (weights[-1] + mass)
    weights[-1] += mass
    masses[-1], centers[-1] = total, middle
    return LinkInertia(masses, centers, moments, weights, weight_centers, rotor)


def steiner(mass: float, offset: Array) -> Array:
    """Inertia tensor (3, 3) of a point mass about the origin [kg m²].

    Args:
        mass: [kg].
        offset: its place (3,) [m].
    """
    return np.asarray(mass * (offset @ offset * np.eye(3) - np.outer(offset, offset)))


def cross_matrix(vectors: Array) -> Array:
    """The matrices (..., 3, 3) of the cross product with vectors from the left.

    Args:
        vectors: (..., 3).
    """
    x, y, z = np.moveaxis(vectors, -1, 0)
    o = np.zeros_like(x)
    rows = [[o, -z, y], [z, o, -x], [-y, x, o]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def cross(a: Array, b: Array) -> Array:
    """Cross products (..., 3), without the overhead of NumPy's.

    Args:
        a: (..., 3).
        b: (..., 3).
    """
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
