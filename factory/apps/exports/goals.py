"""The goals of a factory's operations in the coordinates of the MJCF that is written, for a
controller that is not ours: where which actuators have to be, and which welds are switched then."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from factory.api import NOPART, Model, Operation, names
from factory.apps.exports.stock import scales_of
from factory.floor.modes.modes import operation_modes

Json = dict[str, Any]


def goals(model: Model) -> Json:
    """The operations of a model in an order in which one unit can be made, one after another.

    Each with its template, the label that it makes, its robots and its carrier, its dwell [s], the
    goals of actuators [m; rad of tools that turn], and the welds that go on and off at its end.
    """
    layout, settings = model.layout, model.settings
    modes, scales = operation_modes(layout, settings.eps), scales_of(layout)
    robots = layout.factory.robots

    def places(operation: Operation) -> Iterator[tuple[str, float]]:
        axes = layout.factory.axes[operation.index]
        for axis, goal in zip(axes, modes[operation.index].goals.tolist(), strict=True):
            robot = robots[layout.factory.robot_of(axis)]
            if axis >= len(robots):
                yield names.hoist(robot.name), scales[names.lift(robot.name)].at(goal)
            elif layout.guidepaths[axis].bends:
                back, across = layout.guidepaths[axis].framed(goal, goal)[0][0].tolist()
                slides = names.slide(robot.name), names.slide_across(robot.name)
                yield names.drive(robot.name), scales[slides[0]].at(back)
                yield names.drive_across(robot.name), scales[slides[1]].at(across)
            else:
                yield names.drive(robot.name), scales[names.first_axis(robot)].at(goal)

    return {
        "operations": [
            {
                "operation": operation.template.name,
                "label": operation.label,
                "robots": [robots[robot].name for robot in operation.robots],
                "carrier": robots[operation.carrier].name,
                "dwell_s": operation.dwell,
                "goals": {name: round(at, 12) for name, at in places(operation)},
                **_welds(model, operation),
            }
            for operation in map(layout.factory.operations.__getitem__, layout.factory.order)
        ]
    }


def _welds(model: Model, operation: Operation) -> Json:
    """The names of the welds that go on and off as an operation ends."""
    robots, carried = model.factory.robots, model.carried.carried

    def grips(labels: Sequence[str]) -> set[str]:
        pairs = zip(operation.robots, labels, strict=True)
        return {names.grip(robots[r].name, x) for r, of in pairs for x in carried.get(of, ())}

    before, after = grips(operation.before), grips(operation.after)
    if not operation.inputs:
        before |= {names.feed(operation.label)}
    elif all(label == NOPART for label in operation.after):
        brought = next(label for label in operation.before if label != NOPART)
        after |= {names.hold(label) for label in carried[brought]}
    return {"on": sorted(after - before), "off": sorted(before - after)}
