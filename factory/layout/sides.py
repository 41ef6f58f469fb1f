"""From which side the inputs of an operation come: one from which they can.

They come along the carrier's side t, from either end of it. Which of the two lets them slide
together without passing through each other is known of each operation (`plant/approaches.py`), in
the directions of the product; what t is follows from the sides of all carriers on the way to the
output robot.
"""

from __future__ import annotations

from factory.layout.layout import Point2
from factory.layout.shapes import carriers
from factory.layout.stretching import Sides
from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART


def admissible(factory: Factory, sides: Sides) -> Sides:
    """The sides, with the robots of each operation swapped whose inputs cannot come from there.

    Carriers first: a swap turns the frames of all that comes after. Linear.
    """
    axes: list[tuple[Point2, Point2]] = []
    result = dict(sides)
    for robot, carrier in zip(factory.robots, carriers(factory), strict=True):
        u, t = (1.0, 0.0), (0.0, 1.0)
        if carrier >= 0:
            (u_on, t_on), side = axes[carrier], result[robot.index]
            u, t = (-side * t_on[0], -side * t_on[1]), u_on
        axes.append((u, t))
        for number in robot.operations:
            operation = factory.operations[number]
            if operation.carrier == robot.index and not admitted(operation, result, t):
                for guest in operation.robots:
                    if guest != robot.index:
                        result[guest] = -result[guest]
    return result


def admitted(operation: Operation, sides: Sides, t: Point2) -> bool:
    """Whether the inputs of an operation can come from where they do."""
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
