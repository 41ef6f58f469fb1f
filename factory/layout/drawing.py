"""Draw a layout: a floor plan to scale as SVG, one millimetre of floor to a unit, the y axis upwards.

Nothing outside the file is referred to, and the same layout gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import floor, log10

import numpy as np

from factory.geometry import Solid
from factory.layout.crossings import delivered_to
from factory.layout.dimensions import ARM_WIDTH, BOOM, CARRIAGE
from factory.layout.lettering import Lettering, clean, number, text
from factory.layout.plan import Box, Extent, Guidepath, Layout, Point2
from factory.layout.sweeps import ALWAYS, PAYLOAD_BODY, Region, goals, piles, regions

FONT = 17.0
"""Size of a label on the floor [mm]."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .floor { fill: #fbfbfa; stroke: #9aa5b1; stroke-width: 2; }
.grid { stroke: #eceef0; stroke-width: 1.5; fill: none; }
.coupled { fill: #fdecd2; } .uncoupled { fill: #dfeaf5; }
.belt { fill: #d5dade; stroke: #7b8794; stroke-width: 2; }
.chevron { fill: none; stroke: #7b8794; stroke-width: 4; stroke-linejoin: round; }
.path { fill: none; stroke: #52606d; stroke-width: 4; }
.last { fill: none; stroke: #52606d; stroke-width: 2; stroke-dasharray: 6 5; }
.arrow { fill: #52606d; }
.part { stroke: #323f4b; stroke-width: 1.5; fill-opacity: 0.55; stroke-linejoin: round; }
.product { fill: #ffffff; fill-opacity: 0.5; stroke: #323f4b; stroke-width: 2; }
.post { fill: #e6b422; stroke: #8d6708; stroke-width: 1.5; }
.boom { fill: #e6b422; fill-opacity: 0.75; }
.dot { fill: #2a5c9a; stroke: #1b3f6b; stroke-width: 2; }
.tool { fill: #d9731a; stroke: #94480a; stroke-width: 2; }
.arm { fill: #9aa5b1; stroke: #52606d; stroke-width: 1; }
.finger { stroke: #52606d; stroke-width: 3; stroke-linecap: round; }
.junction { fill: #ffffff; stroke: #b42318; stroke-width: 3.5; }
.j { fill: #b42318; } .p { fill: #3e4c59; } .r { fill: #ffffff; font-weight: bold; }
.j, .p { stroke: #ffffff; stroke-width: 4; paint-order: stroke; stroke-linejoin: round; }
.h { font-weight: bold; } .measure { stroke: #52606d; stroke-width: 2; fill: none; }
.bar { fill: #1f2933; } .bar2 { fill: #ffffff; stroke: #1f2933; stroke-width: 1; }
"""


def write_svg(layout: Layout) -> str:
    """The floor plan: guidepaths, robots at home, junctions, feeders, outfeed, what payloads sweep."""
    return "".join(f"{line}\n" for line in _Drawing(layout).lines())


class _Drawing:
    """Page coordinates are (x, -y) in millimetres; `unit` is a size fit for the page's own text."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.low = (layout.floor[0] * 1e3, -layout.floor[3] * 1e3)
        self.high = (layout.floor[1] * 1e3, -layout.floor[2] * 1e3)
        self.wide, self.tall = self.high[0] - self.low[0], self.high[1] - self.low[1]
        self.unit = max(16.0, self.wide / 42, self.tall / 55)
        self.swept = regions(layout, piles(layout.factory, layout.product))
        self.letters = Lettering()

    def lines(self) -> Iterator[str]:
        """The document."""
        unit = self.unit
        wide = max(self.wide, 36 * unit)
        box = (self.low[0] - 3.2 * unit, self.low[1] - 5.2 * unit, wide + 5 * unit, self.tall + 13 * unit)
        scale = min(max(1500 / box[2], 0.25), 1.5)
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{box[2] * scale:.0f}"'
            f' height="{box[3] * scale:.0f}" viewBox="{" ".join(map(number, box))}">'
        )
        yield f"<title>{clean(self._name())}: floor plan</title>"
        yield f"<style>{STYLE}</style>"
        yield _rectangle((box[0], box[0] + box[2], box[1], box[1] + box[3]), "paper")
        yield from self._ground()
        for name, lines in (
            ("sweeps", self._sweeps()),
            ("outfeed", self._outfeed()),
            ("guidepaths", self._guidepaths()),
            ("feeders", self._feeders()),
            ("robots", self._robots()),
            ("junctions", self._junctions()),
            ("labels", self._labels()),
            ("sheet", self._sheet()),
        ):
            yield f'<g id="{name}">'
            yield from lines
            yield "</g>"
        yield "</svg>"

    # --- the floor -----------------------------------------------------------------------------

    def _ground(self) -> Iterator[str]:
        yield _rectangle((self.low[0], self.high[0], self.low[1], self.high[1]), "floor")
        step = 100.0 if max(self.wide, self.tall) < 3000 else 500.0
        lines = [
            f"M{number(x)} {number(self.low[1])}V{number(self.high[1])}"
            for x in np.arange(np.ceil(self.low[0] / step) * step, self.high[0], step)
        ]
        lines += [
            f"M{number(self.low[0])} {number(y)}H{number(self.high[0])}"
            for y in np.arange(np.ceil(self.low[1] / step) * step, self.high[1], step)
        ]
        yield f'<path class="grid" d="{"".join(lines)}"/>'

    def _sweeps(self) -> Iterator[str]:
        """Coupled regions first, so that what is always kept clear lies on top."""
        payloads = [region for region in self.swept if region.kind == PAYLOAD_BODY]
        for style in ("coupled", "uncoupled"):
            wanted = [r for r in payloads if (r.mode == ALWAYS) == (style == "uncoupled")]
            for box in dict.fromkeys(r.box for r in wanted):
                yield _rectangle(_page(box), style)

    def _outfeed(self) -> Iterator[str]:
        box = _page(self.layout.outfeed)
        yield _rectangle(box, "belt")
        middle, half = (box[2] + box[3]) / 2, min((box[3] - box[2]) / 4, 40.0)
        steps = max(1, floor((box[1] - box[0]) / (4 * half)))
        for n in range(steps):
            x = box[0] + (n + 0.5) * (box[1] - box[0]) / steps
            yield (
                f'<path class="chevron" d="M{number(x - half / 2)} {number(middle - half)}'
                f'L{number(x + half / 2)} {number(middle)}L{number(x - half / 2)} {number(middle + half)}"/>'
            )
        path = self.layout.guidepaths[0]
        for label in self.layout.factory.contents[self.layout.factory.pag.root]:
            yield self._part(label, path.a, "product")

    def _guidepaths(self) -> Iterator[str]:
        for path in self.layout.guidepaths:
            b, stop = _point(path.carriage(path.length)), _point(path.carriage(path.reach))
            yield _line(b, stop, "path")
            yield _line(stop, _point(path.a), "last")
            count = max(1, round(path.travel / 0.6))
            for n in range(count):
                yield _arrow(path, path.reach + path.travel * (n + 0.5) / count)

    # --- what stands on it ---------------------------------------------------------------------

    def _feeders(self) -> Iterator[str]:
        for leaf in self.layout.factory.leaves:
            feeder = self.layout.feeder(leaf.label)
            yield self._part(leaf.label, self._feeding(leaf.carrier, leaf.index), "part")
            yield _rectangle(_page(feeder.boom), "boom")
            yield _rectangle(_page(feeder.post), "post")
            self.letters.block(_page(feeder.post))

    def _feeding(self, robot: int, operation: int) -> Point2:
        """Where the product's middle is when a robot takes its part."""
        factory, path = self.layout.factory, self.layout.guidepaths[robot]
        carrier = factory.operations[operation].template.carrier - 1
        return path.middle(self.layout.goal(operation, carrier))

    def _part(self, label: str, at: Point2, style: str) -> str:
        """The outline of a part about the product's middle."""
        solid, product = self.layout.product.solids[label], self.layout.product
        x, y = at[0] - float(product.middle[0]), at[1] - float(product.middle[1])
        red, green, blue = (round(255 * float(c)) for c in solid.rgba[:3])
        fill = f' style="fill:#{red:02x}{green:02x}{blue:02x}"' if style == "part" else ""
        title = f"<title>{clean(label)}</title>"
        if _is_round(solid):
            middle = _point((float(solid.position[0]) + x, float(solid.position[1]) + y))
            radius = number(solid.size[0] * 1e3)
            place = f'cx="{number(middle[0])}" cy="{number(middle[1])}" r="{radius}"'
            return f'<circle class="{style}" {place}{fill}>{title}</circle>'
        corners = " ".join(
            f"{number((px + x) * 1e3)},{number(-(py + y) * 1e3)}" for px, py in outline(solid)
        )
        return f'<polygon class="{style}" points="{corners}"{fill}>{title}</polygon>'

    def _robots(self) -> Iterator[str]:
        half = CARRIAGE / 2
        for robot, path in zip(self.layout.factory.robots, self.layout.guidepaths, strict=True):
            rim, nest = path.reach - path.arm, path.reach + path.nest
            foot = path.carriage(path.length)
            style = "tool" if robot.type == "tool" else "dot"
            yield _line(
                _point(_ahead(path, foot, rim)), _point(_ahead(path, foot, max(nest, rim))), "finger"
            )
            arm: Extent = (0.0, rim, -ARM_WIDTH / 2, ARM_WIDTH / 2)
            yield _rectangle(_page(path.world(arm, foot)), "arm")
            box = _page(path.world((-half, half, -half, half), foot))
            yield _rectangle(box, style, 8)
            self.letters.block(box)
            size = min(FONT + 3, 1e3 * CARRIAGE / (0.66 * len(robot.name)))
            yield text(_point(foot), robot.name, size, "r")

    def _stations(self) -> dict[Point2, list[str]]:
        """Where robots meet, and the operations for which they do."""
        found: dict[Point2, list[str]] = {}
        for operation in self.layout.factory.operations:
            if len(operation.robots) > 1:
                path = self.layout.guidepaths[operation.carrier]
                stand = path.length - self.layout.stations[operation.index]
                x, y = path.middle(stand)
                found.setdefault((round(x, 6), round(y, 6)), []).append(operation.label)
        return found

    def _junctions(self) -> Iterator[str]:
        for at in self._stations():
            x, y = _point(at)
            self.letters.block((x - 8, x + 8, y - 8, y + 8))
            yield f'<circle class="junction" cx="{number(x)}" cy="{number(y)}" r="8"/>'

    def _labels(self) -> Iterator[str]:
        """Operations at their junctions, then parts at their feeders."""
        for at, labels in self._stations().items():
            for label in reversed(labels):
                yield self.letters.place(_point(at), label, FONT, 8, "j")
        for leaf in self.layout.factory.leaves:
            box = _page(self.layout.feeder(leaf.label).post)
            middle = (box[0] + box[1]) / 2, (box[2] + box[3]) / 2
            yield self.letters.place(middle, leaf.label, FONT, 19, "p")

    # --- the sheet -----------------------------------------------------------------------------

    def _name(self) -> str:
        name = self.layout.factory.pag.file.replace("\\", "/").rpartition("/")[2]
        return name.removesuffix(".pag") or self.layout.factory.pag.root

    def _sheet(self) -> Iterator[str]:
        """Title, dimensions, scale bar, legend."""
        layout, unit = self.layout, self.unit
        left, top = self.low
        yield text((left, top - 3.6 * unit), self._name(), 1.5 * unit, "h", "start")
        figures = (
            f"{len(layout.guidepaths)} robots, {len(layout.factory.leaves)} parts;"
            f" floor {self.wide / 1e3:.2f} × {self.tall / 1e3:.2f} m ({layout.area:.2f} m²);"
            f" guidepaths {layout.guidepath_length:.2f} m; clearance {layout.clearance * 1e3:g} mm"
        )
        yield f'<text x="{number(left)}" y="{number(top - 1.5 * unit)}" font-size="{number(0.8 * unit)}">{clean(figures)}</text>'
        yield from self._dimensions()
        yield from self._scale_bar()
        yield from self._legend()

    def _dimensions(self) -> Iterator[str]:
        """The floor's width below it and its depth to its left."""
        unit, tick = self.unit, 0.25 * self.unit
        (left, top), (right, bottom) = self.low, self.high
        y, x = bottom + 0.9 * unit, left - 0.9 * unit
        yield (
            f'<path class="measure" d="M{number(left)} {number(y)}H{number(right)}'
            f"M{number(left)} {number(y - tick)}v{number(2 * tick)}"
            f"M{number(right)} {number(y - tick)}v{number(2 * tick)}"
            f"M{number(x)} {number(top)}V{number(bottom)}"
            f"M{number(x - tick)} {number(top)}h{number(2 * tick)}"
            f'M{number(x - tick)} {number(bottom)}h{number(2 * tick)}"/>'
        )
        middle = (left + right) / 2, (top + bottom) / 2
        yield text((middle[0], y + 0.7 * unit), f"{self.wide / 1e3:.3f} m", 0.7 * unit)
        at = f"rotate(-90 {number(x - 0.7 * unit)} {number(middle[1])})"
        yield f'<g transform="{at}">{text((x - 0.7 * unit, middle[1]), f"{self.tall / 1e3:.3f} m", 0.7 * unit)}</g>'

    def _scale_bar(self) -> Iterator[str]:
        """Five steps of a round length."""
        unit, (x, y) = self.unit, (self.low[0], self.high[1] + 3.2 * self.unit)
        step = _round_length(self.wide / 15)
        for n in range(5):
            box = (x + n * step, x + (n + 1) * step, y, y + 0.4 * unit)
            yield _rectangle(box, "bar2" if n % 2 else "bar")
        for n in (0, 5):
            shown = f"{n * step / 1e3:g} m" if n else "0"
            yield text((x + n * step, y + 0.95 * unit), shown, 0.7 * unit)

    def _legend(self) -> Iterator[str]:
        """One row or two of samples and what they stand for."""
        unit, size = self.unit, 0.7 * self.unit
        entries = (
            ("dot", "robot at home"),
            ("tool", "tool"),
            ("path", "guidepath, towards A"),
            ("junction", "junction or station"),
            ("post", "feeder and part"),
            ("belt", "outfeed"),
            ("uncoupled", "swept by a payload in any mode"),
            ("coupled", "in its last operation only"),
        )
        x, y, column = self.low[0], self.high[1] + 5.6 * unit, 9.3 * unit
        for n, (style, words) in enumerate(entries):
            at = x + (n % 4) * column, y + (n // 4) * 1.2 * unit
            yield self._sample(style, at)
            yield text((at[0] + 1.5 * unit, at[1]), words, size, "", "start") if len(words) < 20 else _plain(
                (at[0] + 1.5 * unit, at[1]), words, size
            )

    def _sample(self, style: str, at: Point2) -> str:
        half, (x, y) = 0.4 * self.unit, at
        if style == "path":
            return _line((x, y), (x + 3 * half, y), style)
        if style == "junction":
            return f'<circle class="{style}" cx="{number(x + half)}" cy="{number(y)}" r="{number(half)}"/>'
        return _rectangle((x, x + 2 * half, y - half, y + half), style)


def outline(solid: Solid) -> list[Point2]:
    """The convex outline of a solid in plan, against the clock (Andrew's monotone chain)."""
    points = sorted({(round(float(p[0]), 6), round(float(p[1]), 6)) for p in solid.corners})

    def half(ordered: Iterable[Point2]) -> list[Point2]:
        chain: list[Point2] = []
        for p in ordered:
            while len(chain) > 1 and _turns_right(chain[-2], chain[-1], p):
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return half(points) + half(reversed(points))


def _turns_right(a: Point2, b: Point2, p: Point2) -> bool:
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) <= 0


def _is_round(solid: Solid) -> bool:
    """Whether a solid is a circle in plan: a ball, or a cylinder that stands."""
    if solid.kind == "cylinder":
        w, x, y, z = solid.quaternion
        return bool(abs(1 - 2 * (x * x + y * y)) > 1 - 1e-9)
    return solid.kind == "sphere"


def _ahead(path: Guidepath, at: Point2, by: float) -> Point2:
    return at[0] + path.heading[0] * by, at[1] + path.heading[1] * by


def _point(p: Point2) -> Point2:
    return p[0] * 1e3, -p[1] * 1e3


def _page(box: Box) -> Box:
    return box[0] * 1e3, box[1] * 1e3, -box[3] * 1e3, -box[2] * 1e3


def _rectangle(box: Box, style: str, radius: float = 0.0) -> str:
    corner = f' rx="{number(radius)}"' if radius else ""
    return (
        f'<rect class="{style}" x="{number(box[0])}" y="{number(box[2])}"'
        f' width="{number(box[1] - box[0])}" height="{number(box[3] - box[2])}"{corner}/>'
    )


def _line(start: Point2, end: Point2, style: str) -> str:
    return (
        f'<path class="{style}" d="M{number(start[0])} {number(start[1])}'
        f'L{number(end[0])} {number(end[1])}"/>'
    )


def _plain(at: Point2, words: str, size: float) -> str:
    """A text that is never cut."""
    return (
        f'<text x="{number(at[0])}" y="{number(at[1] + 0.35 * size)}"'
        f' font-size="{number(size)}">{clean(words)}</text>'
    )


def _arrow(path: Guidepath, x: float) -> str:
    """A solid arrowhead on a guidepath, towards A."""
    at, (u, v) = _point(path.carriage(x)), path.heading
    ahead, aside = (u * 14, -v * 14), (v * 8, u * 8)
    tip = at[0] + ahead[0], at[1] + ahead[1]
    left = at[0] - ahead[0] / 2 + aside[0], at[1] - ahead[1] / 2 + aside[1]
    right = at[0] - ahead[0] / 2 - aside[0], at[1] - ahead[1] / 2 - aside[1]
    points = " ".join(f"{number(p[0])},{number(p[1])}" for p in (tip, left, right))
    return f'<polygon class="arrow" points="{points}"/>'


def _round_length(length: float) -> float:
    """The next 1, 2 or 5 times a power of ten below a length [mm]."""
    power = 10.0 ** floor(log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length)


__all__ = ["delivered_to", "goals", "outline", "write_svg"]
