"""Stages: moves of waiting robots towards their next operation, by the supervisor's mode
numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from factory.floor.modes.staging import HeadStart
from factory.support.arrays import Array
from factory.theory.plant.factory import Factory


class Ahead:
    """The stages of waiting robots, numbered after the operations: the moves of `HeadStart`.

    Attributes:
        of: by operation (index), its stages.
        after: by operation (index), the stages that begin when it has ended.
        place: by stage, the place in which the robot waits.
        follows: by stage, the operation (index) before it.
        then: by stage, the one that comes next.
    """

    def __init__(self, factory: Factory, stages: Sequence[HeadStart]) -> None:
        count = len(factory.operations)
        self.of: list[list[int]] = [[] for _ in range(count)]
        self.after: list[list[int]] = [[] for _ in range(count)]
        self.place, self.follows = dict[int, int](), dict[int, int]()
        self.then: dict[int, int] = {}
        self._stages = dict(enumerate(stages, start=count))
        for number, stage in enumerate(stages, start=count):
            gear = factory.robots[stage.robot].operations
            step = gear.index(stage.operation)
            self.of[stage.operation].append(number)
            if stage.follows:
                self.then[number - 1] = number
            else:
                self.after[gear[step - 1]].append(number)
            self.follows[number] = gear[step - 1]
            self.place[number] = factory.net.gears[stage.robot].waiting(step)

    def going(self, active: Iterable[int]) -> dict[int, HeadStart]:
        """The stages among the active modes, by number."""
        return {n: self._stages[n] for n in active if n in self._stages}

    def waiting(self, marked: bytearray, x: Array) -> list[int]:
        """The stages of robots that wait at the start of a run, with axes at `x`, away from where
        they are needed."""
        past = {n: stage.is_past(float(x[stage.axis])) for n, stage in self._stages.items()}
        return [
            number
            for number, stage in self._stages.items()
            if marked[self.place[number]] and not past[number]
            if not stage.follows or past[number - 1]
        ]
