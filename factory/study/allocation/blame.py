"""Which forms leave a robot without a hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from factory.layout.hands.misses import NoGrip
from factory.pipeline import Project
from factory.plant.factory import Factory, Operation
from factory.study.allocation.forms import THIRD, FormsTask


def blamed(
    task: FormsTask, project: Project, forms: Mapping[str, int]
) -> Iterator[tuple[str, int]]:
    """Of each robot of a project that no hand suits one form, with its pile, that is likely the
    cause: of the joins on it that where what comes is most in the way, else that where it delivers;
    nothing where these have no such form."""
    factory = project.plain
    known = joins_of(task, project)
    robots = {robot.name: robot for robot in factory.robots}
    for found in project.no_grips:
        robot = robots[found.robot]
        made = [factory.operations[number] for number in robot.operations]
        joins = [(known[o.label], o) for o in made if o.label in known]
        kept = [(j, o) for j, o in joins if forms.get(j, THIRD) != THIRD]
        own = [(j, o) for j, o in kept if o.carrier == robot.index] or kept
        if own:
            label, _ = max(own, key=lambda pair: _in_the_way(found, pair[1], factory))
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


def joins_of(task: FormsTask, project: Project) -> dict[str, str]:
    """The joins of the task by the labels that they have in a project with other forms: what has
    the same parts is the same join."""
    wanted = {
        frozenset(parts): label
        for label, parts in _contents(task).items()
        if len(task.nodes[label].inputs) > 1
    }
    factory = project.plain
    return {
        o.label: wanted[frozenset(factory.contents[o.label])]
        for o in factory.operations[:-1]
        if len(o.inputs) > 1
    }


def _contents(task: FormsTask) -> dict[str, tuple[str, ...]]:
    """The parts of each label of the task."""
    found: dict[str, tuple[str, ...]] = {}
    for label, node in task.nodes.items():
        found[label] = tuple(part for x in node.inputs for part in found[x]) or (label,)
    return found
