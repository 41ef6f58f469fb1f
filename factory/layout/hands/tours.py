"""Tours: what robots hold is judged tour by tour, as if each tour had a robot of its own.

Robots that share a line hold different things in different operations. All that is known of a hand
and what could be in its way is of one such tour; a hand of a line has to suit all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from factory.layout.stops import stops_of
from factory.plant.factory import Factory, Robot


@dataclass(frozen=True, slots=True)
class Tours:
    """A `factory` with a robot for each tour of another; `of`: for each robot of that the robots
    of its tours; `turning`: those of robots that go back to where they have been before, since one
    that delivers there comes again."""

    factory: Factory
    of: tuple[tuple[int, ...], ...]
    turning: frozenset[int] = frozenset()

    @classmethod
    def apart(cls, factory: Factory) -> Tours:
        """Those of a factory, which stays itself where no robot has several."""
        if not factory.folded:
            return cls(factory, tuple((robot.index,) for robot in factory.robots))
        of, robots = list[tuple[int, ...]](), list[Robot]()
        for robot, tours in zip(factory.robots, factory.tours, strict=True):
            of.append(tuple(range(len(robots), len(robots) + len(tours))))
            robots += [
                replace(robot, index=n, operations=tour)
                for n, tour in zip(of[-1], tours, strict=True)
            ]
        operations = tuple(
            replace(o, robots=tuple(of[r][factory.turns[o.index, r]] for r in o.robots))
            for o in factory.operations
        )
        made = replace(factory, robots=tuple(robots), operations=operations, adjusted=frozenset())
        turning = (
            tour
            for robot in factory.robots
            if stops_of(factory, robot.index)[1]
            for tour in of[robot.index]
        )
        return cls(made, tuple(of), frozenset(turning))

    def alike(self, tours: Sequence[int]) -> tuple[int, ...]:
        """For each of some tours the first of them that is the same but for the unit of a period
        that it is for: one hand has the same place on both."""
        first = dict[object, int]()
        return tuple(first.setdefault(self._done(tour), tour) for tour in tours)

    def _done(self, tour: int) -> object:
        numbers = self.factory.robots[tour].operations
        done = (self.factory.operations[number] for number in numbers)
        return tuple((operation.written, operation.robots.index(tour)) for operation in done)
