"""Operations: instances of templates; operation i has start 2i, end 2i + 1 and operation place i
in the net (paper, section 4.3)."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.support.errors import Position
from factory.theory.plant.approaches import Approach
from factory.theory.problem.ids import (
    OperationId,
    PlaceId,
    RobotId,
    TransitionId,
    end_of,
    start_of,
)
from factory.theory.problem.pag import NOPART
from factory.theory.problem.plan import out_of_turn
from factory.theory.problem.template import Template


@dataclass(frozen=True, slots=True)
class Operation:
    """A template instantiated: O(r_1, ..., r_k) (section 4.3).

    Attributes:
        index: its number in `Factory.operations`.
        label: label of its result; `dropoff` for the last.
        template: its template.
        robots: indices into `Factory.robots`, in the template's order.
        before: label that each robot carries when it starts; NOPART for none.
        after: label that each robot carries when it ends.
        dwell: time that it takes at its goal [s].
        position: the user's line; not compared.
        approach: how its inputs come together; None where that is free.
        turn: the unit of a period that it is for, from 0.
    """

    index: OperationId
    label: str
    template: Template
    robots: tuple[RobotId, ...]
    before: tuple[str, ...]
    after: tuple[str, ...]
    dwell: float = 0.0
    position: Position | None = field(default=None, compare=False)
    approach: Approach | None = field(default=None, repr=False)
    turn: int = 0

    @property
    def written(self) -> str:
        """The label without its turn: as the PAG has it, or one pile of such a label."""
        return out_of_turn(self.label, self.turn)

    @property
    def carrier(self) -> RobotId:
        """The robot that holds the result (index into `Factory.robots`)."""
        return self.robots[self.template.carrier - 1]

    @property
    def inputs(self) -> tuple[str, ...]:
        """The labels brought, in the order of the robots."""
        return tuple(label for label in self.before if label != NOPART)

    @property
    def taken(self) -> tuple[str, ...]:
        """The labels brought, in the order of the template's inputs."""
        brought = dict(zip(self.template.before, self.before, strict=True))
        return tuple([brought[variable] for variable in self.template.inputs])

    @property
    def pile(self) -> str:
        """The label that the carrier holds before, NOPART for none."""
        return self.before[self.template.carrier - 1]

    def awaits_empty(self, slot: int) -> bool:
        """Whether the robot in a slot waits for others and carries nothing."""
        return len(self.robots) > 1 and self.before[slot] == NOPART

    @property
    def lowered(self) -> int:
        """The slot of the robot that lowers what it brings, -1 for none."""
        if self.approach is None or not self.approach.lowered:
            return -1
        return self.before.index(self.approach.lowered)

    @property
    def last(self) -> int:
        """The slot of the robot that brings the last input, -1 for none."""
        inputs = self.template.inputs
        return self.template.before.index(inputs[-1]) if inputs else -1

    def sides(self, robot: int) -> set[int]:
        """Sides of the approach axis from which one of its robots (index) may come to it."""
        slot, approach = self.robots.index(robot), self.approach
        if approach is None or self.before[slot] == NOPART:
            return {-1, +1}
        turned = 1 if slot == self.last else -1
        return {turned * side for side in approach.sides}

    def delivery(self, robot: int) -> tuple[object, ...]:
        """How one of its robots (index) ends a tour with it: `tool` with its template and the slot,
        `inserted` into what the carrier holds, or `taken` by a carrier that holds nothing, and
        whether it is lowered."""
        slot = self.robots.index(robot)
        if self.before[slot] == NOPART:
            return "tool", self.template.name, slot
        return "taken" if self.pile == NOPART else "inserted", self.lowered == slot

    @property
    def start(self) -> TransitionId:
        """The transition X_s."""
        return start_of(self.index)

    @property
    def end(self) -> TransitionId:
        """The transition X_e."""
        return end_of(self.index)

    @property
    def place(self) -> PlaceId:
        """The operation place [X_s; X_e]."""
        return PlaceId(self.index)
