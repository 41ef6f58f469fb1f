"""The numbers by which the parts of a factory are named, each of a type of its own, and which
transitions of the compiled net are the start and the end of an operation."""

from __future__ import annotations

from typing import NewType

RobotId = NewType("RobotId", int)
"""A robot, by its place in `Factory.robots`; its gear has the same number."""

OperationId = NewType("OperationId", int)
"""An operation, by its place in `Factory.operations`."""

AxisId = NewType("AxisId", int)
"""An axis that moves: the carriages of all robots, which have the robots' numbers, then lifts."""

PlaceId = NewType("PlaceId", int)
"""A place of a net, by its place in `PetriNet.places`."""

TransitionId = NewType("TransitionId", int)
"""A transition of a net, by its place in `PetriNet.transitions`."""


def carriage_axis(robot: int) -> AxisId:
    """The axis of a robot's carriage."""
    return AxisId(robot)


def start_of(operation: int) -> TransitionId:
    """The transition X_s with which an operation starts."""
    return TransitionId(2 * operation)


def end_of(operation: int) -> TransitionId:
    """The transition X_e with which an operation ends."""
    return TransitionId(2 * operation + 1)


def operation_of(transition: int) -> OperationId:
    """The operation that a transition of the compiled net starts or ends."""
    return OperationId(transition // 2)


def is_end(transition: int) -> bool:
    """Whether a transition of the compiled net ends its operation."""
    return transition % 2 == 1
