"""Tours: what robots hold is judged tour by tour, as if each tour had a robot of its own.

Robots that share a line hold different things in different operations. All that is known of a hand
and what could be in its way is of one such tour; a hand of a line has to suit all of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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
            tour for robot in factory.robots if _turns(factory, robot) for tour in of[robot.index]
        )
        return cls(made, tuple(of), frozenset(turning))


def _turns(factory: Factory, robot: Robot) -> bool:
    """Whether some robot delivers to a robot more than once, or works on what it holds."""
    operations = (factory.operations[number] for number in robot.operations)
    guests = [g for o in operations if o.carrier == robot.index for g in o.robots]
    others = [guest for guest in guests if guest != robot.index]
    return len(set(others)) < len(others)
