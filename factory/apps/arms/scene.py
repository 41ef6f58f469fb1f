"""What an arm must stay clear of: the distances of its links and its payload from all that stands,
and of its links from each other, measured by the engine."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from factory.api import Array, Index, mujoco
from factory.apps.arms.model import ArmModel
from factory.engine.mjcf.weld_frames import joints_of

NEED = 0.01
"""Clearance on transfers [m]."""

OWN = 0.001
"""Clearance of an arm's links from each other, which its joints keep whatever else happens [m]."""

FAR = 0.05
"""Distances are measured up to this [m]."""


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
                ElementTree.SubElement(
                    tool,
                    "geom",
                    name=f"load/{number}/{label}",
                    type="box",
                    pos=" ".join(map(str, place.tolist())),
                    size=" ".join(map(str, half.tolist())),
                    quat=" ".join(map(str, turn.tolist())),
                    mass="0",
                )
        for number, one in enumerate(obstacles):
            low, high = np.array(one.low), np.array(one.high)
            ElementTree.SubElement(
                world,
                "geom",
                name=f"box/{number}",
                type="box",
                pos=" ".join(map(str, ((low + high) / 2).tolist())),
                size=" ".join(map(str, ((high - low) / 2).tolist())),
            )
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
        return [len(joints_of(self.m, int(body))) for body in self.m.geom_bodyid]

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
        still = np.array([g for g in self.still if self._called(g) not in spared], int)
        moving = [*self.links, *(self.loads.get(label, ()) if held else ())]
        margin, pair = np.empty(len(q)), np.empty(len(q), int)
        for row, one in enumerate(q):
            margin[row], pair[row] = self._least(one, moving, still, label if held else "", need)
        return margin, pair

    def _least(
        self, q: Array, moving: Sequence[int], still: Array, label: str, need: float
    ) -> tuple[float, int]:
        """The least margin of a configuration, and its pair."""
        m, d = self.m, self.d
        d.qpos[:] = q
        mujoco.mj_kinematics(m, d)
        best, pair = FAR, 0
        place, bound = d.geom_xpos, m.geom_rbound
        low = place[still] - m.geom_size[still]
        high = place[still] + m.geom_size[still]
        for one in moving:
            near = np.clip(place[one], low, high) - place[one]
            gap = np.sqrt((near * near).sum(axis=1)) - bound[one]
            for other in still[gap < best].tolist():
                away = mujoco.mj_geomDistance(m, d, one, other, best, None)
                if away < best:
                    best, pair = away, one * m.ngeom + other
        pairs = self._own
        if label:
            pairs = [*pairs, *((g, k) for g in self.loads[label] for k in self._far_links)]
        best -= need
        for one, other in pairs:
            apart = place[one] - place[other]
            if float(apart @ apart) ** 0.5 - bound[one] - bound[other] - OWN < best:
                away = mujoco.mj_geomDistance(m, d, one, other, FAR, None) - OWN
                if away < best:
                    best, pair = away, one * m.ngeom + other
        return float(best), int(pair)

    @cached_property
    def _far_links(self) -> list[int]:
        """The links that a payload may come to: with two joints or more between."""
        last = max(self._depth[g] for g in self.links)
        return [g for g in (*self.base, *self.links) if self._depth[g] <= last - 2]
