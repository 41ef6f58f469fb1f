"""Faults, sensors and responses in the engine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from math import radians

import numpy as np

from factory.api import NOPART, Factory, MujocoWorld, Operation, RunVerdict, WeldFrames
from factory.apps.deviations.campaign import Campaign
from factory.apps.deviations.deviation import Deviation
from factory.apps.recovery.mujoco.fallen import Fallen
from factory.apps.recovery.mujoco.mishaps import Mishaps
from factory.apps.recovery.plant import Plant
from factory.floor.layout.bins import Bin
from factory.support.arrays import Array, Index

SCRAP = 1 << 20
"""Bodies that are scrap count for units from this one on."""


SHARE = 0.5
"""A feeder's camera finds what is off by this share of what a hand-off may be (`verdict.LIMITS`):
the rest is left to its noise and to the robot that takes the part."""

SHIFTED = SHARE * RunVerdict.MOST["handoff_gap_max_mm"] / 1e3
"""Largest displacement that no camera finds [m]; a template may ask for less."""

TURNED = SHARE * radians(RunVerdict.MOST["handoff_angle_max_deg"])
"""Largest angle that no camera finds [rad]."""

LOST = 5e-3
"""A part further than this from its place in the hand is lost [m]."""


class Senses:
    """The sensors of a world, with normal errors of standard deviation `noise` [m]."""

    def __init__(self, world: MujocoWorld, campaign: Campaign) -> None:
        self._world, self._noise = world, campaign.sensors.noise
        self._delay, self._draw = campaign.sensors.delay, np.random.default_rng((campaign.seed, 1))
        self._frames, self._seen = WeldFrames.of(world.m, world.d), -1
        self._welds = self._bodies = self._robots = np.empty(0, np.intp)
        self._since: dict[int, float] = {}

    def unfelt(self) -> frozenset[int]:
        """Robots (index) whose grip sensors do not report their payload now: there is no grip, or
        the payload is not in its place."""
        holdings, d = self._world.parts.holdings, self._world.d
        if self._seen != holdings.changes:
            self._seen = holdings.changes
            held = [
                (holdings.weld[holdings.code(robot), label], body, robot)
                for robot, bodies in holdings.in_hands().items()
                for label, body in bodies.items()
            ]
            self._welds, self._bodies, self._robots = np.array(held, np.intp).reshape(-1, 3).T
        off = np.linalg.norm(self._gaps(self._welds, self._bodies), axis=1)
        gone = (off > LOST) | (d.eq_active[self._welds] == 0)
        return frozenset(self._robots[gone].tolist())

    def lost(self) -> list[int]:
        """Robots (index) whose payload has not been reported for at least the sensors' delay."""
        now = self._world.time
        self._since = {robot: self._since.get(robot, now) for robot in sorted(self.unfelt())}
        return [robot for robot, since in self._since.items() if now - since >= self._delay]

    def residual(self, operation: Operation) -> float:
        """Measured distance of inputs from their places in a joint about to be made [m]."""
        holdings = self._world.parts.holdings
        held = [
            (holdings.weld[holdings.code(operation.carrier), label], body)
            for robot in operation.robots
            if robot != operation.carrier
            for label, body in holdings.hand(robot).items()
        ]
        if not held:
            return 0.0
        gaps = self._gaps(*np.array(held).T)
        gaps += self._noise * self._draw.normal(size=gaps.shape)
        return float(np.linalg.norm(gaps, axis=1).max())

    def is_askew(self, label: str, body: int, place: Array) -> bool:
        """Whether a feeder's camera finds the part displaced or turned from its `place` (3,)
        [m]."""
        test = self._world.model.factory.by_label[label].template.failure("misplaced")
        if test is None or test.limit is None:
            return False
        m = self._world.m
        address = m.jnt_qposadr[m.body_jntadr[body]] + np.arange(7)
        pose, upright = self._world.d.qpos[address], m.qpos0[address[3:]]
        off = np.linalg.norm(pose[:3] - place + self._noise * self._draw.normal(size=3))
        return bool(
            off > min(test.limit, SHIFTED)
            or 2 * np.arccos(min(1.0, abs(float(pose[3:] @ upright)))) > TURNED
        )

    def _gaps(self, welds: Index, bodies: Index) -> Array:
        """Distances of bodies from where welds should hold them (n,) [m]."""
        m, q, frames = self._world.m, self._world.d.qpos, self._frames.chosen(welds)
        place = q[m.jnt_qposadr[m.body_jntadr[bodies]][:, None] + np.arange(3)]
        return np.asarray(place - frames.at(q[frames.along]))


class MujocoPlant(Plant):
    """The faults, sensors and responses of a `MujocoWorld`."""

    def __init__(self, world: MujocoWorld, campaign: Campaign) -> None:
        self._world, self._layout, self._clear = world, world.model.layout, campaign.clear
        self._fallen, self._holdings = Fallen(world), world.parts.holdings
        self._mishaps, self._senses = Mishaps(world, self._fallen), Senses(world, campaign)
        self._scrapped, self._spilled = SCRAP, list[str]()

    @property
    def _factory(self) -> Factory:
        return self._layout.factory

    def lose(self, robot: int) -> bool:
        unit = self._holdings.unit(self._holdings.code(robot))
        if unit is None or unit >= SCRAP:
            return False
        self._mishaps.open(robot)
        return True

    def slip(self, operation: Operation, metres: float) -> None:
        self._mishaps.slip(operation, metres)

    @property
    def slipped(self) -> frozenset[int]:
        return frozenset(self._mishaps.slips)

    def fresh(self) -> Sequence[tuple[str, int]]:
        return self._mishaps.fresh()

    def spoil(self, label: str, fault: Deviation) -> None:
        self._mishaps.spoil(label, fault)

    def supplied(self) -> None:
        self._world.supplied = True

    def tick(self) -> None:
        if self._world.parts.strength.dropped is not None:
            self._world.parts.strength.dropped = None
            for robot in self._senses.unfelt():
                self._fallen.watch(self._holdings.hand(robot).values())
        self._mishaps.tick()
        if self._fallen.tick():
            self.supplied()

    def lost(self) -> Sequence[int]:
        holdings, lost = self._holdings, self._senses.lost()
        units = ((robot, holdings.unit(holdings.code(robot))) for robot in lost)
        return [robot for robot, unit in units if unit is not None and unit < SCRAP]

    def knocked(self, robot: int) -> bool:
        bodies, pressing = self._holdings.hand(robot).values(), self._world.inspection.pressing
        is_open = robot in self._mishaps.opened
        return not (is_open or (pressing.shaken | pressing.fallen).isdisjoint(bodies))

    def feels(self, robots: Sequence[int]) -> bool:
        return self._senses.unfelt().isdisjoint(robots)

    def offers(self, label: str) -> bool:
        return label in self._world.parts.feeders.back.good

    def refused(self) -> Sequence[tuple[str, int, str]]:
        feeders, faulty = self._world.parts.feeders, list[tuple[str, int, str]]()
        for station, unit, body in [*feeders.at_rest()]:
            label, test = station.label, ""
            self._mishaps.unseen.pop(body, None)
            if self._mishaps.bad.get(body) is False:
                test = "rejected"
            elif self._senses.is_askew(label, body, np.array(station.down)):
                test = "misplaced"
            if not test:
                feeders.back.good.add(label)
                continue
            faulty.append((label, unit, test))
            feeders.take_back(label, self._next_scrap())
            if not self._holdings.hand(carrier := self._factory.by_label[label].carrier):
                feeders.stay_clear(carrier)
        return faulty

    def unseen(self) -> Sequence[str]:
        gone, self._mishaps.gone = self._mishaps.gone, []
        return gone

    def residual(self, operation: Operation) -> float:
        return self._senses.residual(operation)

    def rejects(self, robot: int) -> bool:
        return not self._mishaps.bad.keys().isdisjoint(self._holdings.hand(robot).values())

    def undone(self, holds: Sequence[str], fired: Sequence[int], going: Set[int]) -> Sequence[int]:
        parts, operations = self._world.parts, self._factory.operations
        self._mishaps.restore([o.index for o in operations if fired[o.start] == fired[o.end]])
        scrap = {robot for robot in self._holdings.in_hands() if holds[robot] == NOPART}
        gone = self._senses.unfelt() & scrap
        units = self._units(holds, fired, scrap)
        self._renumber(units, fired, scrap)
        for robot in scrap:
            parts.joining.waiting.pop(robot, None)
        for robot in sorted(gone):
            self._let_fall(robot, self._clear)
        self._recount(fired, going, scrap - gone)
        parts.welds.write()
        return sorted(scrap - gone)

    def _units(self, holds: Sequence[str], fired: Sequence[int], scrap: Set[int]) -> dict[int, int]:
        """The unit of each robot's payload after an undo: the last one made of its label; scrap
        that belongs together keeps one number."""
        units, fresh = dict[int, int](), dict[int, int]()
        for robot, bodies in self._holdings.in_hands().items():
            if robot not in scrap:
                maker = self._factory.by_label[holds[robot]]
                units[robot] = self._factory.unit(maker, fired[maker.end] - 1)
                continue
            unit = self._holdings.of(next(iter(bodies.values()))).unit
            if unit not in fresh:
                fresh[unit] = unit if unit >= SCRAP else self._next_scrap()
            units[robot] = fresh[unit]
        return units

    def _renumber(self, units: Mapping[int, int], fired: Sequence[int], scrap: Set[int]) -> None:
        """Assign bodies to units: payloads, presented parts, and inputs of operations under way or
        taken apart."""
        factory, joining, held = self._factory, self._world.inspection.joining, self._holdings
        for_units = {
            body: units[robot]
            for robot, bodies in held.in_hands().items()
            for body in bodies.values()
        }
        for label, unit in self._world.parts.feeders.shown().items():
            leaf = factory.by_label[label]
            for_units[held[label, unit]] = self._upcoming(leaf, fired)
        held.assign(for_units)
        for number in joining:
            operation = factory.operations[number]
            wasted = [units[robot] for robot in operation.robots if robot in scrap]
            unit = factory.unit(operation, fired[operation.end])
            joining[number] = wasted[0] if wasted else unit

    def _recount(self, fired: Sequence[int], going: Set[int], scrap: Set[int]) -> None:
        """Let feeders present what is needed now. If a robot comes home with a payload, its feeder
        waits, and withdraws what it presents; if without, until the robot is out of the way."""
        factory, feeders = self._factory, self._world.parts.feeders
        units = {leaf.label: self._upcoming(leaf, fired) for leaf in factory.leaves}
        rounds = {label: unit // factory.period for label, unit in units.items()}
        feeders.undone(units, rounds, self._next_scrap(len(units)))
        for leaf in factory.leaves:
            bodies = self._holdings.hand(leaf.carrier)
            if not bodies:
                if leaf.carrier in going:
                    feeders.stay_clear(leaf.carrier)
            elif leaf.carrier in scrap or (leaf.carrier in going and leaf.label in bodies):
                for label in self._layout.magazine(leaf.carrier):
                    feeders.back.awaited.add(label)
                    if label in feeders.shown():
                        self._take_back(label)

    def _upcoming(self, leaf: Operation, fired: Sequence[int]) -> int:
        """The unit that needs the next part after so many firings."""
        return self._world.word.upcoming(self._factory.unit(leaf, fired[leaf.end]))

    def let_go(self, robot: int, seconds: float, into: Bin | None = None) -> None:
        self._let_fall(robot, seconds, into)
        self._world.parts.welds.write()
        self.came_back(robot)
        self._world.parts.feeders.stay_clear(robot)

    def _let_fall(self, robot: int, seconds: float, into: Bin | None = None) -> None:
        self._mishaps.opened.discard(robot)
        self._fallen.let_fall(robot, seconds, into)

    def throw_away(self, robot: int, label: str, seconds: float) -> None:
        bins = (one for one in self._world.model.bins if one.robot == robot)
        into = next((one for one in bins if label in one.labels), None)
        if into is None:
            self._spilled.append(self._factory.robots[robot].name)
        self.let_go(robot, seconds, into)

    def in_the_way(self, away: Set[int]) -> Set[int]:
        return self._world.in_the_way(away)

    def takes_back(self, robot: int) -> bool:
        labels = self._layout.magazine(robot)
        return not {*labels}.isdisjoint(self._world.parts.feeders.served())

    def came_back(self, robot: int) -> None:
        feeders = self._world.parts.feeders
        feeders.back.awaited.difference_update(self._layout.magazine(robot))

    @property
    def lying(self) -> Sequence[float]:
        return [heap.until for heap in self._fallen.heaps]

    @property
    def closed(self) -> frozenset[int]:
        return self._fallen.closed

    @property
    def binned(self) -> int:
        return self._fallen.binned

    @property
    def spilled(self) -> Sequence[str]:
        return self._spilled

    @property
    def contacts(self) -> int:
        return len(self._world.inspection.pressing.touched)

    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        parts, motion = self._world.parts, self._world.motion
        parts.holdings.put_away(self._holdings.hand(robot).values())
        parts.welds.write()
        motion.load([robot], [0.0])
        motion.put(at)
        self.came_back(robot)
        parts.feeders.stay_clear(robot)

    def _take_back(self, label: str) -> None:
        """Withdraw the presented part of a label into its feeder."""
        feeders = self._world.parts.feeders
        self._mishaps.take_back(self._holdings[label, feeders.shown()[label]])
        feeders.take_back(label, self._next_scrap())

    def _next_scrap(self, count: int = 1) -> int:
        self._scrapped += count
        return self._scrapped - count
