"""The sides from which the inputs of an operation come, such that they can.

They come along the carrier's side t, from either end of it. From which of the two they can slide
together without passing through each other is known for each operation (`plant/approaches.py`), in
the directions of the product; t follows from the sides of all carriers on the way to the output
robot.
"""

from __future__ import annotations

from factory.floor.layout.branches import carriers
from factory.floor.layout.shapes import OUTPUT, Frame, Sides, turned
from factory.support.boxes import Point2
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.problem.pag import NOPART


def admissible(factory: Factory, sides: Sides) -> Sides:
    """The sides, with the robots of an operation swapped where its inputs cannot come from there.
    Carriers first: a swap turns the frames of all that comes after. Linear."""
    frames: list[Frame] = []
    result = dict(sides)
    for robot, carrier in zip(factory.robots, carriers(factory), strict=True):
        frames.append(turned(frames[carrier], result[robot.index]) if carrier >= 0 else OUTPUT)
        for number in robot.operations:
            operation = factory.operations[number]
            if operation.carrier == robot.index and not admitted(operation, result, frames[-1][1]):
                for guest in operation.robots:
                    if guest != robot.index:
                        result[guest] = -result[guest]
    return result


def admitted(operation: Operation, sides: Sides, t: Point2) -> bool:
    """Whether the inputs of an operation can come from their sides."""
    approach = operation.approach
    if approach is None or len(operation.inputs) < 2:
        return True
    last, carrier = operation.last, operation.template.carrier - 1
    turned = 1
    if last == carrier:
        last = next(s for s, x in enumerate(operation.before) if x != NOPART and s != carrier)
        turned = -1
    along = t[approach.axis]
    if not along:
        raise AssertionError(f"'{operation.label}' was judged along the wrong axis")
    return round(turned * sides[operation.robots[last]] * along) in approach.sides
