"""The conditions NeedsTurn and Blocked of fixed robots: a part that is presented turned about the
vertical is taken by a robot that turns it back, and what a fixed robot brings can be lowered.

Until it is turned back, a part may be handed over from robot to robot, and nothing else may be done
with it: its joints, and the tools that work on it, are where they are in the product.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from factory.support.errors import Diagnostic, InputError
from factory.theory.compiler.expanding import Node
from factory.theory.plant.factory import Factory
from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.pag import NOPART, PAG
from factory.theory.problem.robot_types import Catalogue


def check_turned(
    pag: PAG, robots: Sequence[Robot], operations: Sequence[Operation]
) -> Iterator[Diagnostic]:
    """Every part that is presented turned and is joined, or worked on, as it is (NeedsTurn); and
    every operation to which a fixed robot brings what cannot be lowered (Blocked)."""
    fed = [part for part in pag.parts() if part.parameter("fed")]
    taking = {label: o for o in operations if fed for label in o.inputs}
    for part in fed:
        label, operation = part.label, taking[part.label]
        bringing = robots[operation.robots[operation.before.index(label)]]
        if bringing.body.first.moves:  # it turns what it brings as it likes
            continue
        while not (turns := _turns(robots, operation)) and _hands_over(operation):
            label, operation = operation.label, taking[operation.label]
        if not turns:
            others = [x for x in operation.inputs if x != label] or ["base"]
            yield Diagnostic(
                "NeedsTurn",
                f"'{part.label}' is presented turned by {part.parameter('fed'):g} rad about the"
                f" vertical, and '{operation.template.name}' turns nothing",
                part.position,
                f"write place ( {', '.join([*others, label])} ): a manipulator turns it",
            )
    yield from _not_lowered(robots, operations)


def _turns(robots: Sequence[Robot], operation: Operation) -> bool:
    """Whether the carrier of an operation turns what it takes."""
    return robots[operation.carrier].kind.turns


def _hands_over(operation: Operation) -> bool:
    """Whether one robot takes over what another brings, and nothing else is done: no tool works,
    and the carrier brings nothing."""
    alone = len(operation.inputs) == 1 and len(operation.robots) == 2
    return alone and not operation.template.tools() and operation.pile == NOPART


def _not_lowered(robots: Sequence[Robot], operations: Sequence[Operation]) -> Iterator[Diagnostic]:
    """Operations to which a fixed robot brings what slides, or is blocked."""
    for o in operations:
        if o.approach is None:
            continue
        for robot, label in zip(o.robots, o.before, strict=True):
            if label == NOPART or robots[robot].travels:
                continue
            if label != o.approach.lowered:
                message = f"'{label}' cannot be lowered in '{o.label}', as {o.template.name} does"
                hint = "leave the way from above free, or let it slide: mate ( ... )"
                yield Diagnostic("Blocked", message, o.position, hint)


def check_shapes(factory: Factory, shaped: bool) -> None:
    """Raises InputError (Blocked) where a product whose parts are not `shaped` has fixed robots: of
    default boxes it is not known what can be lowered."""
    fixed = [robot for robot in factory.robots if not robot.travels and not shaped]
    if fixed:
        labels = (factory.deliveries(robot.index)[0] for robot in fixed)
        hint = "give parts shapes: box = ( 0.04, 0.02, 0.03 ), pos = ( 0, 0, 0.037 )"
        raise InputError(
            Diagnostic("Blocked", f"'{x}' cannot be lowered: no part has a shape", r.position, hint)
            for r, x in zip(fixed, labels, strict=True)
        )


def placed(nodes: Mapping[str, Node], catalogue: Catalogue) -> dict[str, str]:
    """By operations the input that a fixed robot brings to each, and so lowers."""
    inputs = dict[str, str]()
    for label, node in nodes.items():
        of = node.template
        for variable, taken in zip(of.inputs, node.inputs, strict=True):
            wanted = catalogue.types.get(of.robots[of.before.index(variable)])
            if wanted is not None and not wanted.travels:
                inputs[label] = taken
    return inputs
