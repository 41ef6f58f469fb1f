"""The ring plan: two robots on a tee, a guidepath in the shape of a Y, reach any goals on it.

The three edges of a tee meet in a vertex V: edge 0, the stem, and edges 1 and 2, its arms, which
lie on one line across the stem. A position is an edge and a depth, the distance from V along it.
Two square robots that do not turn are in Δ where they are nearer than `apart` along both axes.

The configurations outside Δ have twelve cells: six squares, in which the robots are on different
edges, and six fins, in which both are on one, one of them nearer to V. In a crossing a robot passes
V from one edge to another while the other robot stands by on its edge, deep enough to be clear.
Each crossing leads from one of two squares and a fin to another of these, so the squares are a ring
round the removed configuration (V, V), the annulus of Ghrist and Koditschek (2002), and the fins
are dead ends.

Theorem 15: on edges that are long enough to stand by on, both robots reach all goals that are clear
of each other, from every clear state, if they make the first crossing of a shortest path of cells
from that of the points where they would stop to that of their goals, again and again. The crossings
left become fewer with each; the robot that stands by recedes, which a reservation always admits;
and the one that crosses is then clear of it. Reservations alone keep the robots apart
(`tests.reservation`); the plan says who goes first. On a shorter edge nobody stands by:
the ring is cut there, and some goals cannot be reached.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations, product

import numpy as np

from factory.support.arrays import Array, Index, Truth
from factory.theory.control.mode import lock
from factory.theory.control.profile import landing_speed
from tests.reservation import drive, stopping

SPARE = 0.005
"""mu: a robot stands by so much deeper than it has to [m], more than a corner's overhang and a goal
ball."""

EDGES = np.array([[0.0, -1.0], [-1.0, 0.0], [1.0, 0.0]])
"""The directions of the stem and of the arms, away from V."""

CELLS = 12

GRAZING = 1e-4
"""So near to the end of a corner [m] a rounded way is the straight one, within 1e-7 m."""

ARRIVED, NO_WAY = -1, -2
"""In place of a crossing: none is left, or none leads to the goals."""


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Positions of n pairs of robots on a tee: `edge` (n, 2) and `depth` (n, 2) [m]."""

    edge: Index
    depth: Array

    @property
    def cell(self) -> Index:
        """The numbers of their cells (n,): 3 e + f of the edges e and f of both robots, and 9 + e
        of the fins in which the second robot is the nearer one to V."""
        one, other = self.edge.T
        second = (one == other) & (self.depth[:, 0] > self.depth[:, 1])
        return np.asarray(np.where(second, 9 + one, 3 * one + other))


@dataclass(frozen=True, slots=True, eq=False)
class TeeState:
    """n pairs of robots in motion on a tee. A robot is on a line from edge `back` through V to edge
    `front` (n, 2), at the coordinate `x` (n, 2) [m], minus the depth on the former and the depth on
    the latter, with the velocity `v` (n, 2) [m/s] along it."""

    back: Index
    front: Index
    x: Array
    v: Array

    @classmethod
    def at(cls, spots: Spots) -> TeeState:
        """Robots at rest."""
        back = np.array(spots.edge)
        return cls(back, (back + 1) % 3, -np.array(spots.depth), np.zeros(back.shape))

    @property
    def spots(self) -> Spots:
        """Where they are."""
        return self.on(self.x)

    def on(self, x: Array) -> Spots:
        """Where coordinates (n, 2) of their lines are."""
        return Spots(np.where(x <= 0.0, self.back, self.front), np.abs(x))

    def coordinates(self, spots: Spots) -> Array:
        """Those of positions on their lines (n, 2) [m]; NaN of positions that are elsewhere."""
        ahead = np.where(spots.edge == self.front, spots.depth, np.nan)
        return np.where(spots.edge == self.back, -spots.depth, ahead)

    def led(self, edge: Index, stop: Array, corner: float) -> TeeState:
        """The same on lines that lead to an `edge` (n, 2), of robots that are and `stop` on one
        edge, outside its `corner` [m], at present; others stay on their lines until they do."""
        low, high = np.minimum(self.x, stop), np.maximum(self.x, stop)
        border = max(corner - GRAZING, 0.0)
        front = np.where((high <= -border) & (edge != self.back), edge, self.front)
        elsewhere = (edge != front) & (edge != self.back)
        back = np.where((low >= border) & elsewhere, edge, self.back)
        return TeeState(back, front, self.x, self.v)

    def boxes(self, robot: int, low: Array, high: Array) -> Array:
        """What a robot (0 or 1) sweeps from one coordinate to another (n,): boxes (n, 2, 4), one on
        either edge of its line, or both on one edge."""
        back, front = EDGES[self.back[:, robot]], EDGES[self.front[:, robot]]
        behind = _box(back, np.maximum(-high, 0.0), -low)
        ahead = _box(front, np.maximum(low, 0.0), high)
        first = np.where((low < 0.0)[:, None], behind, ahead)
        return np.stack([first, np.where((high > 0.0)[:, None], ahead, first)], axis=1)


@dataclass(frozen=True, eq=False)
class Tee:
    """The `lengths` (3,) of the stem and the arms; how far `apart` robots have to be along one of
    the two axes; and the distance `corner` from V on which a way that turns there is rounded, a
    parabola, 0 for none. All in [m]."""

    lengths: Array
    apart: float
    corner: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "lengths", lock(self.lengths))

    @property
    def aside(self) -> float:
        """The depth at which a robot stands by [m]: it is clear of one that crosses."""
        return self.apart + SPARE

    @property
    def delta(self) -> Array:
        """Δ, as boxes (1, 4) of displacements [m]."""
        return np.array([[-self.apart, self.apart] * 2])

    @cached_property
    def crossings(self) -> Index:
        """All crossings (c, 4): the robot (0 or 1), the edge on which the other one stands by, and
        the edges from which and to which it crosses."""
        sides = [edge for edge in range(3) if self.lengths[edge] >= self.aside]
        turns = permutations(range(3), 2)
        every = [(robot, side, *turn) for robot, side, turn in product((0, 1), sides, turns)]
        return np.array(every, np.intp).reshape(-1, 4)

    @cached_property
    def plan(self) -> tuple[Index, Index]:
        """For each cell (first axis) and each cell of goals the first crossing on a shortest path,
        ARRIVED or NO_WAY (12, 12), and how often each robot crosses on it (12, 12, 2)."""
        robot, _, begin, end = self.crossings.T
        before, after = self._beside(self.crossings, begin), self._beside(self.crossings, end)
        first = np.full((CELLS, CELLS), NO_WAY)
        count = np.zeros((CELLS, CELLS, 2), np.intp)
        for goal in range(CELLS):
            first[goal, goal], cells = ARRIVED, deque([goal])
            while cells:
                cell = cells.popleft()
                for crossing in np.flatnonzero(after == cell):
                    if first[earlier := before[crossing], goal] == NO_WAY:
                        first[earlier, goal] = crossing
                        count[earlier, goal] = count[cell, goal]
                        count[earlier, goal, robot[crossing]] += 1
                        cells.append(earlier)
        return first, count

    def reachable(self, start: Spots, goals: Spots) -> Truth:
        """Whether the ring leads from some positions to others (n,)."""
        return np.asarray(self.plan[0][start.cell, goals.cell] != NO_WAY)

    def targets(self, stops: Spots, goals: Spots) -> Spots:
        """Where robots go that would come to rest at `stops`: one to the edge behind V, the other
        one, on its own edge, deep enough to be passed; to their goals if no crossing is left."""
        first, count = self.plan
        crossing = first[stops.cell, goals.cell]
        crosses = (crossing >= 0)[:, None]
        robot, side, _, end = (chosen := self.crossings[np.maximum(crossing, 0)]).T
        later = count[self._beside(chosen, end), goals.cell]
        is_robot = np.arange(2) == robot[:, None]
        edge = np.where(is_robot, end[:, None], side[:, None])
        depth = np.where(later == 0, goals.depth, 0.0)
        stands = ~is_robot | later.any(axis=1, keepdims=True)
        depth = np.where(stands, np.maximum(depth, self.aside), depth)
        return Spots(np.where(crosses, edge, goals.edge), np.where(crosses, depth, goals.depth))

    def tick(
        self, state: TeeState, goals: Spots, limits: tuple[Array, Array], dt: float
    ) -> TeeState:
        """One tick [s] of n pairs on their way to their goals; `limits`: their greatest speeds
        [m/s] and accelerations [m/s²], (n, 2) each."""
        stops = state.on(stopping(state.x, state.v, limits[1], dt))
        return self.towards(state, self.targets(stops, goals), limits, dt)

    def towards(
        self, state: TeeState, targets: Spots, limits: tuple[Array, Array], dt: float
    ) -> TeeState:
        """The same straight to targets, without a plan: under reservations alone."""
        most, a = limits
        stop = stopping(state.x, state.v, a, dt)
        state = state.led(targets.edge, stop, self.corner)
        goal, half = state.coordinates(targets), state.x + state.v * (dt / 2)
        left = np.where(np.isnan(goal), self._out(state, stop), goal) - half
        speed = np.minimum(landing_speed(np.abs(left), a, dt), most)
        speed = np.minimum(speed, self._slow(state, half, a, dt))
        wanted = np.copysign(speed, left)
        x, v = drive((state.x, state.v), wanted, a, dt, state.boxes, self.delta)
        return TeeState(state.back, state.front, x, v)

    def floor(self, state: TeeState) -> Array:
        """Where robots are (n, 2, 2) on the floor, V at its origin [m]."""
        x, back, front = state.x[..., None], EDGES[state.back], EDGES[state.front]
        straight = np.where(x < 0.0, -x * back, x * front)
        if not self.corner:
            return np.asarray(straight)
        turns = (state.back * state.front == 0)[..., None] & (np.abs(x) < self.corner)
        share = (self.corner + x) / (2.0 * self.corner)
        bend = self.corner * (back * (1.0 - share) ** 2 + front * share**2)
        return np.asarray(np.where(turns, bend, straight))

    def _out(self, state: TeeState, stop: Array) -> Array:
        """Where robots go first whose targets are not on their lines (n, 2): out of the corner, not
        towards the other robot."""
        other = state.spots.edge[:, ::-1]
        way = np.where(other == state.front, -1.0, np.where(other == state.back, 1.0, stop))
        return np.copysign(self.corner, way)

    def _slow(self, state: TeeState, half: Array, a: Array, dt: float) -> Array:
        """The greatest speeds (n, 2) [m/s] that a corner allows, now and on the way to it."""
        turns = (state.back * state.front == 0) & (self.corner > 0.0)
        ahead = (half * state.v < 0.0) | (np.abs(half) < self.corner)
        room = np.maximum(np.abs(half) - self.corner - a * dt * dt / 2, 0.0)
        most = np.sqrt(2.0 * a * (self.corner + room))
        return np.asarray(np.where(turns & ahead, most, np.inf))

    def _beside(self, crossings: Index, edge: Index) -> Index:
        """The cells (c,) in which the robot of a crossing is on an edge and the other one stands
        by."""
        robot, side = crossings[:, 0], crossings[:, 1]
        squares = np.where(robot == 0, 3 * edge + side, 3 * side + edge)
        return np.asarray(np.where((edge == side) & (robot == 1), 9 + edge, squares))


def _box(direction: Array, near: Array, far: Array) -> Array:
    """The boxes (n, 4) from one depth to another (n,) of edges in some directions (n, 2)."""
    ends = np.stack([direction * near[:, None], direction * far[:, None]])
    low, high = ends.min(axis=0), ends.max(axis=0)
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
