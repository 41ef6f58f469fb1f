"""Where all machines of a layout are while places of its coordinated net are marked: robots,
magazines and the outfeed's tray; and what stands, the housings of magazines and the outfeed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from factory.floor.layout.coordinating import Coordinated
from factory.floor.layout.dimensions import (
    BELT_GAP,
    BOOM_HEIGHT,
    PAD,
    PAYLOAD,
    PAYLOADS,
    TRAY,
    WALL,
)
from factory.floor.layout.feeding import Outlet, lines_of, outlets_of
from factory.floor.layout.hanging import Hanging
from factory.floor.layout.layout import Layout
from factory.floor.layout.outfeed import dip_of, slot_of, slotted, table
from factory.floor.layout.presence import ANY, STILL, UP, MachineBodies, Presence, boxed
from factory.floor.layout.staying import Staying, in_world, station, upright
from factory.support.arrays import Array
from factory.support.boxes import Box


def presences(
    layout: Layout, coordinated: Coordinated, awaited: Mapping[int, float]
) -> Iterator[Presence]:
    """All presences, for robots that go by themselves to where they are `awaited`, by index [m]."""
    robots = Staying(layout, coordinated, awaited)
    yield from robots.presences()
    yield from magazines(layout, coordinated, robots)
    yield from _tray(layout, coordinated, robots)
    yield _outfeed(layout)


def magazines(
    layout: Layout, coordinated: Coordinated, robots: Staying, every_part: bool = False
) -> Iterator[Presence]:
    """The sliders of feeders, with the parts that hang from them, and the housings; or, instead,
    each slider with every part of its feeder, wherever it has one or comes down with one."""
    hanging, housed = Hanging.of(layout), set[int]()
    outlets = {outlet.label: outlet for outlet in outlets_of(layout)}
    carrier = [o.carrier for o in layout.factory.operations]
    of = {line[0].robot: [each.leaf.index for each in line] for line in lines_of(layout) if line}
    follows = {served.before: served for served in coordinated.served.values()}
    for number, served in coordinated.served.items():
        leaf = layout.factory.operations[number]
        outlet, robot = outlets[leaf.label], leaf.carrier
        slider = hanging.slider[leaf.label]
        pad = _pad(hanging, outlets[slider], slider, hanging.raised[leaf.label])
        part = robots.held(robot, number, leaf.label)
        visit, partners = layout.visits[number, robot], frozenset(map(station, of[robot]))
        hung = pad + part.at(visit.at, visit.lift).going(UP)
        machine = f"magazine of {layout.factory.robots[robot].name}"
        way = ((0.0, outlet.feeder.stroke), (0.0, 0.0))
        top = ((way[0][1], way[0][1]), way[1])
        shown = [(served.top, hung, top), (served.down, hung, way)]
        if every_part:
            others = (s for n, s in coordinated.served.items() if carrier[n] == robot)
            shown = [(p, hung, w) for s in others for p, w in ((s.top, top), (s.down, way))]
        else:
            shown += [(follows[number].up, pad, way), (leaf.place, hung, STILL)]
        for place, bodies, spans in shown:
            yield Presence(robot, machine, (place,), bodies, (spans,), partners, True, leaf.label)
        if robot not in housed and not every_part:
            housed.add(robot)
            yield _housing(outlet, f"feeder of {layout.factory.robots[robot].name}", partners)


def _pad(hanging: Hanging, named: Outlet, slider: str, raised: float) -> MachineBodies:
    """The pad of a slider where it presents a part."""
    path, place = named.layout.guidepaths[named.robot], hanging.places[slider]
    radius = np.array([place.radius, place.radius, 0.0])
    foot = place.at + UP * raised
    box = np.array([[foot - radius, foot + radius + UP * PAD]])
    boxes = in_world(box, path.heading, named.layout.meeting(named.leaf))
    return boxed(("pad",), boxes, UP, (upright(boxes[0]),))


def _housing(outlet: Outlet, machine: str, partners: frozenset[int]) -> Presence:
    """The post of a feeder, its boom, and the lid and walls of its housing."""
    feeder = outlet.feeder
    xlo, xhi, ylo, yhi = feeder.housing
    low, high = feeder.low, feeder.high
    boxes = [
        _upright(feeder.post, 0.0, high),
        _upright(feeder.boom, high - BOOM_HEIGHT, high),
        _upright(feeder.housing, high - WALL, high),
        _upright((xlo, xlo + WALL, ylo, yhi), low, high),
        _upright((xhi - WALL, xhi, ylo, yhi), low, high),
        _upright((xlo, xhi, ylo, ylo + WALL), low, high),
        _upright((xlo, xhi, yhi - WALL, yhi), low, high),
    ]
    names = ("post", "boom", "lid", "wall", "wall", "wall", "wall")
    return Presence(outlet.robot, machine, (), _standing(names, boxes), partners=partners)


def _outfeed(layout: Layout) -> Presence:
    """The belt and the shed."""
    xlo, xhi, ylo, yhi = layout.outfeed
    middle = np.array([(xlo + xhi) / 2, (ylo + yhi) / 2, 0.0])
    slabs = [(name, middle + at, np.array(half)) for name, at, half in table(layout)]
    names, boxes = tuple(name for name, *_ in slabs), [[a - b, a + b] for _, a, b in slabs]
    return Presence(0, "outfeed", (), _standing(names, boxes), partners=_takes(layout))


def _takes(layout: Layout) -> frozenset[int]:
    """The partners of what takes the products."""
    return frozenset(station(dropoff.index) for dropoff in layout.factory.dropoffs)


def _standing(names: tuple[str, ...], boxes: Sequence[object]) -> MachineBodies:
    """Boxes that stand: in all layers from the floor up, or among the payloads."""
    ends = np.array(boxes)
    layers = np.where(ends[:, 0, 2] > 0.0, PAYLOADS, ANY)
    return replace(boxed(names, ends, np.zeros(3)), layers=layers)


def _upright(box: Box, low: float, high: float) -> Array:
    xlo, xhi, ylo, yhi = box
    return np.array([[xlo, ylo, low], [xhi, yhi, high]])


def _tray(layout: Layout, coordinated: Coordinated, robots: Staying) -> Iterator[Presence]:
    """The tray, at home, and on its way with a product and back."""
    slot, (x, y) = slot_of(layout), layout.guidepaths[0].a
    low, high = PAYLOAD - BELT_GAP - TRAY, PAYLOAD - BELT_GAP + dip_of(layout, slot)
    plates = slotted(layout.outgoing, slot)
    boxes = np.array(
        [
            [[x + a - dx, y + b - dy, low + 1e-4], [x + a + dx, y + b + dy, high - 1e-4]]
            for (a, b), (dx, dy) in plates
        ]
    )
    along = np.array([1.0, 0.0, 0.0])
    tray, partners = boxed(("tray",) * len(boxes), boxes, along), _takes(layout)
    for number, place in coordinated.away.items():
        product = robots.held(0, number, layout.factory.operations[number].inputs[0])
        visit, way = layout.visits[number, 0], ((0.0, layout.outfeed_way), (0.0, 0.0))
        held = tray + product.at(visit.at, visit.lift).going(along)
        dropoff = layout.factory.operations[number].place
        label = layout.factory.operations[number].inputs[0]
        yield Presence(0, "tray", (dropoff,), tray, (STILL,), partners, True)
        yield Presence(0, "tray", (place,), held, (way,), partners, True, label)
