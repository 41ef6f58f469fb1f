"""The bodies of parts: which copy is in which unit, who holds it, and the welds that say so."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from types import MappingProxyType

import numpy as np

from factory.geometry.meshes import Array
from factory.mjcf import names
from factory.mjcf.model import Model
from factory.mjcf.parts import parked_at, presented_at
from factory.plant.factory import Operation
from factory.problem.pag import NOPART
from factory.simulation.mujoco.contacts import NOBODY, Contacts
from factory.simulation.mujoco.fast.broad_phase import Vicinity, margin
from factory.simulation.mujoco.fast.swept_boxes import Reach
from factory.simulation.mujoco.fusing import RIGID, SETTLING, Fusion
from factory.simulation.mujoco.gaps import held_at
from factory.simulation.mujoco.loads import Load, loads
from factory.simulation.mujoco.welds import Switchboard
from factory.support.engine import mujoco

NOTHING: Mapping[int, float] = MappingProxyType({})


@dataclass(slots=True)
class Hand:
    """The `bodies` that a robot holds, their `labels`, and the `unit` that they are for."""

    unit: int
    labels: list[str] = field(default_factory=list)
    bodies: list[int] = field(default_factory=list)


class Stock:
    """Copies of parts, fed in the order of units: the n-th part of each label is for unit n.

    A weld is aimed at the copy it holds by writing its body at run time; its nominal frame is the
    same for all copies. `load`: what each robot (index) holds. `refilled`: the labels whose feeders
    are filled again when each operation has ended. Where the model has bodies for
    sub-assemblies, `joining` are the robots (index) whose bodies have yet to settle before one
    takes their place, and since when [s]; `misfit`: how far out of place any vertex of a unit's
    parts was when that happened [m].
    """

    def __init__(
        self,
        m: mujoco.MjModel,
        d: mujoco.MjData,
        model: Model,
        units: int,
        counts: Mapping[int, int],
        wip: int | None = None,
    ) -> None:
        self.m, self.d, self.model, self.wip = m, d, model, wip
        factory, self.bodies = model.factory, model.carried
        self.parts = self.bodies.carried[factory.pag.root]
        self.load: dict[int, Hand] = {}
        self.joining: dict[int, tuple[str, float]] = {}
        self.misfit: dict[int, float] = {}
        self.body = {
            label: np.array([m.body(names.part(label, n + 1)).id for n in range(count)])
            for label, count in model.copies.items()
        }
        self.contacts = Contacts(m, self.body, model.excluded)
        self.tray = len(factory.robots) + 1
        self.feeder = {o.label: self.tray + 1 + n for n, o in enumerate(factory.leaves)}
        self.grip, self.park = self._grips(), self._parks()
        layout = model.layout
        self.presented = {o.label: presented_at(layout, o.label) for o in factory.leaves}
        self.parked = {(k, n): parked_at(layout, k, n + 1) for k, n in self.park}
        self.feed = {o.label: m.equality(names.feed(o.label)).id for o in factory.leaves}
        self.free: dict[str, deque[int]] = {
            label: deque(range(count)) for label, count in model.copies.items()
        }
        self.copy_of: dict[tuple[str, int], int] = {}
        self.shown: dict[str, int] = {}
        self.taken: set[str] = set()
        self.released = counts.get(factory.dropoff.end, 0)
        self.begun = {o.label: counts.get(o.start, 0) for o in factory.leaves}
        self.units = self.released + units
        self.next_unit = {o.label: counts.get(o.end, 0) for o in factory.leaves}
        fed = {o.carrier: o.label for o in factory.leaves}
        self.refilled = [
            [fed[r] for r, k in zip(o.robots, o.after, strict=True) if r in fed and k == NOPART]
            for o in factory.operations
        ]
        dropoff = factory.dropoff.index
        self._ends = [
            self._release if o.index == dropoff else self._pass_on if o.inputs else self._take
            for o in factory.operations
        ]
        self.hold = {label: m.equality(names.hold(label)).id for label in self.parts}
        self.on_tray: int | None = None
        self.left: list[float] = []
        holders = self.contacts.own(self._trees(), self.tray + len(self.feeder))
        plan = partial(self._reach, holders, bool(counts))
        self.vicinity = Vicinity(m, d, self.contacts, holders, plan)
        self.board = Switchboard(m, d, self.contacts, self.vicinity)
        self.weigh()
        self._hide_spares()
        self._hand_out(counts)
        for label in self.feed:
            self.feed_next(label)
        self.board.write()

    # --- feeding -------------------------------------------------------------------------------

    def presents(self, label: str, unit: int) -> bool:
        """Whether the feeder shows the part for that unit, and it may be let in."""
        allowed = self.wip is None or unit < self.released + self.wip
        return allowed and self.shown.get(label) == unit

    def feed_next(self, label: str) -> None:
        """Put the next copy into its empty feeder, if there is one to spare and a unit that needs
        it, and the robot has delivered the part it took last: until then it may still stand
        there."""
        unit = self.next_unit[label]
        if label in self.taken or label in self.shown or not self.free[label]:
            return
        if unit >= max(self.units, self.begun[label]):
            return
        copy = self.free[label].popleft()
        self.copy_of[label, unit] = copy
        self.shown[label] = unit
        self.next_unit[label] += 1
        body = int(self.body[label][copy])
        self.contacts.enter(label, unit, body)
        self.board.place([body], [self.presented[label]])
        self.board.hold([body], self.feeder[label])
        self.board.loose([self.park[label, copy]])
        self.board.join([self.feed[label]], [body])

    # --- handing over --------------------------------------------------------------------------

    def hand_over(self, ended: Sequence[tuple[Operation, int]]) -> int:
        """Switch the grips that the ends of operations ask for, each with the number of its unit: a
        feeder's too, and at dropoff all of the output robot's against those of the outfeed's tray.
        Gives how many bodies have been taken over."""
        for operation, unit in ended:
            self._ends[operation.index](operation, unit)
            for label in self.refilled[operation.index]:
                self.taken.discard(label)
                self.feed_next(label)
        return self.board.write()

    def _take(self, operation: Operation, unit: int) -> None:
        label, robot = operation.label, operation.carrier
        del self.shown[label]
        self.taken.add(label)
        body = [self.body_of(label, unit)]
        self.board.loose([self.feed[label]])
        self.board.grip([self.grip[robot, label]], body)
        self.board.hold(body, robot + 1)
        self.load[robot] = Hand(unit, [label], body)

    def _pass_on(self, operation: Operation, unit: int) -> None:
        carrier = operation.carrier
        hand = self.load.setdefault(carrier, Hand(unit))
        for robot in operation.robots:
            if robot != carrier and robot in self.load:
                given = self.load.pop(robot)
                self.board.loose([self.grip[robot, label] for label in given.labels])
                self.board.grip([self.grip[carrier, label] for label in given.labels], given.bodies)
                self.board.hold(given.bodies, carrier + 1)
                hand.labels += given.labels
                hand.bodies += given.bodies
        if operation.label in self.bodies.wholes:
            self.joining[carrier] = operation.label, float(self.d.time)

    def _release(self, operation: Operation, unit: int) -> None:
        del self.load[operation.carrier]
        bodies = self._bodies(self.parts, unit)
        self.board.loose([self.grip[operation.carrier, part] for part in self.parts])
        self.board.grip([self.hold[part] for part in self.parts], bodies)
        self.board.hold(bodies, self.tray)
        self.on_tray = unit
        self.released += 1

    # --- joined for good -----------------------------------------------------------------------

    def settle(self) -> None:
        """Let one body take the place of those that a robot has joined, once they have settled."""
        now = self.d.time
        waiting = [robot for robot, (_, since) in self.joining.items() if now - since > SETTLING]
        if waiting:
            apart = self._misfits(waiting)
            self.fuse([robot for robot in waiting if apart[robot] < RIGID], apart)
            self.board.write()

    def _misfits(self, robots: Iterable[int]) -> dict[int, float]:
        """How far out of place anything is of what each robot holds [m]."""
        return {robot: self.fusion.misfit(self.load[robot].bodies) for robot in robots}

    def fuse(self, robots: Iterable[int], apart: Mapping[int, float] = NOTHING) -> None:
        """Let one body each take the place of those that robots (index) have joined, if it has not
        yet. Where no copy of that body is free, its holder's bodies become one first. `apart`:
        misfits that are known [m]."""
        made: dict[int, str] = {}
        for robot in robots:
            if robot in self.joining:
                label, _ = self.joining.pop(robot)
                if not self.free[label]:
                    self._become_one(made, apart)
                    made = {}
                if not self.free[label]:
                    self.fuse([next(r for r in self.joining if label in self.load[r].labels)])
                made[robot] = label
        self._become_one(made, apart)

    def _become_one(self, made: Mapping[int, str], apart: Mapping[int, float]) -> None:
        """Robots get a body each, of this label, for all that they hold. Bodies that have just
        become free may be among those, so they are put away first."""
        if not made:
            return
        self.board.write()
        if not made.keys() <= apart.keys():
            apart = self._misfits(made)
        for robot in made:
            unit = self.load[robot].unit
            self.misfit[unit] = max(self.misfit.get(unit, 0.0), apart[robot])
        copies = [self.free[label].popleft() for label in made.values()]
        wholes = [int(self.body[k][n]) for k, n in zip(made.values(), copies, strict=True)]
        for robot, whole in zip(made, wholes, strict=True):
            self.fusion.fuse(self.load[robot].bodies, whole)
        self.vicinity.woken(wholes)
        for (robot, label), copy, whole in zip(made.items(), copies, wholes, strict=True):
            unit, labels = self.load[robot].unit, self.load[robot].labels
            self.board.loose([*(self.grip[robot, k] for k in labels), self.park[label, copy]])
            self._retire(labels, unit)
            self.copy_of[label, unit] = copy
            self.contacts.enter(label, unit, whole)
            self.board.join([self.grip[robot, label]], [whole])
            self.board.hold([whole], robot + 1)
            self.load[robot] = Hand(unit, [label], [whole])

    def body_of(self, label: str, unit: int) -> int:
        """The body of the part `label` in a unit."""
        return int(self.body[label][self.copy_of[label, unit]])

    def bodies_of(self, unit: int) -> np.ndarray:
        """The bodies of all parts of a unit, in the order of `parts`."""
        return np.array(self._bodies(self.parts, unit))

    def _bodies(self, labels: Sequence[str], unit: int) -> list[int]:
        return [self.body_of(label, unit) for label in labels]

    def finished(self, unit: int) -> tuple[np.ndarray, float]:
        """The bodies of a finished product, and its misfit [m]."""
        return self.bodies_of(unit), self.misfit.get(unit, 0.0)

    def loads(self) -> dict[int, float]:
        """What each robot that holds something carries [kg]."""
        found: dict[int, float] = {}
        for (robot, part), weld in self.grip.items():
            if self.d.eq_active[weld]:
                found[robot] = found.get(robot, 0.0) + self.bodies.mass[part]
        return found

    # --- the outfeed ---------------------------------------------------------------------------

    def recycle(self) -> None:
        """Return the bodies of the product on the tray to their feeders, out of sight."""
        unit, self.on_tray = self.on_tray, None
        assert unit is not None
        self.left.append(float(self.d.time))
        self.misfit.pop(unit, None)
        self.board.loose([self.hold[part] for part in self.parts])
        self._retire(self.parts, unit)
        self.board.write()

    def _retire(self, labels: Sequence[str], unit: int) -> None:
        """Return bodies of a unit out of sight, and parts to their feeders where those are
        empty."""
        copies = [self.copy_of.pop((label, unit)) for label in labels]
        for label in labels:
            self.contacts.leave(label, unit)
        self._put_away(labels, copies)
        for label, copy in zip(labels, copies, strict=True):
            self.free[label].append(copy)
            if label in self.feed:
                self.feed_next(label)

    # --- welds and bodies ----------------------------------------------------------------------

    def _grips(self) -> dict[tuple[int, str], int]:
        found: dict[tuple[int, str], int] = {}
        for robot in self.model.factory.robots:
            for label in self.bodies.handled(self.model.factory, robot.index):
                found[robot.index, label] = self.m.equality(names.grip(robot.name, label)).id
        return found

    def weigh(self) -> None:
        """From now on bodies have the masses that the model has."""
        places, radii = np.zeros((self.m.nbody, 3)), np.zeros(self.m.nbody)
        for label, ids in self.body.items():
            places[ids], radii[ids] = self.bodies.centre[label], self.bodies.radius[label]
        self.fusion = Fusion(self.m, self.d, places, radii)

    def _trees(self) -> dict[int, int]:
        """The code of the holder that each kinematic tree with a grip is."""
        tree, one = self.m.body_treeid, self.m.eq_obj1id
        found = {int(tree[one[weld]]): robot + 1 for (robot, _), weld in self.grip.items()}
        return found | {int(tree[one[weld]]): self.tray for weld in self.hold.values()}

    def _reach(self, holders: int, begun: bool) -> tuple[Reach, dict[tuple[int, str], int], Array]:
        """What the vicinity is told. Where a marking has `begun`, robots have at first whatever
        they ever have."""
        layout, robots = self.model.layout, self.model.factory.robots
        first = [Load(holder) for holder in range(holders + 1)]
        grips: dict[int, list[int]] = {robot.index: [] for robot in robots}
        for (robot, _), weld in self.grip.items() if begun else ():
            grips[robot].append(weld)
        for (robot, welds), path in zip(grips.items(), layout.guidepaths, strict=True):
            first[robot + 1] = Load(robot + 1, tuple(welds), 0.0, path.length)
        for label, holder in self.feeder.items():
            first[holder] = Load(holder, (self.feed[label],))
        first[self.tray] = Load(self.tray, tuple(self.hold.values()), 0.0, layout.outfeed_way)
        slides = {robot.index + 1: names.slide(robot.name) for robot in robots}
        slides[self.tray] = names.OUTFEED_SLIDE
        joints = {holder: self.m.joint(name).id for holder, name in slides.items()}
        others = loads(self.model, self.grip)
        settings = self.model.settings
        asked = np.full(len(first), settings.acceleration)
        asked[self.tray] = settings.outfeed_acceleration
        margins = margin(asked, settings.stride * settings.tick)
        reach = Reach(self.m, self.d, self.contacts, [*first, *others.values()], joints, margins)
        numbers = {key: n for n, key in enumerate(others, start=len(first))}
        return reach, numbers, asked

    def _put_away(self, labels: Sequence[str], copies: Sequence[int]) -> None:
        spares = list(zip(labels, copies, strict=True))
        bodies = [int(self.body[label][copy]) for label, copy in spares]
        self.board.place(bodies, [self.parked[spare] for spare in spares])
        self.board.hold(bodies, NOBODY)
        self.board.join([self.park[spare] for spare in spares], bodies)

    def _hand_out(self, counts: Mapping[int, int]) -> None:
        """Give the parts that are under way in a marking to the robots that carry them: that of the
        last operation on its way that has ended for its unit."""
        factory = self.model.factory
        for leaf in factory.leaves:
            for unit in range(self.released, counts.get(leaf.end, 0)):
                holder = operation = leaf
                while (
                    operation.index != factory.dropoff.index and counts.get(operation.end, 0) > unit
                ):
                    holder = operation
                    operation = factory.operations[factory.parents[operation.index]]
                if holder.carrier == leaf.carrier:
                    self.taken.add(leaf.label)
                for label in self.bodies.carried[holder.label]:
                    if (label, unit) not in self.copy_of:
                        self._give(label, unit, holder.carrier)

    def _give(self, label: str, unit: int, robot: int) -> None:
        """Put a copy into a robot's hands."""
        copy = self.free[label].popleft()
        self.copy_of[label, unit] = copy
        body, weld = int(self.body[label][copy]), self.grip[robot, label]
        mujoco.mj_kinematics(self.m, self.d)
        at = held_at(self.m, self.d, np.array([weld]))[0]
        self.contacts.enter(label, unit, body)
        self.board.place([body], [(float(at[0]), float(at[1]), float(at[2]))])
        self.board.hold([body], robot + 1)
        self.board.loose([self.park[label, copy]])
        self.board.join([weld], [body])
        hand = self.load.setdefault(robot, Hand(unit))
        hand.labels.append(label)
        hand.bodies.append(body)

    def _hide_spares(self) -> None:
        self.board.loose([*self.feed.values(), *self.hold.values()])
        spares = [(label, n) for label, bodies in self.body.items() for n in range(len(bodies))]
        self._put_away([label for label, _ in spares], [n for _, n in spares])

    def _parks(self) -> dict[tuple[str, int], int]:
        return {
            (label, copy): self.m.equality(names.park(label, copy + 1)).id
            for label, bodies in self.body.items()
            for copy in range(len(bodies))
        }
