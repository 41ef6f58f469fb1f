"""Which forms leave a robot without a hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from factory.layout.hands.misses import NoGrip
from factory.pipeline import Project
from factory.plant.factory import Factory, Operation
from factory.problem.plan import THIRD


def blamed(project: Project, forms: Mapping[str, int]) -> Iterator[tuple[str, int]]:
    """Of each robot of a project that no hand suits one form, with its pile, that is likely the
    cause: of the joins on it that where what comes is most in the way, else that where it delivers;
    nothing where these have no such form."""
    factory = project.plain
    robots = {robot.name: robot for robot in factory.robots}
    for found in project.no_grips:
        robot = robots[found.robot]
        made = [factory.operations[number] for number in robot.operations]
        kept = [o for o in made if forms.get(o.label, THIRD) != THIRD]
        own = [o for o in kept if o.carrier == robot.index] or kept
        if own:
            label = max(own, key=lambda o: _in_the_way(found, o, factory)).label
            yield label, forms[label]


def _in_the_way(found: NoGrip, operation: Operation, factory: Factory) -> tuple[int, int]:
    """How many of the parts that come in an operation are in the way of hands, and how late it
    is."""
    carrier = operation.template.carrier - 1
    come = {
        part
        for slot, label in enumerate(operation.before)
        if slot != carrier and label in factory.contents
        for part in factory.contents[label]
    }
    return sum(part in come for miss in found.misses for part in miss.parts), -operation.index
