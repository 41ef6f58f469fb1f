"""Feeders: a post, a boom, and a housing from which a slider brings parts down by a suction pad.

The housing is a box open below. Parts come into it unseen, and only there.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from xml.etree.ElementTree import Element

import numpy as np

from factory.geometry.suction import PadPlace, pad_place
from factory.layout.dimensions import BOOM, BOOM_HEIGHT, PAD, PAYLOAD, POST, WALL
from factory.layout.feeding import feeder_of
from factory.layout.guidepath import Feeder, Guidepath
from factory.layout.layout import Layout
from factory.mjcf import names
from factory.mjcf.elements import add, add_shown, add_station
from factory.mjcf.masks import feeder_codes, masks_of
from factory.mjcf.robots import MOTOR, Drive, add_inertia, heading_quaternion
from factory.mjcf.stops import lift_stops

BESIDE_HAND = 0.001
"""So far from a hand above a part its feeder's pad stays [m]."""

FAR = 100.0
"""Farther away than anything [m]."""

SLIDER_MASS = 0.4
"""Mass of a slider with its rod and pad [kg]."""

ROD = 0.003
"""Radius of a slider's rod where the pad is not smaller [m]."""

OVER = 0.01
"""How far a rod stands out of its housing at least [m]."""

RUBBER = (0.20, 0.22, 0.25, 1.0)

Point3 = tuple[float, float, float]


class FeederPads:
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
        found, (ahead, across) = self._found[key], path.heading
        x, y, z = found.at + solid.position - (*product.middle[:2], product.low[2])
        return PadPlace(np.array([x * ahead + y * across, y * ahead - x * across, z]), found.radius)

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


def add_feeders(
    world: Element, actuator: Element, layout: Layout, drives: Mapping[str, Drive]
) -> None:
    """The feeders of a layout, each slider with the drive of its label. Sliders of one line share
    the housing of its first part."""
    pads, codes = FeederPads(layout), feeder_codes(layout.factory)
    for operation in layout.factory.leaves:
        label, found = operation.label, feeder_of(layout, operation.label)
        path = layout.guidepaths[operation.carrier]
        x, y = layout.meeting(operation)
        body = add(
            world,
            "body",
            name=names.feeder(label),
            pos=(x, y, 0.0),
            quat=heading_quaternion(path),
        )
        if label == layout.magazine(operation.carrier)[0]:
            _add_housing(body, names.feeder(label), found, path.left)
        place = pads.of(label)
        foot = PAYLOAD + layout.elevation(operation.carrier, operation.index)
        at = PadPlace(place.at + np.array([0.0, 0.0, foot]), place.radius)
        _add_slider(body, label, found, at, codes[label], drives[label], layout.clearance)
        gains = drives[label].attributes()
        name = names.slider(label)
        add(actuator, "pid", name=name, joint=name, input="pos vel ff", **gains)


def _add_housing(body: Element, name: str, found: Feeder, left: float) -> None:
    """What stands still, in a frame whose x is the heading."""
    rear, front, near, far = found.inside
    ahead, across = (rear + front) / 2, (near + far) / 2 * left
    length, width = front - rear, far - near
    low, top = found.low, found.high
    middle, half = (low + top - WALL) / 2, (top - WALL - low) / 2
    across_post = found.across * left
    boom = rear - WALL - found.back
    shapes: list[tuple[str, Point3, Point3, str]] = [
        ("post", (found.back, across_post, top / 2), (POST / 2, POST / 2, top / 2), "post"),
        (
            "boom",
            (found.back + boom / 2, across_post, top - BOOM_HEIGHT / 2),
            (boom / 2, BOOM / 2, BOOM_HEIGHT / 2),
            "post",
        ),
        (
            "lid",
            (ahead, across, top - WALL / 2),
            (length / 2 + WALL, width / 2 + WALL, WALL / 2),
            "housing",
        ),
    ]
    for side in (-1, 1):
        along = ahead + side * (length + WALL) / 2, across, middle
        beside = ahead, across + side * (width + WALL) / 2, middle
        shapes.append((f"end{side}", along, (WALL / 2, width / 2 + WALL, half), "housing"))
        shapes.append((f"wall{side}", beside, (length / 2, WALL / 2, half), "housing"))
    for kind, at, size, material in shapes:
        add_station(body, f"{name}/{kind}", pos=at, size=size, material=material)


def _add_slider(
    feeder: Element,
    label: str,
    found: Feeder,
    at: PadPlace,
    code: int,
    drive: Drive,
    clearance: float,
) -> None:
    """The slider, down where it presents a part; its joint goes up from there. The pad touches the
    part by design, and the rod its bearing in the lid: the one is masked as what the feeder holds,
    the other is only shown."""
    name = names.slider(label)
    body = add(feeder, "body", name=name, pos="0 0 0", sleep="allowed")
    slide = {"type": "slide", "axis": "0 0 1", "armature": MOTOR, "frictionloss": 0.2}
    joint = add(body, "joint", name=name, **slide)
    lift_stops(found.stroke, clearance).limit(joint)
    add_inertia(joint, drive)
    x, y, z = (float(v) for v in at.at)
    contype, conaffinity = masks_of(code)
    add(
        body,
        "geom",
        name=names.pad(label),
        type="cylinder",
        pos=(x, y, z + PAD / 2),
        size=(at.radius, PAD / 2),
        mass=SLIDER_MASS,
        contype=contype,
        conaffinity=conaffinity,
        rgba=RUBBER,
    )
    end = found.high + OVER
    rod = f"{names.feeder(label)}/rod"
    add_shown(
        add(body, "body", name=rod),
        rod,
        "cylinder",
        pos=(x, y, (z + PAD + end) / 2),
        size=(min(ROD, 0.6 * at.radius), (end - z - PAD) / 2),
        material="rail",
    )
