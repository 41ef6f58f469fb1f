"""Transfers of parts: the operation and the unit that a switch of grips ends, and switches that
belong to no operation."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from factory.api import NOPART, MonitorSubject, Operation
from factory.apps.monitor.anatomy import FEED, GRIP, HOLD, PARK, Anatomy, Holder
from factory.apps.monitor.grips import Switch

Blame = Callable[[str, int, str, str], None]
"""Records a violation: its code, the robot (-1 for none), the label, and the message."""


class Transfers:
    """The holder of each copy, its unit (the k-th copy that a feeder presents is for unit k), and
    the number of ends of each operation that moves parts. Units that are not made do not count."""

    def __init__(self, subject: MonitorSubject, anatomy: Anatomy, blame: Blame) -> None:
        self.subject, self.anatomy, self.blame = subject, anatomy, blame
        factory = subject.factory
        self.at: list[Holder | None] = [None] * len(anatomy.copies)
        self.unit = [-1] * len(anatomy.copies)
        self.ended = [subject.before(o) for o in factory.operations]
        self.presented = {o.label: subject.before(o) for o in factory.leaves}
        self.load: dict[Holder, set[int]] = {}
        contents = {label: frozenset(parts) for label, parts in factory.contents.items()}
        self.contents, self.inside = contents, [contents[label] for label in anatomy.label]

    def begin(self, switches: Sequence[Switch]) -> None:
        """Record the holders at the start; blame loads that the marking does not explain."""
        factory = self.subject.factory
        for switch in switches:
            holder = self._holder(switch)
            if holder is None:
                continue
            self._put(switch.copy, holder)
            if holder[0] == FEED:
                self._present(switch.copy)
        for robot in factory.robots:
            made = self._made(robot.index)
            label = made.label if made else NOPART
            copies = self.load.get((GRIP, robot.index), set())
            for copy in copies:
                self.unit[copy] = self.ended[made.index] - 1 if made else -1
            self._complete(robot.index, label, copies, "Start")

    def judge(self, switches: Sequence[Switch]) -> list[tuple[Operation, int]]:
        """The operations that have ended, each with its period."""
        passed: dict[int, list[int]] = {}
        for switch in self._fused(switches):
            holder, before = self._holder(switch), self.at[switch.copy]
            if holder is None or holder == before:
                continue
            operation = self._operation(switch.copy, before, holder)
            self._put(switch.copy, holder)
            if holder[0] == FEED:
                self._present(switch.copy)
            elif holder[0] == PARK:
                self.unit[switch.copy] = -1
            if operation is not None:
                passed.setdefault(operation.index, []).append(switch.copy)
        return [self._end(number, copies) for number, copies in sorted(passed.items())]

    def _fused(self, switches: Sequence[Switch]) -> list[Switch]:
        """The switches, without those that replace several bodies in one robot by one body of the
        same parts: the several are parked, and the one was parked, or is parked by another robot
        at the same time."""
        at = self.at
        gone: dict[Holder, list[int]] = {}
        for switch in switches:
            held = at[switch.copy]
            if held and held[0] == GRIP and held not in self._holders(switch):
                gone.setdefault(held, []).append(switch.copy)
        if not gone:
            return list(switches)
        became = self._became(switches, gone)
        inside = {copy for _, _, copies in became for copy in copies}
        units = [self._unit_of(*change) for change in became]
        for copy in inside:
            self._put(copy, (PARK, -1))
            self.unit[copy] = -1
        for (whole, holder, _), unit in zip(became, units, strict=True):
            self._put(whole, holder)
            self.unit[whole] = unit
        away = {s.copy for s in switches if s.copy in inside and (PARK, -1) in self._holders(s)}
        return [switch for switch in switches if switch.copy not in away]

    def _became(
        self, switches: Sequence[Switch], gone: dict[Holder, list[int]]
    ) -> list[tuple[int, Holder, list[int]]]:
        """The copies that replace others: each with the holder and the numbers of those. A parked
        copy comes before one that is reused at once."""
        replacing = []
        having: dict[str, dict[Holder, None]] = {}
        for holder, copies in gone.items():
            for part in (part for copy in copies for part in self.inside[copy]):
                having.setdefault(part, {})[holder] = None
        fresh = [s for s in switches if self.at[s.copy] and (PARK, -1) not in self._holders(s)]
        for switch in sorted(fresh, key=lambda s: self.at[s.copy] != (PARK, -1)):
            parts = self.inside[switch.copy]
            for holder in having.get(next(iter(parts)), ()):
                copies = gone[holder]
                inside = [c for c in copies if self.inside[c] < parts]
                if sum(len(self.inside[c]) for c in inside) == len(parts):
                    replacing.append((switch.copy, holder, inside))
                    gone[holder] = [c for c in copies if c not in inside]
                    break
        return replacing

    def _holders(self, switch: Switch) -> set[Holder]:
        """The present holders of a copy."""
        return {holder for weld in switch.after if (holder := self.anatomy.holder[weld])}

    def _unit_of(self, whole: int, holder: Holder, copies: Sequence[int]) -> int:
        """The unit of the copies that a robot held and one body replaces; blame copies for several
        units."""
        units = {self.unit[copy] for copy in copies}
        if len(units) > 1:
            name, label = self.anatomy.copies[whole], self.anatomy.label[whole]
            message = f"{name} is made of parts for units {sorted(units)}"
            self.blame("Exchanged", holder[1], label, message)
        return max(units)

    # --- one copy ------------------------------------------------------------------------------

    def _holder(self, switch: Switch) -> Holder | None:
        """The present holder of a copy. Blame no holder, two holders, or a hold as another part."""
        anatomy, label = self.anatomy, self.anatomy.label[switch.copy]
        before, name = self.at[switch.copy], anatomy.copies[switch.copy]
        if not switch.after:
            robot = before[1] if before else -1
            self.blame(
                "Dropped", robot, label, f"nothing holds {name}, which {self._named(before)} held"
            )
            return None
        wrong = [w for w in switch.after if anatomy.part[w] != label]
        if wrong:
            holder = anatomy.holder[wrong[0]]
            message = f"{self._named(holder)} holds {name} in place of {anatomy.part[wrong[0]]}"
            self.blame("Exchanged", holder[1] if holder else -1, label, message)
        holders = [holder for w in switch.after if (holder := anatomy.holder[w])]
        fresh = [h for w, h in zip(switch.after, holders, strict=True) if w not in switch.before]
        if len(holders) > 1:
            old = next((h for h in holders if h == before), holders[0])
            both = " and ".join(self._named(h) for h in holders)
            self.blame("TwoHolders", old[1], label, f"{both} both hold {name}")
        return fresh[-1] if fresh else holders[0]

    def _operation(self, copy: int, before: Holder | None, after: Holder) -> Operation | None:
        """The operation whose end passes a copy from `before` to `after`; None where none is
        needed. Blame a transfer that no operation does."""
        factory, label = self.subject.factory, self.anatomy.label[copy]
        operation: Operation | None = None
        if before and (before[0], after[0]) in ((PARK, FEED), (HOLD, FEED), (HOLD, PARK)):
            return None
        if after[0] == GRIP and before and before[0] == FEED:
            operation = factory.by_label[label]
        elif before and before[0] == GRIP and after[0] in (GRIP, HOLD):
            operation = self._delivery(before[1], label)
        takes = operation is not None and (
            after == (GRIP, operation.carrier)
            if not factory.drops(operation.index)
            else after[0] == HOLD
        )
        if operation is None or not takes:
            robot = after[1] if after[1] >= 0 else before[1] if before else -1
            name = self.anatomy.copies[copy]
            words = f"{name} passes from {self._named(before)} to {self._named(after)}"
            self.blame("Exchanged", robot, label, f"{words}, which no operation does")
            return None
        return operation

    def _delivery(self, robot: int, label: str) -> Operation:
        """The operation in which a robot delivers a body of some label."""
        factory = self.subject.factory
        part = factory.contents[label][0]
        ends = [factory.operations[tour[-1]] for tour in factory.tours[robot]]
        of = (o for o in ends if part in factory.contents[o.before[o.robots.index(robot)]])
        return next(of) if len(ends) > 1 else ends[0]

    def _put(self, copy: int, holder: Holder) -> None:
        before = self.at[copy]
        if before is not None:
            self.load.get(before, set()).discard(copy)
        self.at[copy] = holder
        if holder[0] in (GRIP, HOLD):
            self.load.setdefault(holder, set()).add(copy)

    def _present(self, copy: int) -> None:
        label = self.anatomy.label[copy]
        self.unit[copy] = self.presented[label]
        self.presented[label] += 1

    # --- one operation -------------------------------------------------------------------------

    def _end(self, number: int, copies: Sequence[int]) -> tuple[Operation, int]:
        """Count the end of an operation, and check the load of its carrier."""
        operation = self.subject.factory.operations[number]
        unit = self.ended[number]
        self.ended[number] += 1
        last = self.subject.factory.drops(number)
        holder = (HOLD, -1) if last else (GRIP, operation.carrier)
        label = operation.before[0] if last else operation.label
        load = self.load.get(holder, set())
        self._complete(operation.carrier, label, load, "Exchanged")
        others = [copy for copy in {*load, *copies} if self.unit[copy] != unit]
        if others:
            others.sort()
            name, other = self.anatomy.copies[others[0]], self.unit[others[0]]
            self.blame(
                "Exchanged",
                operation.carrier,
                self.anatomy.label[others[0]],
                f"{name}, which is for unit {other}, is put into unit {unit} by"
                f" {self.subject.name(operation)}",
            )
            for copy in others:
                self.unit[copy] = unit
        return operation, self.subject.nth(operation, unit)

    def _complete(self, robot: int, label: str, copies: set[int], code: str) -> None:
        """Blame missing and extra parts in a load that should be the sub-assembly `label`."""
        wanted = self.contents.get(label, frozenset())
        held = [self.inside[copy] for copy in copies]
        if sum(map(len, held)) == len(wanted) and all(parts <= wanted for parts in held):
            return
        contents, names = self.subject.factory.contents, self.anatomy.label
        inner = [inside for copy in sorted(copies) for inside in contents[names[copy]]]
        missing, extra = sorted(wanted - set(inner)), sorted(set(inner) - wanted)
        twice = sorted({part for part in inner if inner.count(part) > 1}) if not extra else []
        for part, what in [
            *((p, f"lacks {p}") for p in missing[:1]),
            *((p, f"has {p} in excess") for p in extra[:1]),
            *((p, f"has {p} twice") for p in twice[:1]),
        ]:
            what_of = "its load" if label == NOPART else label
            self.blame(code, robot, part, f"{what_of} {what}")

    def _made(self, robot: int) -> Operation | None:
        """The operation that made the load of a robot in the marking at the start."""
        counts, factory = self.subject.counts, self.subject.factory
        gear = [factory.operations[o] for o in factory.robots[robot].operations]
        done = sum(counts.get(o.end, 0) for o in gear)
        last = gear[done % len(gear) - 1]
        carries = last.carrier == robot and not factory.drops(last.index)
        carries = carries and self.subject.is_made(last, counts.get(last.end, 0) - 1)
        return last if done and carries and last.after[last.robots.index(robot)] != NOPART else None

    def _named(self, holder: Holder | None) -> str:
        if holder is None:
            return "nothing"
        if holder[0] == GRIP:
            return self.subject.factory.robots[holder[1]].name
        return {PARK: "its parking place", FEED: "its feeder", HOLD: "the outfeed"}[holder[0]]
