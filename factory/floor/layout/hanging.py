"""Sliders of a feeder: from which of them each part hangs, and where its pad takes the part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from factory.floor.geometry.common_places import Top, common_places
from factory.floor.geometry.solids import Product, Solid
from factory.floor.geometry.suction import (
    NARROWEST,
    SHARE,
    WIDEST,
    PadPlace,
    Terrains,
    terrains_of,
)
from factory.floor.layout.dimensions import PAD, PAYLOAD
from factory.floor.layout.feeding import Outlet, lines_of, outlets_of
from factory.floor.layout.guidepath import Guidepath
from factory.floor.layout.layout import Layout
from factory.support.arrays import Array

BESIDE_HAND = 0.001
"""So far from a hand above a part its feeder's pad stays [m]."""

FAR = 100.0
"""Farther away than anything [m]."""


@dataclass(frozen=True, slots=True)
class Hanging:
    """The sliders of a layout's feeders. Several outlets may share a slider, whose parts hang from
    it in turn; it is named after the first of them.

    Attributes:
        slider: by label, the name of its slider.
        places: by that name, where the slider's pad is in the frame of the named outlet's
            feeder when it presents that part.
        raised: by label, how much higher the slider is when it presents that part, negative for
            lower [m].
    """

    slider: Mapping[str, str]
    places: Mapping[str, PadPlace]
    raised: Mapping[str, float]

    @classmethod
    def of(cls, layout: Layout) -> Hanging:
        """The sliders of a layout, computed once. Parts of one line hang from as few sliders as
        possible, whose pads are apart; if there is no place for these, each from its own."""
        return layout.kept(cls._of)

    @classmethod
    def _of(cls, layout: Layout) -> Hanging:
        pads, slider = layout.product.kept(_FeederPads), dict[str, str]()
        places: dict[str, PadPlace] = {}
        for line in lines_of(layout):
            rises = bool(line) and line[0].feeder.rises
            common = pads.common(line) if line[1:] and not rises else {}
            for outlet in line:
                place_of = pads.under if rises else pads.of
                named, place = common.get(outlet.label) or (outlet.label, place_of(outlet))
                slider[outlet.label] = named
                places.setdefault(named, place)
        outlets = {outlet.label: outlet for outlet in outlets_of(layout)}
        for named, place in places.items():
            foot = np.array([0.0, 0.0, PAYLOAD + outlets[named].elevation])
            places[named] = PadPlace(place.at + foot, place.radius)
        strokes = {label: outlets[label].feeder.stroke for label in slider}
        raised = {label: strokes[named] - strokes[label] for label, named in slider.items()}
        return cls(slider, places, raised)

    def lowest(self, slider: str) -> float:
        """The least that a slider is raised, for the lowest of its parts [m]."""
        return min(self.raised[label] for label, named in self.slider.items() if named == slider)


class _FeederPads:
    """Places of feeders' pads on a product's parts, computed once for equal parts."""

    def __init__(self, _: Product) -> None:
        self._found: dict[object, PadPlace] = {}
        self._terrains: dict[str, Terrains] = {}

    def of(self, outlet: Outlet) -> PadPlace:
        """That of an outlet's part, about the product's middle and from its lowest point, in the
        frame of the robot that the part is for."""
        solid, heading = _solid(outlet), _path(outlet).heading
        shape = solid.mesh.name if solid.mesh else (solid.kind, solid.size)
        taken = _taken(outlet)
        key = shape, solid.quaternion.tobytes(), heading, taken
        if key not in self._found:
            low, high = np.array(taken).reshape(2, 2) + solid.position[:2]
            if outlet.label not in self._terrains:
                self._terrains[outlet.label] = terrains_of(solid)
            terrains = self._terrains[outlet.label]
            place = PadPlace.on(solid, heading, (low, high), terrains=terrains)
            self._found[key] = PadPlace(place.at - solid.position, place.radius)
        pad = self._found[key]
        return _seen(outlet, pad.at + solid.position, pad.radius)

    def under(self, outlet: Outlet) -> PadPlace:
        """That on which an outlet's part stands where it rises, below its centre of mass: the
        middle of the pad's lower face."""
        solid = _solid(outlet)
        wide = float((solid.high - solid.low)[:2].min())
        at = np.array([*solid.centre[:2], solid.low[2] - PadPlace.GAP - PAD])
        return _seen(outlet, at, max(min(WIDEST, SHARE * wide), NARROWEST))

    def common(self, line: Sequence[Outlet]) -> dict[str, tuple[str, PadPlace]]:
        """By the outlets of a line, after which of them the slider of each is named, and where that
        one's pad takes its part; nothing where sliders would be in each other's way."""
        meeting = [np.array(outlet.layout.meeting(outlet.leaf)) for outlet in line]
        tops = [
            Top.of(_solid(outlet), at - meeting[0])
            for outlet, at in zip(line, meeting, strict=True)
        ]
        low, high = np.array(_taken(line[0])).reshape(2, 2) + _solid(line[0]).position[:2]
        pads: dict[str, tuple[str, PadPlace]] = {}
        for place in common_places(tops, (low, high)):
            named = place.parts[0]
            at = place.at + meeting[0] - meeting[named]
            above = _solid(line[named]).high[2] + PadPlace.GAP
            pad = _seen(line[0], np.array([*at, above]), place.radius)
            pads.update({line[number].label: (line[named].label, pad) for number in place.parts})
        return pads


def _seen(outlet: Outlet, at: Array, radius: float) -> PadPlace:
    """A place in the product's frame (3,), as it is in the frame of an outlet's robot."""
    product, (ahead, across) = outlet.layout.product, _path(outlet).heading
    x, y, z = at - (*product.middle[:2], product.low[2])
    return PadPlace(np.array([x * ahead + y * across, y * ahead - x * across, z]), radius)


def _taken(outlet: Outlet) -> tuple[float, ...]:
    """The rectangle (xlo, ylo, xhi, yhi) about an outlet's part through which a hand from above
    comes: from its tower, against the heading."""
    hand, path = outlet.layout.hand(outlet.robot), _path(outlet)
    if hand is None or not hand.kind.hangs:
        return inf, inf, -inf, -inf
    half = np.full(2, max(hand.radius, hand.width / 2) + BESIDE_HAND)
    if hand.clamp is not None:
        sides = hand.clamp.length * np.abs(path.heading) + hand.half * np.abs(path.side)
        half = np.maximum(half, sides + BESIDE_HAND)
    shift = outlet.layout.visits[outlet.leaf.index, outlet.robot].shift
    at = np.array(hand.places[0][:2]) - shift - _solid(outlet).position[:2]
    ends = [at - half, at + half]
    for way in (path.heading, (-path.side[0], -path.side[1])):
        ends += [at + np.array(way) * FAR]
    rectangle = np.round([*np.minimum.reduce(ends), *np.maximum.reduce(ends)], 6)
    return tuple(rectangle.tolist())


def _path(outlet: Outlet) -> Guidepath:
    return outlet.layout.guidepaths[outlet.robot]


def _solid(outlet: Outlet) -> Solid:
    return outlet.layout.product.solids[outlet.label].presented()
