"""Draw a layout: a floor plan to scale as SVG, one millimetre of floor to a unit, the y axis
upwards.

Nothing outside the file is referred to, and the same layout gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import floor

import numpy as np

from factory.geometry.solids import Solid
from factory.layout.certificate import ALWAYS, PAYLOAD_BODY
from factory.layout.dimensions import ARM_WIDTH, CARRIAGE
from factory.layout.layout import Box, Extent, Guidepath, Layout, Point2
from factory.layout.lettering import Lettering
from factory.layout.sheet import Sheet
from factory.layout.svg import circle, clean, label, line, number, polygon, rectangle
from factory.layout.sweeps import piles, regions

FONT = 17.0
"""Size of a label on the floor [mm]."""

ARROWS = 0.6
"""A guidepath has an arrow about every so many metres."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .floor { fill: #fbfbfa; stroke: #9aa5b1; stroke-width: 2; }
.grid { stroke: #eceef0; stroke-width: 1.5; fill: none; }
.coupled { fill: #fdecd2; } .uncoupled { fill: #dfeaf5; }
.belt { fill: #d5dade; stroke: #7b8794; stroke-width: 2; }
.chevron { fill: none; stroke: #9aa5b1; stroke-width: 4; stroke-linejoin: round; }
.path { fill: none; stroke: #52606d; stroke-width: 4; }
.last { fill: none; stroke: #52606d; stroke-width: 2; stroke-dasharray: 6 5; }
.arrow { fill: #323f4b; }
.part { stroke: #323f4b; stroke-width: 1.5; fill-opacity: 0.5; stroke-linejoin: round; }
.product { fill: #ffffff; fill-opacity: 0.5; stroke: #323f4b; stroke-width: 1.5; }
.post { fill: #e6b422; stroke: #8d6708; stroke-width: 1.5; } .boom { fill: #efcf73; }
.dot { fill: #2a5c9a; stroke: #1b3f6b; stroke-width: 2; }
.tool { fill: #d9731a; stroke: #94480a; stroke-width: 2; }
.arm { fill: #9aa5b1; stroke: #52606d; stroke-width: 1; }
.finger { fill: none; stroke: #52606d; stroke-width: 3; stroke-linecap: round; }
.junction { fill: #ffffff; stroke: #b42318; stroke-width: 3.5; }
.j { fill: #b42318; } .p { fill: #3e4c59; } .r { fill: #ffffff; font-weight: bold; }
.j, .p { stroke: #ffffff; stroke-width: 4; paint-order: stroke; stroke-linejoin: round; }
.h { font-weight: bold; } .measure { stroke: #52606d; stroke-width: 2; fill: none; }
.black { fill: #1f2933; stroke: #1f2933; } .white { fill: #ffffff; stroke: #1f2933; }
"""


def write_svg(layout: Layout) -> str:
    """The floor plan: guidepaths, robots at home, junctions, feeders, outfeed, payload sweeps."""
    return "".join(f"{element}\n" for element in _Drawing(layout).elements())


class _Drawing:
    """Elements of the drawing, from the ground up. Page coordinates are (x, -y) in millimetres."""

    def __init__(self, layout: Layout) -> None:
        self.layout, self.factory = layout, layout.factory
        self.sheet = Sheet(_page(layout.floor), self._name(), self._figures(), self._entries())
        self.letters = Lettering()

    def elements(self) -> Iterator[str]:
        """The document."""
        page = self.sheet.page
        box = (page[0], page[2], page[1] - page[0], page[3] - page[2])
        scale = min(max(1500 / box[2], 0.25), 1.5)
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{box[2] * scale:.0f}"'
            f' height="{box[3] * scale:.0f}" viewBox="{" ".join(map(number, box))}">'
        )
        yield f"<title>{clean(self._name())}: floor plan</title>"
        yield f"<style>{STYLE}</style>"
        yield rectangle(page, "paper")
        for name, drawn in (
            ("floor", self._floor()),
            ("sweeps", self._sweeps()),
            ("outfeed", self._outfeed()),
            ("feeders", self._feeders()),
            ("guidepaths", self._guidepaths()),
            ("robots", self._robots()),
            ("parts", self._parts()),
            ("junctions", self._junctions()),
            ("labels", self._labels()),
            ("sheet", self.sheet.lines()),
        ):
            yield f'<g id="{name}">'
            yield from drawn
            yield "</g>"
        yield "</svg>"

    # --- what is on the sheet ------------------------------------------------------------------

    def _name(self) -> str:
        name = self.factory.pag.file.replace("\\", "/").rpartition("/")[2]
        return name.removesuffix(".pag") or self.factory.pag.root

    def _figures(self) -> list[str]:
        layout = self.layout
        return [
            f"{len(layout.guidepaths)} robots, {len(self.factory.leaves)} parts, floor"
            f" {layout.area:.2f} m²",
            f"guidepaths {layout.guidepath_length:.2f} m, clearance {layout.clearance * 1e3:g} mm",
        ]

    def _entries(self) -> list[tuple[str, str]]:
        types = {robot.type for robot in self.factory.robots}
        tools = [("tool", "tool")] if "tool" in types else []
        return [
            ("dot", "robot at home"),
            *tools,
            ("path", "guidepath"),
            ("junction", "junction or station"),
            ("post", "feeder with its part"),
            ("belt", "outfeed"),
            ("uncoupled", "swept by a payload in any mode"),
            ("coupled", "in its last operation only"),
        ]

    # --- the floor -----------------------------------------------------------------------------

    def _floor(self) -> Iterator[str]:
        """The floor with a grid; labels keep inside it."""
        sheet, (left, right, top, bottom) = self.sheet, self.sheet.floor
        yield rectangle(sheet.floor, "floor")
        step = 100.0 if max(sheet.wide, sheet.tall) < 3000 else 500.0
        for x in np.arange(np.ceil(left / step) * step, right, step):
            yield line("grid", (x, top), (x, bottom))
        for y in np.arange(np.ceil(top / step) * step, bottom, step):
            yield line("grid", (left, y), (right, y))
        rim = 60.0
        for box in (
            (left - rim, left, top - rim, bottom + rim),
            (right, right + rim, top - rim, bottom + rim),
            (left, right, top - rim, top),
            (left, right, bottom, bottom + rim),
        ):
            self.letters.block(box)

    def _sweeps(self) -> Iterator[str]:
        """Coupled regions first, so that what is always kept clear lies on top."""
        swept = regions(self.layout, piles(self.factory, self.layout.product))
        payloads = [region for region in swept if region.kind == PAYLOAD_BODY]
        for style in ("coupled", "uncoupled"):
            wanted = [r for r in payloads if (r.mode == ALWAYS) == (style == "uncoupled")]
            for box in dict.fromkeys(r.box for r in wanted):
                yield rectangle(_page(box), style)

    def _outfeed(self) -> Iterator[str]:
        """The belt, with arrows the way it runs, and the product where it is let go."""
        box = _page(self.layout.outfeed)
        yield rectangle(box, "belt")
        middle, half = (box[2] + box[3]) / 2, min((box[3] - box[2]) / 4, 40.0)
        steps = max(1, floor((box[1] - box[0]) / (4 * half)))
        for n in range(steps):
            x = box[0] + (n + 0.5) * (box[1] - box[0]) / steps
            wings = (x - half / 2, middle - half), (x - half / 2, middle + half)
            yield line("chevron", wings[0], (x + half / 2, middle), wings[1])
        at = self.layout.guidepaths[0].a
        for leaf in self.factory.leaves:
            yield self._part(leaf.label, at, "product")

    def _feeders(self) -> Iterator[str]:
        for leaf in self.factory.leaves:
            feeder = self.layout.feeder(leaf.label)
            yield rectangle(_page(feeder.boom), "boom")
            yield rectangle(_page(feeder.post), "post")
            self.letters.block(_page(feeder.post))

    def _guidepaths(self) -> Iterator[str]:
        """From B to A + 2r, where the carriage stops, and from there to A."""
        for path in self.layout.guidepaths:
            stop = _point(path.carriage(path.reach))
            yield line("path", _point(path.carriage(path.length)), stop)
            yield line("last", stop, _point(path.a))
            count = max(1, round(path.travel / ARROWS))
            for n in range(count):
                yield _arrow(path, path.reach + path.travel * (n + 0.5) / count)

    # --- robots and parts ----------------------------------------------------------------------

    def _robots(self) -> Iterator[str]:
        half = CARRIAGE / 2
        for robot, path in zip(self.factory.robots, self.layout.guidepaths, strict=True):
            rim, foot = path.reach - path.arm, path.carriage(path.length)
            nest = max(path.reach + path.nest, rim)
            yield line("finger", *(_point(_ahead(path, foot, by)) for by in (rim, nest)))
            arm: Extent = (0.0, rim, -ARM_WIDTH / 2, ARM_WIDTH / 2)
            yield rectangle(_page(path.world(arm, foot)), "arm")
            box = _page(path.world((-half, half, -half, half), foot))
            yield rectangle(box, "tool" if robot.type == "tool" else "dot", 8)
            self.letters.block(box)

    def _parts(self) -> Iterator[str]:
        """Each part in its feeder."""
        for leaf in self.factory.leaves:
            path = self.layout.guidepaths[leaf.carrier]
            goal = self.layout.goal(leaf.index, leaf.template.carrier - 1)
            yield self._part(leaf.label, path.middle(goal), "part")

    def _part(self, name: str, at: Point2, style: str) -> str:
        """The outline of a part for a product whose middle is at a point."""
        solid, product = self.layout.product.solids[name], self.layout.product
        x, y = at[0] - float(product.middle[0]), at[1] - float(product.middle[1])
        red, green, blue = (round(255 * float(c)) for c in solid.rgba[:3])
        fill = f' style="fill:#{red:02x}{green:02x}{blue:02x}"' if style == "part" else ""
        if _is_round(solid):
            middle = _point((float(solid.position[0]) + x, float(solid.position[1]) + y))
            return circle(middle, 1e3 * solid.size[0], style, fill, name)
        corners = [_point((px + x, py + y)) for px, py in outline(solid)]
        return polygon(corners, style, fill, name)

    # --- labels --------------------------------------------------------------------------------

    def _stations(self) -> dict[Point2, list[str]]:
        """Where robots meet, and the operations for which they do."""
        found: dict[Point2, list[str]] = {}
        for operation in self.factory.operations:
            if len(operation.robots) > 1:
                path = self.layout.guidepaths[operation.carrier]
                x, y = path.middle(path.length - self.layout.stations[operation.index])
                found.setdefault((round(x, 6), round(y, 6)), []).append(operation.label)
        return found

    def _junctions(self) -> Iterator[str]:
        for at in self._stations():
            x, y = _point(at)
            self.letters.block((x - 8, x + 8, y - 8, y + 8))
            yield circle((x, y), 8, "junction")

    def _labels(self) -> Iterator[str]:
        """Robots on their carriages, operations at their junctions, parts at their feeders."""
        for robot, path in zip(self.factory.robots, self.layout.guidepaths, strict=True):
            size = min(FONT + 3, 1e3 * CARRIAGE / (0.7 * len(robot.name)))
            yield label(_point(path.carriage(path.length)), robot.name, size, "r")
        for at, labels in self._stations().items():
            for name in reversed(labels):
                yield self.letters.place(_point(at), name, FONT, 8, "j")
        for leaf in self.factory.leaves:
            box = _page(self.layout.feeder(leaf.label).post)
            middle = (box[0] + box[1]) / 2, (box[2] + box[3]) / 2
            yield self.letters.place(middle, leaf.label, FONT, 19, "p")


def outline(solid: Solid) -> list[Point2]:
    """The convex outline of a solid in plan, against the clock (Andrew's monotone chain)."""
    points = sorted({(round(float(p[0]), 6), round(float(p[1]), 6)) for p in solid.corners})
    return _half(points) + _half(reversed(points))


def _half(ordered: Iterable[Point2]) -> list[Point2]:
    """The lower hull of points from left to right, without the last; of points in reverse the
    upper."""
    chain: list[Point2] = []
    for p in ordered:
        while len(chain) > 1 and _turns_right(chain[-2], chain[-1], p):
            chain.pop()
        chain.append(p)
    return chain[:-1]


def _turns_right(a: Point2, b: Point2, p: Point2) -> bool:
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0


def _is_round(solid: Solid) -> bool:
    """Whether a solid is a circle in plan: a ball, or a cylinder that stands."""
    if solid.kind == "cylinder":
        _, x, y, _ = solid.quaternion
        return bool(abs(1 - 2 * (x * x + y * y)) > 1 - 1e-9)
    return solid.kind == "sphere"


def _ahead(path: Guidepath, at: Point2, by: float) -> Point2:
    return at[0] + path.heading[0] * by, at[1] + path.heading[1] * by


def _point(p: Point2) -> Point2:
    return p[0] * 1e3, -p[1] * 1e3


def _page(box: Box) -> Box:
    return box[0] * 1e3, box[1] * 1e3, -box[3] * 1e3, -box[2] * 1e3


def _arrow(path: Guidepath, x: float) -> str:
    """An arrowhead on a guidepath, towards A."""
    (px, py), (u, v) = _point(path.carriage(x)), path.heading
    tip = (px + 14 * u, py - 14 * v)
    tail = (px - 7 * u, py + 7 * v)
    sides = (tail[0] - 8 * v, tail[1] - 8 * u), (tail[0] + 8 * v, tail[1] + 8 * u)
    return polygon((tip, *sides), "arrow")


__all__ = ["outline", "write_svg"]
