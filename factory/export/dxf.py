"""DXF R2013 of the floor plan in millimetres, a layer for each kind of thing: floor, outfeed,
sweeps, feeders, guidepaths, robots, parts, junctions, labels."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from factory.export.subject import Subject
from factory.geometry.solids import Solid
from factory.layout.certificate import ALWAYS, PAYLOAD_BODY
from factory.layout.dimensions import ARM_WIDTH, CARRIAGE
from factory.layout.drawing import outline
from factory.layout.layout import Box, Extent, Layout, Point2
from factory.layout.sweeps import piles, regions
from factory.plant.factory import Factory
from factory.support.extras import optional

FORMAT, TAKES = "dxf", "pag"

VERSION, MILLIMETRES = "R2013", 4
"""Of DXF; the code of the unit in its header."""

LAYERS = {
    "FLOOR": 8,
    "OUTFEED": 9,
    "SWEEPS": 30,
    "FEEDERS": 40,
    "GUIDEPATHS": 5,
    "ROBOTS": 150,
    "PARTS": 3,
    "JUNCTIONS": 1,
    "LABELS": 7,
}
"""The layers with their colours (AutoCAD colour index)."""

LETTER, JUNCTION = 17.0, 8.0
"""Height of letters, radius of the circle at a junction [mm]."""


def export(subject: Subject) -> str:
    """The floor plan. Raises MissingError where there is no ezdxf."""
    return write_dxf(subject.layout)


def write_dxf(layout: Layout) -> str:
    """The floor plan of a layout, the same text for the same layout."""
    ezdxf = optional("ezdxf", "ezdxf", "DXF", "export")
    with _undated(ezdxf):
        document = ezdxf.new(VERSION, units=MILLIMETRES)
        for name, colour in LAYERS.items():
            document.layers.add(name, color=colour)
        _Plan(layout, document.modelspace()).draw()
        _frame(document, layout.floor)
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # which ezdxf would do in an order of its own
        text = io.StringIO()
        document.write(text)
    return text.getvalue()


@contextmanager
def _undated(ezdxf: Any) -> Iterator[None]:
    """Without the time of day and new identifiers in the header."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _frame(document: Any, floor: Box) -> None:
    """What a viewer shows first, and the extents in the header."""
    (xlo, ylo), (xhi, yhi) = _point((floor[0], floor[2])), _point((floor[1], floor[3]))
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (xlo, ylo, 0.0), (xhi, yhi, 0.0)
    middle = (xlo + xhi) / 2, (ylo + yhi) / 2
    document.set_modelspace_vport(height=1.1 * max(yhi - ylo, (xhi - xlo) / 1.6), center=middle)


class _Plan:
    """What stands on the floor, drawn in millimetres, x and y as in the layout."""

    def __init__(self, layout: Layout, space: Any) -> None:
        self.layout, self.space = layout, space
        self.factory: Factory = layout.factory

    def draw(self) -> None:
        """Everything."""
        self._box(self.layout.floor, "FLOOR")
        self._box(self.layout.outfeed, "OUTFEED")
        self._sweeps()
        for leaf in self.factory.leaves:
            self._feeder(leaf.label, leaf.carrier, leaf.index, leaf.template.carrier - 1)
        for robot in self.factory.robots:
            self._robot(robot.index, robot.name)
        self._junctions()

    def _sweeps(self) -> None:
        """Where a payload may be in any mode."""
        swept = regions(self.layout, piles(self.factory, self.layout.product))
        found = (r.box for r in swept if r.kind == PAYLOAD_BODY and r.mode == ALWAYS)
        for box in dict.fromkeys(found):
            self._box(box, "SWEEPS")

    def _feeder(self, label: str, robot: int, operation: int, slot: int) -> None:
        feeder, path = self.layout.feeder(label), self.layout.guidepaths[robot]
        self._box(feeder.post, "FEEDERS")
        self._box(feeder.boom, "FEEDERS")
        self._solid(
            self.layout.product.solids[label], path.middle(self.layout.goal(operation, slot))
        )
        xlo, _, _, yhi = feeder.post
        self._text(label, (xlo, yhi + 0.005))

    def _solid(self, solid: Solid, at: Point2) -> None:
        """The outline of a part for a product whose middle is at a point."""
        x, y = (at[k] - float(self.layout.product.middle[k]) for k in (0, 1))
        if solid.kind == "sphere":
            middle = float(solid.position[0]) + x, float(solid.position[1]) + y
            self._circle(middle, 1e3 * solid.size[0], "PARTS")
        else:
            self._loop([(px + x, py + y) for px, py in outline(solid)], "PARTS")

    def _robot(self, index: int, name: str) -> None:
        path, half = self.layout.guidepaths[index], CARRIAGE / 2
        foot = path.carriage(path.length)
        ends = _point(foot), _point(path.carriage(path.reach))
        self.space.add_line(*ends, dxfattribs={"layer": "GUIDEPATHS"})
        self._box(path.world((-half, half, -half, half), foot), "ROBOTS")
        arm: Extent = (0.0, path.reach - path.arm, -ARM_WIDTH / 2, ARM_WIDTH / 2)
        self._box(path.world(arm, foot), "ROBOTS")
        self._text(name, (foot[0] - half + 0.003, foot[1] + 0.3 * half))

    def _junctions(self) -> None:
        """Where robots meet, and for which operations."""
        found: dict[Point2, list[str]] = {}
        for operation in self.factory.operations:
            if len(operation.robots) > 1:
                path = self.layout.guidepaths[operation.carrier]
                at = path.middle(path.length - self.layout.stations[operation.index])
                found.setdefault((round(at[0], 6), round(at[1], 6)), []).append(operation.label)
        for at, labels in found.items():
            self._circle(at, JUNCTION, "JUNCTIONS")
            self._text(", ".join(reversed(labels)), (at[0] + 0.01, at[1] + 0.01))

    def _box(self, box: Box, layer: str) -> None:
        xlo, xhi, ylo, yhi = box
        self._loop([(xlo, ylo), (xhi, ylo), (xhi, yhi), (xlo, yhi)], layer)

    def _loop(self, corners: Sequence[Point2], layer: str) -> None:
        points = [_point(corner) for corner in corners]
        self.space.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})

    def _circle(self, middle: Point2, radius: float, layer: str) -> None:
        self.space.add_circle(_point(middle), radius, dxfattribs={"layer": layer})

    def _text(self, words: str, at: Point2) -> None:
        attributes = {"layer": "LABELS", "insert": _point(at)}
        self.space.add_text(words, height=LETTER, dxfattribs=attributes)


def _point(at: Point2) -> Point2:
    """Millimetres, to a nanometre."""
    return round(1e3 * at[0], 6), round(1e3 * at[1], 6)
