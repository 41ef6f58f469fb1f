"""A picture of a revision: the floor of the new factory, its guidepaths coloured by what stays."""

from __future__ import annotations

from collections.abc import Iterator

from factory.api import Guidepath, Layout, Point2
from factory.apps.drawing.canvas import Canvas, millimetres, page_box
from factory.apps.revise.pins import StayingRobot
from factory.theory.problem.robot_bodies import CARRIAGE

STYLE = """
.floor { fill: #fbfbfa; stroke: #9aa5b1; stroke-width: 2; } .outfeed { fill: #e9edf1; }
.stays, .changed, .moved, .new, .gone, .was { fill: none; stroke-width: 10; stroke-linecap: round; }
.stays { stroke: #2f855a; } .changed { stroke: #2a5c9a; } .moved { stroke: #d9731a; }
.new { stroke: #b42318; } .gone { stroke: #9aa5b1; } .was { stroke: #1f2933; stroke-width: 3; }
.gone, .was { stroke-dasharray: 14 18; } .r { font-weight: bold; } .gone-name { fill: #9aa5b1; }
"""

LEGEND = (
    ("stays", "stays as it is"),
    ("changed", "in place; program, contents, hand or arm change"),
    ("moved", "stays, in another place or of another length"),
    ("was", "where that was"),
    ("new", "new"),
    ("gone", "gone"),
)


def draw_revision(
    title: str, layouts: tuple[Layout, Layout], kept: tuple[StayingRobot, ...], shift: Point2
) -> str:
    """The document; `layouts`: the old and the new, of which robots are `kept`; `shift`: by how
    much the new lies elsewhere [m]."""
    canvas, (old, new) = Canvas(), layouts
    floor = left, right, top, bottom = page_box(new.floor)
    canvas.rectangle(floor, "floor")
    out = page_box(new.outfeed)
    canvas.rectangle(out, "outfeed")
    stay = {k.new: "stays" if k.whole else "changed" if k.place else "moved" for k in kept}
    unit = max(14.0, (right - left) / 60)
    size = min(600.0 * CARRIAGE, unit)
    canvas.label(((out[0] + out[1]) / 2, (out[2] + out[3]) / 2), "outfeed", size, "grey")
    for robot in sorted({*range(len(old.guidepaths))} - {k.old for k in kept}):
        canvas.line("gone", *_ends(old.guidepaths[robot], shift))
        name = old.factory.robots[robot].name
        canvas.label(_beyond(old.guidepaths[robot], shift), name, size, "r gone-name")
    for robot, path in enumerate(new.guidepaths):
        canvas.line(stay.get(robot, "new"), *_ends(path))
    for k in kept:
        if not k.place:
            canvas.line("was", *_ends(old.guidepaths[k.old], shift))
    for robot, path in zip(new.factory.robots, new.guidepaths, strict=True):
        canvas.label(_beyond(path), robot.name, size, "r")
    canvas.text((left, top - unit), title, 1.5 * unit, "h")
    y = bottom + unit
    drawn = "".join(canvas.elements)
    for style, words in (entry for entry in LEGEND if f'class="{entry[0]}"' in drawn):
        y += 1.4 * unit
        canvas.line(style, (left, y), (left + 2 * unit, y))
        canvas.text((left + 2.6 * unit, y), words, unit)
    page = left - 2 * size, max(right, left + 36 * unit) + 2 * size, top - 4 * unit, y + unit
    return canvas.document(f"{title}: what stays", page, STYLE)


def _ends(path: Guidepath, shift: Point2 = (0.0, 0.0)) -> Iterator[tuple[float, float]]:
    for at in (path.reach, path.length):
        x, y = path.carriage(at)
        yield millimetres((x + shift[0], y + shift[1]))


def _beyond(path: Guidepath, shift: Point2 = (0.0, 0.0)) -> tuple[float, float]:
    """Where the name of a robot stands: behind the end of its guidepath."""
    x, y = path.carriage(path.length + 0.7 * CARRIAGE)
    return millimetres((x + shift[0], y + shift[1]))
