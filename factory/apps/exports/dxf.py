"""DXF R2013 of the floor plan in millimetres, a layer for each kind of object: floor, outfeed,
sweeps, feeders, guidepaths, robots, parts, junctions, labels."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from factory.api import Layout, LayoutMachines
from factory.apps.exports.floor_plan import Flat, flat_shapes, stations
from factory.apps.exports.subject import Subject
from factory.support.boxes import Box, Point2
from factory.support.version import optional

FORMAT, TAKES, RAILS = "dxf", "pag", True

VERSION, MILLIMETRES = "R2013", 4
"""Version of DXF; code of the unit in the header."""

LAYERS = {
    "FLOOR": (8, ("floor", "tile")),
    "OUTFEED": (9, ("belt",)),
    "SWEEPS": (30, ("uncoupled",)),
    "FEEDERS": (40, ("boom", "post", "housing")),
    "GUIDEPATHS": (5, ("path",)),
    "ROBOTS": (150, ("arm", "dot", "tool")),
    "PARTS": (3, ("part",)),
    "JUNCTIONS": (1, ("junction",)),
    "LABELS": (7, ()),
}
"""The layers with their colours (AutoCAD colour index) and the shapes on each."""

LAYER_OF = {style: layer for layer, (_, styles) in LAYERS.items() for style in styles}

LETTER = 17.0
"""Height of letters [mm]."""


def export(subject: Subject) -> str:
    """The floor plan. Raises MissingError where there is no ezdxf."""
    return write_dxf(subject.project.layout)


def write_dxf(layout: Layout) -> str:
    """The floor plan of a layout, the same text for the same layout."""
    ezdxf = optional("ezdxf", "ezdxf", "DXF", "export")
    with _undated(ezdxf):
        document = ezdxf.new(VERSION, units=MILLIMETRES)
        for name, (colour, _) in LAYERS.items():
            document.layers.add(name, color=colour)
        space = document.modelspace()
        for shape in flat_shapes(layout):
            if shape.style in LAYER_OF:
                _shape(space, shape)
        for words, at in _labels(layout):
            attributes = {"layer": "LABELS", "insert": _point(at)}
            space.add_text(words, height=LETTER, dxfattribs=attributes)
        _frame(document, layout.floor)
        for kind in sorted(document.entitydb.dxf_types_in_use()):
            document.classes.add_class(kind)  # which ezdxf would do in an order of its own
        text = io.StringIO()
        document.write(text)
    return text.getvalue()


@contextmanager
def _undated(ezdxf: Any) -> Iterator[None]:
    """Leave the time of day and new identifiers out of the header."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def _frame(document: Any, floor: Box) -> None:
    """Set the initial view and the extents in the header."""
    (xlo, ylo), (xhi, yhi) = _point((floor[0], floor[2])), _point((floor[1], floor[3]))
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (xlo, ylo, 0.0), (xhi, yhi, 0.0)
    middle = (xlo + xhi) / 2, (ylo + yhi) / 2
    document.set_modelspace_vport(height=1.1 * max(yhi - ylo, (xhi - xlo) / 1.6), center=middle)


def _shape(space: Any, shape: Flat) -> None:
    """A shape of the floor plan on its layer."""
    points, attributes = [_point(p) for p in shape.points], {"layer": LAYER_OF[shape.style]}
    if shape.radius:
        space.add_circle(points[0], 1e3 * shape.radius, dxfattribs=attributes)
    elif shape.box:
        (xlo, ylo), (xhi, yhi) = points
        corners = (xlo, ylo), (xhi, ylo), (xhi, yhi), (xlo, yhi)
        space.add_lwpolyline(corners, close=True, dxfattribs=attributes)
    elif len(points) == 2:
        space.add_line(*points, dxfattribs=attributes)
    else:
        space.add_lwpolyline(points, close=True, dxfattribs=attributes)


def _labels(layout: Layout) -> Iterator[tuple[str, Point2]]:
    """Labels: parts at their feeders, robots on their carriages, operations at their junctions."""
    for leaf in layout.factory.leaves:
        xlo, _, _, yhi = LayoutMachines(layout).feeder(leaf.label).post
        yield leaf.label, (xlo, yhi + 0.005)
    for robot, path in zip(layout.factory.robots, layout.guidepaths, strict=True):
        (x, y), wide = path.carriage(path.length), layout.factory.carriage
        yield robot.name, (x - wide / 2 + 0.003, y + 0.15 * wide)
    for (x, y), labels in stations(layout).items():
        yield ", ".join(labels), (x + 0.01, y + 0.01)


def _point(at: Point2) -> Point2:
    """Millimetres, to a nanometre."""
    return round(1e3 * at[0], 6), round(1e3 * at[1], 6)
