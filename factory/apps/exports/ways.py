"""The motions of a factory's machines, from which another program can check that they never
collide.

For each machine and each place of the coordinated net in which it is: its bodies in the MJCF that
is written, the spans of its joints there, and the welds by which it holds parts. The pairs that
come near, and their circuits, are in the clearance certificate. A slider of a magazine is a machine
of its own. Stationary machines have none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from factory.api import LayoutMachines, Model, names
from factory.apps.exports.stock import Scale, scales_of
from factory.floor.layout.presence import Presence

Json = dict[str, Any]

Span = tuple[float, float]
"""Between which coordinates an axis is [m]."""


def ways(model: Model) -> Json:
    """The places of a model's coordinated net, each from one transition to another with its
    tokens, and the ways of its machines [m]."""
    machines = LayoutMachines(model.layout)
    net, written = machines.coordinated.net, _Writer(model)
    events = net.net.transitions
    moving = [
        (one, [net.net.places[p].name for p in one.places])
        for one in machines.presences
        if one.places
    ]
    return {
        "places": [
            {"place": place.name, "before": events[a].name, "after": events[b].name, "tokens": n}
            for place, a, b, n in zip(net.net.places, net.left, net.right, net.tokens, strict=True)
        ],
        "ways": [
            *({"places": places, **written.way(one)} for one, places in moving),
            *written.standing(moving),
        ],
    }


class _Writer:
    """Writes the presences of machines with the names of a model."""

    def __init__(self, model: Model) -> None:
        self._model, self._hanging = model, LayoutMachines(model.layout).sliders
        self._scales = scales_of(model.layout)

    def way(self, one: Presence) -> Json:
        """One presence."""
        name, held = one.machine, self._model.carried.carried.get(one.label, ())
        factory = self._model.factory
        robot = factory.robots[one.robot].name
        if name == robot:
            axes = [factory.axes[axis] for axis in factory.axes_of(one.robot)]
            joints = [names.joint(axis) for axis in axes]
            if one.bodies.bent is not None:
                joints[:1] = [joint for joint, _ in names.along_bends(robot)]
            chain = map(names.moved, factory.chain(one.robot))
            bodies = [*dict.fromkeys([names.carriage(robot), *chain])]
            scales = [self._scales[joint] for joint in joints]
            return _way(one, bodies, joints, [names.grip(robot, label) for label in held], scales)
        if name == "tray":
            bodies, joints = [names.OUTFEED_TRAY], [names.OUTFEED_SLIDE]
            return _way(one, bodies, joints, [names.hold(label) for label in held], [Scale()])
        slider = self._slider(one)
        hangs = [names.feed(one.label)] * (len(one.bodies.names) > 1)
        raised = Scale(zero=-self._hanging.raised[one.label])
        return _way(one, [slider], [slider], hangs, [raised]) | {"machine": slider}

    def _slider(self, one: Presence) -> str:
        """The slider of a magazine's presence."""
        return names.slider(self._hanging.slider[one.label])

    def standing(self, moving: Sequence[tuple[Presence, list[str]]]) -> Iterator[Json]:
        """The ways of machines that come near nothing: the sliders of a magazine that stand up,
        empty, while another of it has its turn; and the shutter of the shed, which goes down and up
        while the tray is away."""
        turns, tops = dict[int, dict[str, set[str]]](), dict[str, float]()
        for one, places in moving:
            if one.machine == "tray":
                down = -self._model.layout.shutter_stroke * bool(one.label)
                yield _joint(names.SHUTTER, places, [down, 0.0])
            elif one.bears:
                slider = self._slider(one)
                turns.setdefault(one.robot, {}).setdefault(slider, set()).update(places)
                ((_, high),) = self.way(one)["spans"][0]
                tops[slider] = max(high, tops.get(slider, high))
        for magazine in turns.values():
            for slider, mine in magazine.items():
                others = set[str]().union(*magazine.values()) - mine
                yield from (_joint(slider, [p], [tops[slider]] * 2) for p in sorted(others))


def _joint(name: str, places: list[str], span: list[float]) -> Json:
    """The way of an empty machine of one body, which has the name of its joint."""
    way: Json = {"places": places, "machine": name, "bodies": [name], "joints": [name]}
    return way | {"welds": [], "spans": [[[round(end, 6) for end in span]]]}


def _way(
    one: Presence,
    bodies: Sequence[str],
    joints: Sequence[str],
    welds: Sequence[str],
    scales: Sequence[Scale],
) -> Json:
    def span(scale: Scale, ends: Span) -> list[float]:
        return sorted(round(scale.at(end), 6) for end in ends)

    def legs(first: Span, second: Span) -> Iterator[tuple[Span, ...]]:
        """The spans of the joints, leg by leg where the guidepath has bends."""
        if one.bodies.bent is None:
            yield first, second
            return
        for points in one.bodies.bent.framed(min(first), max(first)):
            (a, b), (c, d) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
            yield (a, c), (b, d), second

    return {
        "machine": one.machine,
        "bodies": bodies,
        "joints": joints,
        "welds": welds,
        "spans": [[*map(span, scales, leg)] for sweep in one.sweeps for leg in legs(*sweep)],
    }
