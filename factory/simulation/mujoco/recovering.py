"""The bodies of a factory in which things go wrong, in the engine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set

import numpy as np

from factory.control.mode import Array
from factory.mjcf.weld_frames import WeldFrames
from factory.plant.factory import Operation
from factory.problem.pag import NOPART
from factory.simulation.mujoco.fallen import Ground, Heap
from factory.simulation.mujoco.world import MujocoWorld
from factory.simulation.recovery.faults import Campaign, Fault
from factory.support.engine import mujoco

SCRAP = 1 << 20
"""Bodies that are scrap count for units from this one on."""

BINNED = 1.0
"""What falls into a bin is gone so long after that [s]."""

SETTLES = 0.5
"""What has slipped is back in its place in the hand so long after that [s]."""

LOST = 5e-3
"""A part further than this from its place in the hand is lost [m]."""

ASKEW, TURNED = 1e-3, 0.05
"""What a feeder shows is askew when it is so far off [m], or turned so far [rad], unless the
template of its operation says otherwise."""


class MujocoPlant:
    """What recovery asks of a `MujocoWorld`, and does to it.

    `heaps`: what lies about. `bad`: bodies that are no good, and whether that is hidden from
    feeders' cameras.
    """

    def __init__(self, world: MujocoWorld, campaign: Campaign) -> None:
        self._world, self._campaign = world, campaign
        self._frames, self._nominal = WeldFrames.of(world.m, world.d), world.m.eq_data.copy()
        self._ground = Ground.of(world.model.layout)
        self._draw = np.random.default_rng((campaign.seed, 1))
        self.heaps: list[Heap] = []
        self.bad: dict[int, bool] = {}
        self._slipped: dict[int, tuple[dict[str, int], int]] = {}
        self._pressed: dict[int, list[int]] = {}
        self._settling: dict[float, tuple[int, ...]] = {}
        self._calm = 0.0
        self._opened: set[int] = set()
        self._scrapped = SCRAP
        self._grips = _Grips(world)
        self._closed = frozenset[int]()

    # --- faults ---

    def lose(self, robot: int) -> bool:
        """A robot's hand opens, and nothing tells; whether it held anything."""
        hands, parts = self._world.parts.hands, self._world.parts
        if robot not in hands.of or hands.of[robot].unit >= SCRAP:
            return False
        parts.welds.loose([hands.grip[robot, label] for label in hands.of[robot].bodies])
        parts.welds.write()
        self._watch(hands.of[robot].bodies.values())
        self._opened.add(robot)
        return True

    def slip(self, operation: Operation, metres: float) -> None:
        """The last input of an operation that has started slips up in its hand."""
        hands, robot = self._world.parts.hands, operation.robots[operation.last]
        welds = [hands.grip[robot, label] for label in hands.of[robot].bodies]
        self._world.m.eq_data[welds, 5] += metres
        held = [hands.of[r].bodies for r in operation.robots if r in hands.of]
        self._slipped[operation.index] = {**hands.of[robot].bodies}, robot
        pressed = [body for bodies in held for body in bodies.values()]
        self._pressed[operation.index] = pressed
        self._watch(pressed)

    @property
    def slipped(self) -> frozenset[int]:
        """The operations (index) under way whose inputs have slipped."""
        return frozenset(self._slipped)

    def fresh(self) -> Sequence[tuple[str, int]]:
        """The parts that feeders have begun to show since the last question: label and unit."""
        back, m = self._world.parts.feeders.back, self._world.m
        found, back.fresh = [*back.fresh.items()], {}
        for label, _ in found:
            weld = self._world.parts.feeders.welds[label]
            m.eq_data[weld] = self._nominal[weld]
        return found

    def spoil(self, label: str, fault: Fault) -> None:
        """What a feeder shows is askew or no good."""
        parts, m = self._world.parts, self._world.m
        unit = parts.feeders.shown().get(label)
        if unit is None:
            return
        body, weld = parts.copies[label, unit], parts.feeders.welds[label]
        if fault.kind == "bad_part":
            self.bad[body] = fault.hidden
            return
        half = np.radians(fault.degrees) / 2
        turn, pose = np.zeros(4), np.zeros(4)
        mujoco.mju_mulQuat(
            turn, self._nominal[weld, 6:10], np.array([np.cos(half), np.sin(half), 0.0, 0.0])
        )
        mujoco.mju_mulQuat(pose, self._world.d.xquat[m.eq_obj1id[weld]], turn)
        m.eq_data[weld, 5] += fault.metres
        m.eq_data[weld, 6:10] = turn
        parts.welds.turn(body, pose)
        self._watch([body])

    def supplied(self) -> None:
        """Some operation may have become prepared."""
        self._world.supplied = True

    # --- what sensors tell ---

    def tick(self) -> None:
        """A tick is over: what has lain long enough is cleared away."""
        world, now = self._world, self._world.time
        world.parts.strength.dropped = None
        over = [heap for heap in self.heaps if heap.until <= now]
        for heap in over:
            self.heaps.remove(heap)
            world.parts.feeders.retire(heap.bodies, heap.unit)
        hands = world.parts.hands.of
        self._restore([n for n, (_, robot) in self._slipped.items() if robot not in hands])
        lie = {body for heap in self.heaps for body in heap.bodies.values()}
        for since in [since for since in self._settling if since <= now]:
            calm = {*self._settling.pop(since)} - lie
            world.inspection.pressing.fallen.difference_update(calm)
        self._forget()
        if over:
            world.parts.welds.write()
            self.supplied()
        self._closed = self._near() if self.heaps else frozenset()
        back, by_label = world.parts.feeders.back, world.model.factory.by_label
        if back.parts and back.awaited:
            busy = back.awaited & {*world.parts.feeders.served()}
            self._closed |= {by_label[label].carrier for label in busy}

    def lost(self) -> Sequence[int]:
        """The robots that no longer feel what they carry, for some time."""
        found = self._grips.lost(self._frames, self._campaign.sensors.delay)
        hands = self._world.parts.hands.of
        return [robot for robot in found if robot in hands and hands[robot].unit < SCRAP]

    def knocked(self, robot: int) -> bool:
        """Whether a robot's hand is closed, and something touched what it holds that had fallen or
        slipped."""
        hand, pressing = self._world.parts.hands.of.get(robot), self._world.inspection.pressing
        if hand is None or robot in self._opened:
            return False
        return not (pressing.shaken | pressing.fallen).isdisjoint(hand.bodies.values())

    def feels(self, robots: Sequence[int]) -> bool:
        """Whether robots feel all that they carry, now."""
        return {*self._grips.lost(self._frames, 0.0)}.isdisjoint(robots)

    def offers(self, label: str) -> bool:
        """Whether a feeder shows a part that has been looked at and found good."""
        return label in self._world.parts.feeders.back.good

    def refused(self) -> Sequence[tuple[str, int, str]]:
        """Parts that a feeder's camera finds askew or no good: label, unit, and the test."""
        feeders, found = self._world.parts.feeders, []
        for station, unit, body in [*feeders.at_rest()]:
            test = self._looked_at(station.label, body, np.array(station.down))
            if test:
                found.append((station.label, unit, test))
                feeders.take_back(station.label, self._next_scrap())
                carrier = self._world.model.factory.by_label[station.label].carrier
                if carrier not in self._world.parts.hands.of:
                    feeders.stay_clear(carrier)
            else:
                feeders.back.good.add(station.label)
        return found

    def _looked_at(self, label: str, body: int, place: Array) -> str:
        if self.bad.get(body) is False:
            return "rejected"
        world, noise = self._world, self._campaign.sensors.noise
        failures = world.model.factory.by_label[label].template.failures
        most = next((f.limit for f in failures if f.test == "misplaced"), None) or ASKEW
        pose = world.d.qpos[world.m.jnt_qposadr[world.m.body_jntadr[body]] + np.arange(7)]
        off = np.linalg.norm(pose[:3] - place + noise * self._draw.normal(size=3))
        turned = 2 * np.arccos(min(1.0, abs(float(pose[3]))))
        return "misplaced" if off > most or turned > TURNED else ""

    def residual(self, operation: Operation) -> float:
        """How far inputs are from where they belong when they are about to be joined, as measured
        [m]."""
        hands, q = self._world.parts.hands, self._world.d.qpos
        held = [
            (hands.grip[operation.carrier, label], body)
            for robot in operation.robots
            if robot != operation.carrier and robot in hands.of
            for label, body in hands.of[robot].bodies.items()
        ]
        if not held:
            return 0.0
        welds, bodies = np.array(held).T
        frames = self._frames.chosen(welds)
        gap = self._places(bodies) - frames.at(q[frames.along])
        gap += self._campaign.sensors.noise * self._draw.normal(size=gap.shape)
        return float(np.linalg.norm(gap, axis=1).max())

    def rejects(self, robot: int) -> bool:
        """Whether an inspection rejects what a robot holds."""
        hand = self._world.parts.hands.of.get(robot)
        return hand is not None and not self.bad.keys().isdisjoint(hand.bodies.values())

    @property
    def contacts(self) -> int:
        """Pairs of things that touched of which one had fallen, or lay askew."""
        return len(self._world.inspection.pressing.touched)

    # --- what is done ---

    def undone(
        self, holds: Sequence[str], fired: Sequence[int], going: Set[int]
    ) -> Sequence[int]:
        """From now on robots hold these labels by the books, transitions have fired so often, and
        some robots are `going` back. Gives those that hold something that is scrap now."""
        world, factory, parts = self._world, self._world.model.factory, self._world.parts
        gone = {*self._grips.lost(self._frames, 0.0)}
        self._restore([o.index for o in factory.operations if fired[o.start] == fired[o.end]])
        scrap = {r for r in parts.hands.of if holds[r] == NOPART}
        units = self._renumbered(holds, fired, scrap)
        parts.copies.renumber(
            {
                (label, hand.unit): units[robot]
                for robot, hand in parts.hands.of.items()
                for label in hand.bodies
            }
            | {
                (leaf.label, shown): factory.unit(leaf, fired[leaf.end])
                for leaf in factory.leaves
                if (shown := parts.feeders.shown().get(leaf.label)) is not None
            }
        )
        for number in world.inspection.joining:
            operation = factory.operations[number]
            both = [units[r] for r in operation.robots if r in scrap]
            world.inspection.joining[number] = (
                both[0] if both else factory.unit(operation, fired[operation.end])
            )
        for robot, unit in units.items():
            parts.hands.of[robot].unit = unit
            if robot in scrap:
                parts.joining.waiting.pop(robot, None)
        for robot in gone & scrap:
            self._let_fall(robot, self._campaign.clear)
        self._recount(fired, going, scrap - gone)
        parts.welds.write()
        return sorted(scrap - gone)

    def _renumbered(
        self, holds: Sequence[str], fired: Sequence[int], scrap: set[int]
    ) -> dict[int, int]:
        """The unit for which each robot that holds something holds it from now on."""
        factory, hands = self._world.model.factory, self._world.parts.hands
        found, fresh = dict[int, int](), dict[int, int]()
        for robot, hand in hands.of.items():
            if robot in scrap:
                if hand.unit not in fresh:
                    fresh[hand.unit] = self._next_scrap()
                found[robot] = hand.unit if hand.unit >= SCRAP else fresh[hand.unit]
            else:
                maker = factory.by_label[holds[robot]]
                found[robot] = factory.unit(maker, fired[maker.end] - 1)
        return found

    def _recount(self, fired: Sequence[int], going: Set[int], scrap: Set[int]) -> None:
        """Feeders show what is needed now. Where a robot comes home with something, nothing comes
        down until it is there, and what has come goes up again; where with nothing, when it is out
        of the way."""
        factory, feeders = self._world.model.factory, self._world.parts.feeders
        hands = self._world.parts.hands.of
        ends = {leaf.label: fired[leaf.end] for leaf in factory.leaves}
        units = {leaf.label: factory.unit(leaf, ends[leaf.label]) for leaf in factory.leaves}
        feeders.undone(units, ends, self._next_scrap(len(ends)))
        for leaf in factory.leaves:
            hand = hands.get(leaf.carrier)
            if hand is None:
                if leaf.carrier in going:
                    feeders.stay_clear(leaf.carrier)
            elif leaf.carrier in scrap or (leaf.carrier in going and leaf.label in hand.bodies):
                for label in self._world.model.layout.magazine(leaf.carrier):
                    feeders.back.awaited.add(label)
                    if label in feeders.shown():
                        feeders.take_back(label, self._next_scrap())

    def let_go(self, robot: int) -> None:
        """A robot lets scrap fall."""
        self._let_fall(robot, BINNED)
        self._world.parts.welds.write()
        self.came_back(robot)
        self._world.parts.feeders.stay_clear(robot)

    def came_back(self, robot: int) -> None:
        """A robot is where it waits."""
        for label in self._world.model.layout.magazine(robot):
            self._world.parts.feeders.back.awaited.discard(label)

    def lying(self) -> Mapping[str, float]:
        """What lies about, and until when [s]."""
        return {f"{heap.what}#{heap.unit}": heap.until for heap in self.heaps}

    def closed(self) -> frozenset[int]:
        """The robots that could touch what lies about."""
        return self._closed

    def lift_out(self, robot: int, at: Mapping[int, float]) -> None:
        """A dead robot and what it holds are taken away, and another is put in its place, with its
        axes at these places [m]."""
        world = self._world
        if robot in world.parts.hands.of:
            hand = world.parts.hands.let_go(robot)
            world.parts.feeders.retire(hand.bodies, hand.unit)
        world.parts.welds.write()
        world.motion.load([robot], [0.0])
        world.motion.put(at)
        self.came_back(robot)
        world.parts.feeders.stay_clear(robot)

    # --- bodies ---

    def _let_fall(self, robot: int, seconds: float) -> None:
        world, parts = self._world, self._world.parts
        self._opened.discard(robot)
        hand = parts.hands.let_go(robot)
        what = next(iter(hand.bodies))
        self.heaps.append(Heap(what, hand.unit, dict(hand.bodies), world.time + seconds))
        self._watch(hand.bodies.values())
        world.motion.load([robot], [0.0])
        self._closed |= self._near()

    def _watch(self, bodies: Iterable[int]) -> None:
        """From now on bodies may come anywhere: all is looked at in every timestep."""
        world = self._world
        world.inspection.pressing.fallen.update(bodies)
        if _anything not in world.hooks.before_step:
            world.hooks.before_step.append(_anything)

    def _forget(self) -> None:
        """What is out of sight is as good as new."""
        world, units = self._world, self._world.parts.masks.unit
        fallen = world.inspection.pressing.fallen
        for body in [body for body in {*fallen, *self.bad} if units[body] < 0]:
            fallen.discard(body)
            self.bad.pop(body, None)
        if fallen:
            self._calm = world.time + SETTLES
        elif _anything in world.hooks.before_step and world.time >= self._calm:
            world.inspection.pressing.shaken.clear()
            world.hooks.before_step.remove(_anything)

    def _near(self) -> frozenset[int]:
        """The robots that could touch what lies about now."""
        radius = self._world.model.carried.radius
        bodies = [(body, radius[label]) for heap in self.heaps for label, body in heap.bodies.items()]
        at, radii = np.array([body for body, _ in bodies]), np.array([r for _, r in bodies])
        return self._ground.near(self._places(at)[:, :2], radii)

    def _places(self, bodies: Array) -> Array:
        """Where the origins of free bodies are (n, 3) [m]."""
        m = self._world.m
        return np.asarray(
            self._world.d.qpos[m.jnt_qposadr[m.body_jntadr[bodies]][:, None] + np.arange(3)]
        )

    def _restore(self, operations: Iterable[int]) -> None:
        """What has slipped in operations (index) is held as it should be."""
        hands = self._world.parts.hands
        for number in {*operations} & self._slipped.keys():
            bodies, robot = self._slipped.pop(number)
            welds = [hands.grip[robot, label] for label in bodies]
            self._world.m.eq_data[welds] = self._nominal[welds]
            self._settling[self._world.time + SETTLES] = tuple(self._pressed.pop(number))

    def _next_scrap(self, count: int = 1) -> int:
        self._scrapped += count
        return self._scrapped - count


class _Grips:
    """The welds of robots' hands as they are felt: by vacuum, and by how far off a part is."""

    def __init__(self, world: MujocoWorld) -> None:
        self._world, self._seen = world, -1
        self._welds = self._bodies = self._robots = np.empty(0, np.intp)
        self._since: dict[int, float] = {}

    def lost(self, frames: WeldFrames, delay: float) -> list[int]:
        """The robots that have felt nothing for so long [s]."""
        world, hands = self._world, self._world.parts.hands
        if self._seen != hands.changes:
            self._seen = hands.changes
            found = [
                (hands.grip[robot, label], body, robot)
                for robot, hand in hands.of.items()
                for label, body in hand.bodies.items()
            ]
            self._welds, self._bodies, self._robots = np.array(found, np.intp).reshape(-1, 3).T
        m, d = world.m, world.d
        chosen = frames.chosen(self._welds)
        place = d.qpos[m.jnt_qposadr[m.body_jntadr[self._bodies]][:, None] + np.arange(3)]
        off = np.linalg.norm(place - chosen.at(d.qpos[chosen.along]), axis=1)
        gone = {*self._robots[(off > LOST) | (d.eq_active[self._welds] == 0)].tolist()}
        self._since = {robot: self._since.get(robot, world.time) for robot in gone}
        return [r for r, since in self._since.items() if world.time - since >= delay]


def _anything() -> None:
    """Before a timestep in which anything may come anywhere: that there is a hook is enough."""
