"""The floor plan of a report, to scale: a millimetre of floor to a unit, y upwards in the factory,
downwards on the page. Robots and parts are groups that the page moves with the time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from factory.geometry.solids import rotation
from factory.layout.layout import Point2
from factory.layout.svg import clean, number, polygon, text
from factory.mjcf import names
from factory.show.report.links import about
from factory.show.report.scene import drawn, owner, stands_for, triangles
from factory.show.report.stage import Stage

MARGIN = 80.0
"""Around everything [mm]."""

RULER = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Lengths that a scale bar may have [m]."""

RULER_ROOM = 2.5
"""What the scale bar takes beneath everything, in sizes of its letters."""

STANDS = {"rail": "rail", "post": "post", "boom": "boom", "head": "boom"}
"""The style of what stands still, by the last word of its name; what has none is not drawn."""

Floats = NDArray[np.float64]


def floor_plan(stage: Stage, labels: dict[str, int]) -> str:
    """The drawing as SVG, to be put into a page."""
    return _Plan(stage, labels).text()


class _Plan:
    """The elements, and how far they reach."""

    def __init__(self, stage: Stage, labels: dict[str, int]) -> None:
        self.stage, self.labels, self.m = stage, labels, stage.m
        self.robots = {robot.name: robot.index for robot in stage.factory.robots}
        self.reach: list[Point2] = []

    def text(self) -> str:
        """The document."""
        layers = {
            "static": [*self._static()],
            "robots": [*self._bodies("robot")],
            "parts": [*self._bodies("part")],
            "stations": [*self._stations()],
            "names": [*self._names()],
        }
        points = np.array(self.reach or [(0.0, 0.0)])
        low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
        size = max(float(high[0] - low[0]), float(high[1] - low[1])) / 45
        high[1] += RULER_ROOM * size
        width, height = high - low
        box = " ".join(number(v) for v in (*low, width, height))
        drawn_layers = "".join(f'<g class="{k}">{"".join(v)}</g>' for k, v in layers.items())
        ruler = _ruler((float(low[0]), float(high[1])), float(width), size)
        return (
            f'<svg class="floor" viewBox="{box}" style="--letter:{size:.0f}px" role="img"'
            f' aria-label="Floor plan to scale">{drawn_layers}{ruler}</svg>'
        )

    def _static(self) -> Iterator[str]:
        """Rails, feeders and the outfeed."""
        shapes: dict[str, list[str]] = {}
        for geom, points in self._rigid(0):
            name = self.m.geom(geom).name
            style = "belt" if owner(name) == "outfeed" else STANDS.get(name.rpartition("/")[2])
            if style:
                corners = outline(points)
                self.reach += corners
                shapes.setdefault(owner(name), []).append(polygon(corners, style))
        for name, drawings in shapes.items():
            yield self._group(name, drawings)

    def _rigid(self, body: int) -> Iterator[tuple[int, Floats]]:
        """The geoms of a body, and of those that are fixed to it, with their vertices in its frame
        [m]."""
        for own in np.flatnonzero(self.m.body_weldid == body).tolist():
            place, turn = self.m.body_pos[own], rotation(self.m.body_quat[own])
            for geom in drawn(self.m, own):
                points = triangles(self.m, geom)[0]
                yield geom, points if own == body else points @ turn.T + place

    def _group(self, name: str, shapes: list[str], extra: str = "") -> str:
        """Shapes that stand for a robot or a part."""
        meant = stands_for(name, self.robots, self.labels)
        marks = "".join(f' data-{k}="{meant[k]}"' for k in ("robot", "label") if k in meant)
        return f"<g{marks}{extra}>{''.join(shapes)}</g>"

    def _bodies(self, kind: str) -> Iterator[str]:
        """Robots or parts, about their own origin; the page puts them where they are."""
        for body in range(1, self.m.nbody):
            name, root = self.m.body(body).name, not int(self.m.body_parentid[body])
            if names.kind(name) != kind or not root:
                continue
            parked = bool(self.stage.position[body, 2] < 0)
            extra = f' data-body="{body}"' + (" hidden" if parked else "")
            if kind == "robot":
                yield self._group(name, self._robot(body, name), extra)
            else:
                points = [triangles(self.m, g)[0] for g in drawn(self.m, body)]
                style = f' style="fill:{self._paint(body)}"'
                title = names.label_of(name)
                shapes = [polygon(outline(np.concatenate(points)), "part", style, title)]
                yield self._group(name, shapes, extra)

    def _robot(self, body: int, name: str) -> list[str]:
        """Arm and carriage; the finger reaches below the payload."""
        turn = rotation(self.stage.quaternion[body])
        robot = name.partition("/")[0]
        role = self.stage.roles[self.robots[robot]]
        found = []
        for geom, points in self._rigid(body):
            kind = self.m.geom(geom).name.rpartition("/")[2]
            style = {"arm": "arm", "finger": "arm", "carriage": f"carriage {role}"}.get(kind)
            corners = outline(points @ turn.T)
            for x, y in corners:
                for far in self.stage.reach[:, body]:
                    self.reach.append((x + 1e3 * float(far[0]), y - 1e3 * float(far[1])))
            if style:
                found.append(polygon(corners, style))
        found.sort(key=lambda shape: "carriage" in shape)
        return found

    def _names(self) -> Iterator[str]:
        """Robots' names, above what they carry, on their way with them."""
        for name in self.robots:
            body = self.m.body(names.carriage(name)).id
            yield f'<g data-body="{body}">{text((0, 0), name, 26.0, "name", "middle")}</g>'

    def _paint(self, body: int) -> str:
        geom = drawn(self.m, body)[0]
        paint = self.m.geom_matid[geom]
        rgba = self.m.mat_rgba[paint] if paint >= 0 else self.m.geom_rgba[geom]
        red, green, blue = (round(255 * float(min(max(c, 0), 1))) for c in rgba[:3])
        return f"#{red:02x}{green:02x}{blue:02x}"

    def _stations(self) -> Iterator[str]:
        """A ring where the carrier of an operation of several robots holds its payload as it
        ends."""
        for (x, y), made in self.stage.stations.items():
            of = about(self.labels, made[0])
            marks = f'data-label="{self.labels[of]}"' if of else ""
            title = f"<title>{clean(', '.join(made))}</title>"
            at = f'cx="{round(1e3 * x)}" cy="{round(-1e3 * y)}" r="11"'
            yield f'<circle class="station" {marks} {at}>{title}</circle>'


def outline(points: Floats) -> list[Point2]:
    """The convex outline of points (n, 3) [m] in plan, on the page [mm]."""
    from shapely import MultiPoint

    hull = MultiPoint(np.unique(np.round(1e3 * points[:, :2], 1), axis=0)).convex_hull
    around = hull.exterior if hull.geom_type == "Polygon" else hull
    return [(float(x), -float(y)) for x, y in around.coords]


def _ruler(corner: Point2, width: float, size: float) -> str:
    """A scale bar in the lower left corner."""
    length = max((r for r in RULER if 1e3 * r <= width / 4), default=RULER[0])
    x, y = corner[0] + size, corner[1] - size
    words = f"{length:g} m" if length >= 1 else f"{100 * length:g} cm"
    bar = f"M{x:.1f} {y - size / 2:.1f}v{size / 2:.1f}h{1e3 * length:.1f}v{-size / 2:.1f}"
    at = (x + 500 * length, y - size)
    return f'<path class="ruler" d="{bar}"/>{text(at, words, size, "measure", "middle")}'
