"""The drawings of a report: the net, and the floor plan to scale, a millimetre of floor to a unit;
and the elements that are highlighted with each robot, label, transition and place. Robots and parts
are groups that the page moves with the time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from factory.api import Factory, Geoms, MarkedNet, Operation, names
from factory.apps.drawing.canvas import Canvas, Point, hexadecimal, hull, millimetres
from factory.apps.exports.svg import NetDrawing
from factory.apps.report.scene import DrawnFactory, owner, placed, stands_for
from factory.support.arrays import Array
from factory.support.rotations import rotation

Link = dict[str, list[int]]
"""Numbers of `robots`, `labels`, `transitions`, `places` and `operations`; `solids` are the labels
whose bodies are meant."""


def labels_of(factory: Factory) -> dict[str, int]:
    """The number of each label: parts first, each sub-assembly after its inputs."""
    return {node.label: number for number, node in enumerate(factory.pag.postorder())}


def about(labels: dict[str, int], label: str) -> str:
    """The label of the PAG that a label of the net belongs to: itself, or, for a stage such as
    `shelf/2`, or a further unit of a period, `shelf@3`, `shelf`; "" for none."""
    first = label.rpartition("@")[0]
    named = (label, label.partition("/")[0], first, first.partition("/")[0])
    return next((name for name in named if name in labels), "")


def links(factory: Factory) -> dict[str, list[Link]]:
    """The links of every robot, label, transition and place, in the order of their numbers."""
    labels = labels_of(factory)
    operations = factory.operations
    return {
        "robot": [_of_robot(factory, labels, r.index) for r in factory.robots],
        "label": [_of_label(factory, labels, label) for label in labels],
        "transition": [
            {**_of_operation(factory, labels, operation), "transitions": [transition]}
            for operation in operations
            for transition in (operation.start, operation.end)
        ],
        "place": [_of_place(factory, labels, p) for p in range(len(factory.net.threaded.places))],
    }


def _of_robot(factory: Factory, labels: dict[str, int], robot: int) -> Link:
    gear = factory.net.gears[robot]
    owned = factory.robots[robot].operations
    made = [about(labels, factory.operations[o].label) for o in owned]
    return {
        "robots": [robot],
        "labels": sorted({labels[label] for label in made if label}),
        "transitions": sorted({t for t in gear.transitions if t >= 0}),
        "places": sorted(set(gear.places)),
        "operations": sorted(set(owned)),
        "solids": [],
    }


def _of_operation(factory: Factory, labels: dict[str, int], operation: Operation) -> Link:
    made = about(labels, factory.result(operation)) or factory.pag.root
    return {
        "robots": sorted(set(operation.robots)),
        "labels": [labels[made]],
        "transitions": [operation.start, operation.end],
        "places": [operation.place],
        "operations": [operation.index],
        "solids": _solids(factory, labels, made),
    }


def _of_label(factory: Factory, labels: dict[str, int], label: str) -> Link:
    places = factory.net.threaded.places
    links = [
        _of_operation(factory, labels, operation)
        for operation in factory.operations
        if about(labels, operation.label) == label
    ]
    return {
        **{key: sorted({n for link in links for n in link[key]}) for key in links[0]},
        "places": [p for p, place in enumerate(places) if about(labels, place.label) == label],
    }


def _of_place(factory: Factory, labels: dict[str, int], place: int) -> Link:
    if place < len(factory.operations):
        link = _of_operation(factory, labels, factory.operations[place])
        return {**link, "transitions": [], "places": [place]}
    label = about(labels, factory.net.threaded.places[place].label)
    return {
        "robots": [r for r, gear in enumerate(factory.net.gears) if place in gear.places],
        "labels": [labels[label]] if label else [],
        "transitions": [],
        "places": [place],
        "operations": [],
        "solids": _solids(factory, labels, label) if label else [],
    }


def _solids(factory: Factory, labels: dict[str, int], label: str) -> list[int]:
    """The labels of the bodies in a sub-assembly: its own, and those of all its inputs."""
    solids, stack = [], [label]
    while stack:
        name = stack.pop()
        solids.append(labels[name])
        stack += factory.pag[name].inputs
    return sorted(solids)


def words_of(operation: Operation) -> str:
    """The name of an operation on the page: `mate sub1`, `dropoff`."""
    name, label = operation.template.name, operation.label
    return name if name == label else f"{name} {label}"


def data(factory: Factory) -> dict[str, Any]:
    """The names of everything by number, for the page."""
    labels, net = labels_of(factory), factory.net.threaded
    return {
        "robots": [robot.name for robot in factory.robots],
        "labels": list(labels),
        "transitions": [t.name for t in net.transitions],
        "places": [f"{p.mode} {p.label}".strip() or p.name for p in net.places],
        "operations": [
            {"name": words_of(o), "label": o.label, "robots": list(o.robots)}
            for o in factory.operations
        ],
        "left": [list(p.left) for p in net.places],
        "right": [list(p.right) for p in net.places],
        "links": links(factory),
    }


MARGIN = 80.0
"""Around everything [mm]."""

RULER_ROOM = 3.0
"""What the scale bar takes beneath everything, in sizes of its letters."""

STANDS = {"rail": "rail", "post": "post", "boom": "boom", "lid": "boom"}
"""The style of what stands still, by the last word of its name; what has none is not drawn."""

MOVES = {"arm": "arm", "finger": "arm", "carriage": "carriage"}
"""The style of what is drawn of a robot, by the last word of its name."""


def net_drawing(factory: Factory, roles: Sequence[str]) -> str:
    """The net as SVG, to be put into a page; what belongs to one robot has the style of its
    role."""
    net = MarkedNet.of(factory.net)
    drawing = NetDrawing(net, lambda of: roles[of[0]] if len(of) == 1 else "shared", True)
    size = {"data_width": round(drawing.page[1]), "data_height": round(drawing.page[3])}
    return drawing.canvas.embedded("net", drawing.page, **size, aria_label="The net")


def floor_plan(stage: DrawnFactory, labels: dict[str, int]) -> str:
    """The floor as SVG, to be put into a page."""
    return _Plan(stage, labels).text()


class _Plan:
    """Draws it on a canvas, and notes the points that it reaches to on the page [mm]."""

    def __init__(self, stage: DrawnFactory, labels: dict[str, int]) -> None:
        self.stage, self.labels, self.m = stage, labels, stage.m
        self.robots = {robot.name: robot.index for robot in stage.factory.robots}
        self.canvas, self.reach = Canvas(), list[Point]()

    def text(self) -> str:
        """The document."""
        canvas, bodies = self.canvas, self._bodies()
        with canvas.group("static"):
            self._static()
        with canvas.group("robots"):
            for body in bodies["robot"]:
                self._robot(body)
        with canvas.group("parts"):
            for body in bodies["part"]:
                self._part(body)
        with canvas.group("stations"):
            self._stations()
        with canvas.group("names"):
            for name in self.robots:
                with canvas.group(data_body=self.m.body(names.carriage(name)).id):
                    canvas.text((0, 0), name, 26.0, "name", "middle")
        points = np.array(self.reach or [(0.0, 0.0)])
        low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        size = float((high - low).max()) / 45
        high[1] += RULER_ROOM * size
        canvas.scale_bar((low[0] + size, high[1] - 2 * size), (high[0] - low[0]) / 4, size)
        page = float(low[0]), float(high[0]), float(low[1]), float(high[1])
        return canvas.embedded("floor", page, aria_label="Floor plan to scale")

    def _outline(self, points: Array) -> list[Point]:
        """The convex outline of points (n, 3) [m] in plan, on the page, to a tenth [mm]."""
        flat = np.unique(np.round(1e3 * points[:, :2], 1), axis=0)
        return [(x, -y) for x, y in hull(flat)]

    def _static(self) -> None:
        """Rails, feeders, the outfeed, and what arms stand on."""
        shapes: dict[str, list[tuple[str, list[Point]]]] = {}
        for geom, points in self._rigid(0):
            name = self.m.geom(geom).name
            style = "belt" if owner(name) == "outfeed" else STANDS.get(name.rpartition("/")[2])
            if name.endswith("/pedestal"):
                style = f"carriage {self.stage.roles[self.robots[owner(name)]]}"
            if style:
                shapes.setdefault(owner(name), []).append((style, self._outline(points)))
        for name, drawn in shapes.items():
            with self.canvas.group(**self._meant(name)):
                for style, corners in drawn:
                    self.reach += corners
                    self.canvas.polygon(corners, style)

    def _rigid(self, body: int) -> Iterator[tuple[int, Array]]:
        """The geoms of a body, and of those that are fixed to it, with their vertices in its frame
        [m]."""
        for member in np.flatnonzero(self.m.body_weldid == body).tolist():
            place, turn = self.m.body_pos[member], rotation(self.m.body_quat[member])
            for geom in Geoms(self.m).shown(member):
                points = placed(self.m, geom)[0]
                yield geom, points if member == body else points @ turn.T + place

    def _meant(self, name: str) -> dict[str, Any]:
        """The attributes of a group that stands for a robot or a part."""
        meant = stands_for(name, self.robots, self.labels)
        return {f"data_{k}": meant[k] for k in ("robot", "label") if k in meant}

    def _bodies(self) -> dict[str, list[int]]:
        """The robots and the parts, about their own origin; the page puts them where they are."""
        by_kind: dict[str, list[int]] = {"robot": [], "part": []}
        for body in range(1, self.m.nbody):
            kind = names.kind(self.m.body(body).name)
            if kind in by_kind and not int(self.m.body_parentid[body]):
                by_kind[kind].append(body)
        return by_kind

    def _robot(self, body: int) -> None:
        """Arm and carriage; the finger reaches below the payload."""
        name, turn = self.m.body(body).name, rotation(self.stage.quaternion[body])
        role, outlines = self.stage.roles[self.robots[name.partition("/")[0]]], []
        for geom, points in self._rigid(body):
            style = MOVES.get(self.m.geom(geom).name.rpartition("/")[2])
            corners = self._outline(points @ turn.T)
            for far in self.stage.reach[:, body]:
                right, up, _ = (1e3 * float(way) for way in far)
                self.reach += [(x + right, y - up) for x, y in corners]
            if style:
                outlines.append((style == "carriage", corners))
        with self.canvas.group(**self._meant(name), data_body=body):
            for carriage, corners in sorted(outlines, key=lambda shape: shape[0]):
                self.canvas.polygon(corners, f"carriage {role}" if carriage else "arm")

    def _part(self, body: int) -> None:
        """The outline of a part; a spare one, under the floor, is hidden."""
        name, (geoms, shapes) = self.m.body(body).name, zip(*self._rigid(body), strict=True)
        points = np.concatenate(shapes)
        spare = "hidden" if self.stage.position[body, 2] < 0 else None
        fill = hexadecimal(Geoms(self.m).colour(geoms[0]))
        with self.canvas.group(**self._meant(name), data_body=body, hidden=spare):
            title = names.label_of(name)
            self.canvas.polygon(self._outline(points), "part", fill=fill, title=title)

    def _stations(self) -> None:
        """A ring where the carrier of an operation of several robots holds its payload as it
        ends."""
        for at, made in self.stage.stations.items():
            of = about(self.labels, made[0])
            label, title = self.labels[of] if of else None, ", ".join(made)
            self.canvas.circle(millimetres(at), 11, "station", data_label=label, title=title)
