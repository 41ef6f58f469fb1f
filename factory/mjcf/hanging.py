"""From which slider of a feeder each part hangs, and where its pad takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from factory.geometry.common_places import Top, common_places
from factory.geometry.meshes import Array
from factory.geometry.suction import GAP, PadPlace, pad_place
from factory.layout.dimensions import PAYLOAD
from factory.layout.feeding import feeder_of
from factory.layout.guidepath import Guidepath
from factory.layout.layout import Layout

BESIDE_HAND = 0.001
"""So far from a hand above a part its feeder's pad stays [m]."""

FAR = 100.0
"""Farther away than anything [m]."""


@dataclass(frozen=True, slots=True)
class Hanging:
    """The sliders of a layout's feeders, each named after the first of the parts that hang from it
    by turns.

    `slider`: the name of that of each part; `places`: by that name, where its pad is in the frame
    of the named part's feeder when the slider presents that part; `raised`: how much higher the
    slider is when it presents each of its parts, negative for lower [m].
    """

    slider: Mapping[str, str]
    places: Mapping[str, PadPlace]
    raised: Mapping[str, float]

    @classmethod
    def of(cls, layout: Layout) -> Hanging:
        """That of a layout. Parts of one line hang from as few sliders as can be, whose pads are
        apart; where there is no place for these, each from its own."""
        pads, slider = _FeederPads(layout), dict[str, str]()
        places: dict[str, PadPlace] = {}
        for robot in range(len(layout.factory.robots)):
            shown = layout.magazine(robot)
            common = pads.common(shown) if shown[1:] else {}
            for label in shown:
                named, place = common.get(label) or (label, pads.of(label))
                slider[label] = named
                places.setdefault(named, place)
        for named, place in places.items():
            operation = layout.factory.by_label[named]
            foot = PAYLOAD + layout.elevation(operation.carrier, operation.index)
            places[named] = PadPlace(place.at + np.array([0.0, 0.0, foot]), place.radius)
        strokes = {label: feeder_of(layout, label).stroke for label in slider}
        raised = {label: strokes[named] - strokes[label] for label, named in slider.items()}
        return cls(slider, places, raised)

    def lowest(self, slider: str) -> float:
        """The least that a slider is raised, for the lowest of its parts [m]."""
        return min(self.raised[label] for label, named in self.slider.items() if named == slider)


class _FeederPads:
    """Where the pads of a layout take their parts. Parts that are alike are looked at once."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._found: dict[object, PadPlace] = {}

    def of(self, label: str) -> PadPlace:
        """That of a part, about the product's middle and from its lowest point, in the frame of
        the robot that the part is for."""
        product, path = self._layout.product, self._path(label)
        solid = product.solids[label]
        shape = solid.mesh.name if solid.mesh else (solid.kind, solid.size)
        taken = self._taken(label)
        key = shape, solid.quaternion.tobytes(), path.heading, taken
        if key not in self._found:
            low, high = np.array(taken).reshape(2, 2) + solid.position[:2]
            place = pad_place(solid, path.heading, (low, high))
            self._found[key] = PadPlace(place.at - solid.position, place.radius)
        found = self._found[key]
        return self._seen(path, found.at + solid.position, found.radius)

    def common(self, shown: Sequence[str]) -> dict[str, tuple[str, PadPlace]]:
        """By part, after which part of a line its slider is named, and where that one's pad takes
        this one; nothing where sliders would be in each other's way."""
        product, by_label = self._layout.product, self._layout.factory.by_label
        first, path = product.solids[shown[0]], self._path(shown[0])
        meeting = [np.array(self._layout.meeting(by_label[label])) for label in shown]
        tops = [
            Top.of(product.solids[label], at - meeting[0])
            for label, at in zip(shown, meeting, strict=True)
        ]
        low, high = np.array(self._taken(shown[0])).reshape(2, 2) + first.position[:2]
        found: dict[str, tuple[str, PadPlace]] = {}
        for place in common_places(tops, (low, high)):
            named = place.parts[0]
            at = place.at + meeting[0] - meeting[named]
            above = product.solids[shown[named]].high[2] + GAP
            pad = self._seen(path, np.array([*at, above]), place.radius)
            found.update({shown[number]: (shown[named], pad) for number in place.parts})
        return found

    def _seen(self, path: Guidepath, at: Array, radius: float) -> PadPlace:
        """A place in the product's frame (3,), as it is in the frame of a robot."""
        product, (ahead, across) = self._layout.product, path.heading
        x, y, z = at - (*product.middle[:2], product.low[2])
        return PadPlace(np.array([x * ahead + y * across, y * ahead - x * across, z]), radius)

    def _taken(self, label: str) -> tuple[float, ...]:
        """The rectangle (xlo, ylo, xhi, yhi) about a part's position through which a hand from
        above comes: from its tower on the one side, against the heading."""
        operation = self._layout.factory.by_label[label]
        hand, path = self._layout.hand(operation.carrier), self._path(label)
        if hand is None or hand.kind != "above":
            return inf, inf, -inf, -inf
        half = max(hand.radius, hand.width / 2) + BESIDE_HAND
        solid = self._layout.product.solids[label]
        shift = self._layout.shift(operation.carrier, operation.index)
        at = np.array(hand.places[0][:2]) - shift - solid.position[:2]
        ends = [at - half, at + half]
        for way in (path.heading, (-path.side[0], -path.side[1])):
            ends += [at + np.array(way) * FAR]
        found = np.round([*np.minimum.reduce(ends), *np.maximum.reduce(ends)], 6)
        return tuple(found.tolist())

    def _path(self, label: str) -> Guidepath:
        return self._layout.guidepaths[self._layout.factory.by_label[label].carrier]
