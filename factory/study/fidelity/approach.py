"""The least distances of bodies that are not meant to touch, compared with the certified ones.

Left out are pairs that are meant to be near: a part and its holder, parts held by one body, parts
whose robots are in the same active operation, robots and the floor, the output robot at the outfeed
that it serves, bodies of one feeder or of the outfeed, sliders, which hand over, and spare copies.
Hands reach between the parts: they may also be near the robots, feeders and parts that they meet at
their carrier, and those that deliver to the same carrier. No distance is certified for these pairs;
`hidden_penetration_max_mm` measures that they do not touch."""

from __future__ import annotations

import numpy as np

from factory.control.mode import Array, Index, Truth
from factory.layout.clearance import certify
from factory.layout.feeding import outlets_of
from factory.layout.layout import Layout, carriers
from factory.mjcf import names
from factory.mjcf.shells import trunks
from factory.study.fidelity.readings import ActiveWelds, Shadow
from factory.study.fidelity.record import ClosestApproach
from factory.support.engine import mujoco

ROBOT, PART, FEEDER, OUTFEED, NONE = range(5)
KINDS = ("robot", "part", "feeder", "outfeed")

LIMBS = ("finger", "column", "pad", "cross", "riser", "tower", "bar", "beam", "stem")
"""Names of the limbs of hands."""

BEYOND = 2e-3
"""Distances are measured up to the clearance plus this [m]."""


def certified(layout: Layout) -> Array:
    """Certified distance of two bodies by their kinds (4, 4) [m]: the clearance in plan or, where
    layers may lie above each other, the gap between these if it is less."""
    certificate = layout.certificate or certify(layout)
    gaps, c = dict(certificate.gaps), certificate.clearance
    distances = np.full((4, 4), c)
    distances[ROBOT, ROBOT] = min(c, gaps.get("carriages to arms", c))
    distances[ROBOT, PART] = min(c, gaps.get("masts and arms to payloads", c))
    distances[OUTFEED, PART] = min(c, gaps.get("outfeed to payloads", c))
    return np.asarray(np.minimum(distances, distances.T))


class Reaching:
    """Hands that reach to bodies at their carrier."""

    def __init__(self, m: mujoco.MjModel, layout: Layout, welds: ActiveWelds) -> None:
        self.welds = welds
        self.hand = np.array([_is_hand(m.geom(geom).name) for geom in range(m.ngeom)])
        self.serves = _served([m.body(body).name for body in range(m.nbody)], layout)
        self.on = np.array([*carriers(layout.factory), -2])

    def meant(self, geoms: Index, bodies: Index) -> Truth:
        """Whether pairs of geoms (n, 2), of bodies (n, 2), include a hand, and their robots are
        carrier and guest, or guests of one carrier. The robot of a body is also that of its holder
        or of the feeder that holds it."""
        holder = self.welds.holder[bodies]
        of = np.where(holder >= 0, self.serves[holder], self.serves[bodies])
        (a, b), (on_a, on_b) = of.T, self.on[of].T
        met = (a == b) | (on_a == b) | (on_b == a) | (on_a == on_b)
        return np.asarray(self.hand[geoms].any(axis=1) & met)


class Approaches:
    """The least distance for each pair of kinds, with the names of the two bodies."""

    def __init__(
        self, m: mujoco.MjModel, layout: Layout, welds: ActiveWelds, shadow: Shadow
    ) -> None:
        self.welds, self.shadow = welds, shadow
        self.certified, self.trunk = certified(layout), trunks(m)
        words = [m.body(i).name for i in range(m.nbody)]
        kinds = [names.kind(word) for word in words]
        sliders = {names.slider(outlet.name) for outlet in outlets_of(layout)}
        self.kind = np.array(
            [
                KINDS.index(k) if k in KINDS and word not in sliders else NONE
                for k, word in zip(kinds, words, strict=True)
            ]
        )
        self.robot = _robots(words, [r.name for r in layout.factory.robots])
        self.reaching = Reaching(m, layout, welds)
        self.operation = np.full(len(layout.factory.robots) + 1, -1)
        self.operations = layout.factory.operations
        self.least = np.full((5, 5), np.inf)
        self.least[NONE] = self.least[:, NONE] = -np.inf
        self.bodies: dict[tuple[int, int], tuple[str, str]] = {}
        self._coupled: tuple[int, ...] | None = None

    def tick(self, active: tuple[int, ...]) -> None:
        """Measure the present configuration, with the operations `active` under way."""
        self.shadow.collide()
        d = self.shadow.d
        if not d.ncon:
            return
        geoms = d.contact.geom
        pairs, dist = self.trunk[self.shadow.run_m.geom_bodyid[geoms]], d.contact.dist
        kinds = self.kind[pairs]
        nearer = np.flatnonzero(dist < self.least[kinds[:, 0], kinds[:, 1]])
        if not len(nearer):
            return
        if active != self._coupled:
            self._couple(active)
        pairs, dist = pairs[nearer], dist[nearer]
        kept = ~(self._meant(*pairs.T) | self.reaching.meant(geoms[nearer], pairs))
        if kept.any():
            self._keep(pairs[kept], dist[kept])

    def _couple(self, active: tuple[int, ...]) -> None:
        """Note the operation of each robot."""
        self._coupled = active
        self.operation[:] = -1
        for number in active:
            self.operation[list(self.operations[number].robots)] = number

    def _meant(self, a: Index, b: Index) -> Truth:
        """Whether bodies (n,) and (n,) are meant to be near each other."""
        root = self.shadow.run_m.body_rootid
        hold_a, hold_b = self.welds.holder[a], self.welds.holder[b]
        held = (hold_a >= 0) & (root[hold_a] == root[b]) | (hold_b >= 0) & (root[hold_b] == root[a])
        both = (hold_a >= 0) & (hold_b >= 0)
        together = both & (root[hold_a] == root[hold_b])
        one, other = self.operation[self.robot[hold_a]], self.operation[self.robot[hold_b]]
        joining = both & (one >= 0) & (one == other)
        kinds = self.kind[a] + self.kind[b]
        serving = (kinds == ROBOT + OUTFEED) & (np.minimum(self.robot[a], self.robot[b]) == 0)
        serving &= (self.kind[a] == OUTFEED) | (self.kind[b] == OUTFEED)
        same = (root[a] == root[b]) | ((self.kind[a] == OUTFEED) & (self.kind[b] == OUTFEED))
        spare = (hold_a == 0) | (hold_b == 0)
        return np.asarray(held | together | joining | serving | same | spare)

    def _keep(self, pairs: Index, dist: Array) -> None:
        for nearest in np.argsort(-dist):  # the nearest of a kind comes last, and is kept
            a, b = sorted(pairs[nearest], key=lambda body: int(self.kind[body]))
            i, j = int(self.kind[a]), int(self.kind[b])
            self.least[i, j] = self.least[j, i] = dist[nearest]
            self.bodies[i, j] = (
                self.shadow.run_m.body(int(a)).name,
                self.shadow.run_m.body(int(b)).name,
            )

    def found(self) -> tuple[ClosestApproach, ...]:
        """The closest approach of each pair of kinds that came within the detection distance."""
        return tuple(
            ClosestApproach(
                f"{KINDS[i]} - {KINDS[j]}",
                1e3 * float(self.certified[i, j]),
                1e3 * float(self.least[i, j]),
                self.bodies[i, j],
            )
            for i, j in sorted(self.bodies)
        )

    def closest(self) -> float:
        """The least distance [m], except to the outfeed's table."""
        return min(self.shadow.reach, float(self.least[:OUTFEED, :OUTFEED].min()))

    def margin(self) -> float:
        """The least of the distances less those certified [m]."""
        margins = np.minimum(self.least[:NONE, :NONE], self.shadow.reach) - self.certified
        return float(margins[np.triu_indices(4)].min())


def _is_hand(geom: str) -> bool:
    """Whether a geom is a limb of a hand."""
    return names.kind(geom) == "robot" and geom.rpartition("/")[2] in LIMBS


def _served(bodies: list[str], layout: Layout) -> Index:
    """Index of the robot of each body, or of the robot that a feeder or the tray serves; the number
    of robots for none."""
    factory = layout.factory
    stations = {names.feeder(outlet.name): outlet.robot for outlet in outlets_of(layout)}
    stations[names.OUTFEED_TRAY] = 0
    served = _robots(bodies, [robot.name for robot in factory.robots])
    for number, body in enumerate(bodies):
        served[number] = stations.get("/".join(body.split("/")[:2]), served[number])
    return served


def _robots(bodies: list[str], robots: list[str]) -> Index:
    """Index of the robot of each body; the number of robots for none."""
    number = {name: i for i, name in enumerate(robots)}
    return np.array([number.get(name.partition("/")[0], len(robots)) for name in bodies])
