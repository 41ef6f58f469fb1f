"""What an arm must stay clear of: the distances of its links and its payload from all that stands,
and of its links from each other, measured by the engine."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.api import WeldFrames
from factory.apps.arms.model import ArmModel
from factory.support.arrays import Array, Index
from factory.support.engine import mujoco

NEED = 0.01
"""Clearance on transfers [m]."""

OWN = 0.001
"""Clearance of an arm's links from each other, which its joints keep whatever else happens [m]."""

FAR = 0.05
"""Distances are measured up to this [m]."""

CLOSE = 1e-5
"""Distances that differ by less may come in any order [m]."""

ROWS = 64
"""So many configurations are asked for at once."""


@dataclass(frozen=True, slots=True)
class StandingBox:
    """A box along the axes of the world.

    Attributes:
        name: what it is of.
        low: lower corner (3,) [m].
        high: upper corner (3,) [m].
    """

    name: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]


class Scene:
    """An arm among obstacles.

    Args:
        model: the arm.
        root: its MJCF, with the arm where it stands and a body `tool`.
        loads: by label, boxes of a part in the tool's frame as place, half sizes, quaternion.
        obstacles: what stands.
    """

    def __init__(
        self,
        model: ArmModel,
        root: Element,
        loads: Mapping[str, Sequence[tuple[Array, Array, Array]]],
        obstacles: Sequence[StandingBox],
    ) -> None:
        world = root.find("worldbody")
        assert world is not None
        tool = next(b for b in world.iter("body") if b.get("name") == "tool")
        for label, boxes in loads.items():
            for number, (place, half, turn) in enumerate(boxes):
                _put(tool, f"load/{number}/{label}", pos=place, size=half, quat=turn)
        for number, one in enumerate(obstacles):
            low, high = np.array(one.low), np.array(one.high)
            _put(world, f"box/{number}", pos=(low + high) / 2, size=(high - low) / 2)
        self.m = m = model.compiled(root)
        self.d = mujoco.MjData(m)
        self.names = [m.geom(g).name for g in range(m.ngeom)]
        solid = (m.geom_contype | m.geom_conaffinity) != 0
        self.obstacles = [o.name for o in obstacles]
        self.still = [g for g, name in enumerate(self.names) if name.startswith("box/")]
        self.loads: dict[str, list[int]] = {}
        for g, name in enumerate(self.names):
            if name.startswith("load/"):
                self.loads.setdefault(name.split("/", 2)[2], []).append(g)
        held = {g for each in self.loads.values() for g in each}
        m.geom_sameframe[[*held]] = 0  # held turned, they have frames of their own
        self.links = [
            g
            for g in range(m.ngeom)
            if solid[g] and g not in held and m.body_weldid[m.geom_bodyid[g]] != 0
        ]
        self.base = [
            g
            for g in range(m.ngeom)
            if solid[g] and m.body_weldid[m.geom_bodyid[g]] == 0 and m.geom_bodyid[g] != 0
        ]
        self._own, self._stand = self._pairs(), m.geom_pos.copy()

    def _pairs(self) -> list[tuple[int, int]]:
        """The pairs of links that may touch: those with two joints or more between them."""
        m, pairs = self.m, list[tuple[int, int]]()
        depth = self._depth
        every, excluded = [*self.base, *self.links], {*m.exclude_signature.tolist()}
        for i, one in enumerate(every):
            for other in every[:i]:
                bodies = sorted(int(m.geom_bodyid[g]) for g in (one, other))
                left_out = (bodies[0] << 16) + bodies[1] in excluded
                if abs(depth[one] - depth[other]) >= 2 and not left_out:
                    pairs.append((one, other))
        return pairs

    @cached_property
    def _depth(self) -> list[int]:
        """Number of joints that move each geom."""
        return [len(WeldFrames.joints_of(self.m, int(body))) for body in self.m.geom_bodyid]

    def move(self, names: Collection[str], by: tuple[float, float, float]) -> None:
        """Move obstacles from where they stood first [m]."""
        moved = [g for g in self.still if self._called(g) in names]
        self.m.geom_pos[moved] = self._stand[moved] + by

    def say(self, pair: int) -> str:
        """What a pair of geoms is, in words."""
        one, other = divmod(pair, self.m.ngeom)
        return f"{self._called(one)} and {self._called(other)}"

    def _called(self, geom: int) -> str:
        name = self.names[geom]
        if name.startswith("box/"):
            return self.obstacles[int(name[4:])]
        return name.split("/", 2)[2] if name.startswith("load/") else (name or "a link")

    def margins(
        self, q: Array, label: str, need: float, spared: Collection[str], held: bool = True
    ) -> tuple[Array, Index]:
        """Margins (m,) of configurations (m, n), the distance to what is nearest less `need` [m],
        and the number of the nearest pair (m,).

        Args:
            q: configurations [rad, m].
            label: what it holds, "" for nothing.
            need: clearance [m].
            spared: names of obstacles that do not count.
            held: whether what it holds counts.
        """
        loads = self.loads.get(label, []) if held else []
        pairs = [*self._own, *((g, k) for g in loads for k in self._far_links)]
        links = np.array(pairs, int).reshape(-1, 2)
        moving = np.array([*self.links, *loads])
        boxes = [each for name, each in self._boxes.items() if name not in spared]
        margin, pair = np.full(len(q), FAR - need), np.zeros(len(q), int)
        for first in range(0, len(q), ROWS):
            places, turns = self.poses(q[first : first + ROWS])
            near = self._near(places, moving, boxes, need), self._near_own(places, links)
            rows, bounds, geoms = (np.concatenate(each) for each in zip(*near, strict=True))
            needs = np.repeat([need, OWN], [len(each[0]) for each in near])
            order = np.lexsort((np.maximum(bounds, 0.0), rows))
            ends = np.searchsorted(rows[order], np.arange(len(places) + 1))
            for row in np.flatnonzero(np.diff(ends)).tolist():
                asked = order[ends[row] : ends[row + 1]]
                values = (each[asked].tolist() for each in (bounds, geoms, needs))
                self.d.geom_xpos[self.moves] = places[row, self.moves]
                self.d.geom_xmat[self.moves] = turns[row]
                least = self._least(margin[first + row], zip(*values, strict=True))
                margin[first + row], pair[first + row] = least
        return margin, pair

    def _least(
        self, margin: float, asked: Iterable[tuple[float, tuple[int, int], float]]
    ) -> tuple[float, int]:
        """The least margin below one, and its pair, of pairs by lower bounds on their margins, with
        the clearance that each needs."""
        pair = 0
        for bound, (one, other), need in asked:
            if bound >= margin:
                continue
            away = mujoco.mj_geomDistance(self.m, self.d, one, other, FAR, None) - need
            if away < margin:
                margin, pair = away, one * self.m.ngeom + other
        return margin, pair

    def poses(self, q: Array) -> tuple[Array, Array]:
        """The middles of geoms in configurations (m, n): (m, geoms, 3) [m], and the orientations of
        those that are not still (m, k, 9)."""
        d, moves, places = self.d, self.moves, np.tile(self.m.geom_pos, (len(q), 1, 1))
        turns = np.empty((len(q), len(moves), 9))
        for row, one in enumerate(q):
            d.qpos[:] = one
            mujoco.mj_kinematics(self.m, d)
            places[row, moves], turns[row] = d.geom_xpos[moves], d.geom_xmat[moves]
        return places, turns

    @cached_property
    def moves(self) -> Index:
        """The geoms of the arm, and what it may hold."""
        return np.setdiff1d(np.arange(self.m.ngeom), self.still)

    @cached_property
    def _boxes(self) -> dict[str, Index]:
        """The geoms of what stands, by its name."""
        boxes = dict[str, list[int]]()
        for geom in self.still:
            boxes.setdefault(self._called(geom), []).append(geom)
        return {name: np.array(each) for name, each in boxes.items()}

    def _near(
        self, places: Array, moving: Index, boxes: Sequence[Index], need: float
    ) -> tuple[Index, Array, Index]:
        """Pairs of what moves and of a box of which one is nearest, if any is nearer than FAR: row
        of `places` (k,), a lower bound on the margin [m], and the geoms (k, 2). First the boxes of
        one name are taken together."""
        m, many = self.m, np.array([len(each) for each in boxes], int)
        low, high = m.geom_pos - m.geom_size, m.geom_pos + m.geom_size
        hull = [(low[each].min(axis=0), high[each].max(axis=0)) for each in boxes]
        ends = np.array(hull).reshape(-1, 2, 3)
        away = _away(places[:, moving, None], ends[:, 0], ends[:, 1])
        row, one, name = np.nonzero(away - m.geom_rbound[moving, None] < FAR)
        count, every = many[name], np.array([g for each in boxes for g in each], int)
        number = np.arange(count.sum()) + np.repeat((many.cumsum() - many)[name], count)
        other = every[number - np.repeat(count.cumsum() - count, count)]
        row, one = np.repeat(row, count), np.repeat(moving[one], count)
        away = _away(places[row, one], low[other], high[other])
        most, bound = np.full(len(places), FAR), away - m.geom_rbound[one]
        np.minimum.at(most, row, away + CLOSE)  # no geom is farther than its middle
        kept = bound < most[row]
        return row[kept], bound[kept] - need, np.stack([one, other], axis=1)[kept]

    def _near_own(self, places: Array, pairs: Index) -> tuple[Index, Array, Index]:
        """The same of pairs of the arm's own (p, 2)."""
        off = np.linalg.norm(places[:, pairs[:, 0]] - places[:, pairs[:, 1]], axis=2)
        bound = off - self.m.geom_rbound[pairs].sum(axis=1) - OWN
        row, number = np.nonzero(bound < FAR)
        return row, bound[row, number], pairs[number]

    @cached_property
    def _far_links(self) -> list[int]:
        """The links that a payload may come to: with two joints or more between."""
        last = max(self._depth[g] for g in self.links)
        return [g for g in (*self.base, *self.links) if self._depth[g] <= last - 2]


def _put(body: Element, name: str, **values: Array) -> None:
    """Put a box into a body."""
    said = {key: " ".join(map(str, value.tolist())) for key, value in values.items()}
    ElementTree.SubElement(body, "geom", {"name": name, "type": "box", **said})


def _away(place: Array, low: Array, high: Array) -> Array:
    """Distances (...) of places from boxes (..., 3) [m]."""
    off = np.maximum(np.maximum(low - place, place - high), 0.0)
    return np.asarray(np.sqrt((off * off).sum(axis=-1)))
