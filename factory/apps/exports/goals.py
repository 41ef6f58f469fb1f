"""The goals of a factory's operations in the coordinates of the MJCF that is written, for a
controller that is not ours: where which actuators have to be, and which welds are switched then."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from factory.api import NOPART, Model, Operation, Timing, names
from factory.apps.exports.stock import scales_of

Json = dict[str, Any]


def goals(model: Model) -> Json:
    """The operations of a model in an order in which one unit can be made, one after another.

    Each with its template, the label that it makes, its robots and its carrier, its dwell [s], the
    goals of actuators [m; rad of tools that turn], and the welds that go on and off at its end.
    """
    layout, settings = model.layout, model.settings
    modes, scales = Timing(layout, settings).modes, scales_of(layout)
    robots = layout.factory.robots

    def places(operation: Operation) -> Iterator[tuple[str, float]]:
        axes = layout.factory.moves[operation.index]
        for axis, goal in zip(axes, modes[operation.index].goals.tolist(), strict=True):
            if axis in layout.curves[0]:
                at = layout.guidepaths[axis].framed(goal, goal)[0][0].tolist()
                moved = names.moved_along(robots[axis])
                for (joint, actuator), place in zip(moved, at, strict=True):
                    yield actuator, scales[joint].at(place)
            else:
                of = layout.factory.axes[axis]
                yield names.actuator(of), scales[names.joint(of)].at(goal)

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
