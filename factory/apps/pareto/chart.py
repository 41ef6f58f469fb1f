"""Charts of a front: a figure of its points against their robots, as SVG to be put into a page.

Both axes are logarithmic: a constant product of cycle time and robots is a straight line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from math import floor, log10

from factory.apps.drawing.canvas import Canvas, Point
from factory.apps.pareto.front import FrontPoint, ParetoFront, point_name

PAGE = (0.0, 640.0, 0.0, 400.0)
FIELD = (52.0, 622.0, 26.0, 356.0)
"""Where the points are on the page."""

LETTERS = 12.0

DOT = 5.5
"""Radius of a point."""

ROOM = 1.12
"""Factor by which the axes extend beyond the points."""

STEPS = (
    (1.0, 2.0, 5.0),
    (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0),
    tuple(n / 10 for n in (*range(10, 30, 2), *range(30, 100, 5))),
)
"""Marks of an axis, times powers of ten: the first that give MARKS."""

MARKS = 4


@dataclass(frozen=True, slots=True)
class ChartAxis:
    """A logarithmic axis from `low` to `high`, drawn from `start` to `end`."""

    low: float
    high: float
    start: float
    end: float

    @classmethod
    def over(cls, values: Sequence[float], start: float, end: float) -> ChartAxis:
        """One with room for values."""
        return cls(min(values) / ROOM, max(values) * ROOM, start, end)

    def at(self, value: float) -> float:
        """Where a value is."""
        share = log10(value / self.low) / log10(self.high / self.low)
        return self.start + share * (self.end - self.start)

    def marks(self, whole: bool = False) -> list[float]:
        """The round values on it, numbers without a fraction where it is `whole`."""
        powers = range(floor(log10(self.low)), floor(log10(self.high)) + 1)
        values: list[float] = []
        for steps in STEPS:
            every = [round(step * 10.0**power, 6) for power in powers for step in steps]
            values = [x for x in every if self.low <= x <= self.high and not (whole and x % 1)]
            if len(values) >= MARKS:
                break
        return values


def cycle_chart(front: ParetoFront) -> str:
    """The cycle times of the points against their robots, with the product as written, and the
    bound work / robots."""
    return _Chart(front, lambda point: point.seconds, "cycle time [s]", front.work).text()


def floor_chart(front: ParetoFront) -> str:
    """The floors of the points against their robots."""
    return _Chart(front, lambda point: point.area or 0.0, "floor [m²]").text()


class _Chart:
    """Draws a figure of the points on a canvas; `work` over robots is a bound where it is given."""

    def __init__(
        self,
        front: ParetoFront,
        figure: Callable[[FrontPoint], float],
        name: str,
        work: float | None = None,
    ) -> None:
        self.front, self.figure, self.name = front, figure, name
        self.canvas = Canvas()
        shown = [*front.points, *([front.written] if front.written else [])]
        left, right, top, bottom = FIELD
        self.x = ChartAxis.over([point.robots for point in shown], left, right)
        bounds = [] if work is None else [work / point.robots for point in shown]
        self.y = ChartAxis.over([*map(figure, shown), *bounds], bottom, top)
        self.work = work

    def text(self) -> str:
        """The chart."""
        self._axes()
        if self.work is not None:
            self._bound(self.work)
        self._stairs()
        written = self.front.written
        if written is not None:
            title = f"as written: {written}"
            self.canvas.circle(self._at(written), DOT + 3, "written", title=title)
        for number, point in enumerate(self.front.points):
            self._point(point_name(number), point)
        for number, point in enumerate(self.front.points):
            self.canvas.place(self._at(point), point_name(number), LETTERS, DOT + 1, "label")
        return self.canvas.embedded("chart", PAGE, aria_label=f"{self.name} against robots")

    def _at(self, point: FrontPoint) -> Point:
        return self.x.at(point.robots), self.y.at(self.figure(point))

    def _axes(self) -> None:
        left, right, top, bottom = FIELD
        before = -99.0
        for value in self.x.marks(True):
            if self.x.at(value) - before > 28:
                before = self.x.at(value)
                self.canvas.line("grid", (before, top), (before, bottom))
                self.canvas.text((before, bottom + 14), f"{value:g}", LETTERS, "mark", "middle")
        before = 999.0
        for value in self.y.marks():
            if before - self.y.at(value) > 20:
                before = self.y.at(value)
                self.canvas.line("grid", (left, before), (right, before))
                self.canvas.text((left - 7, before), f"{value:g}", LETTERS, "mark", "end")
        self.canvas.text((right, bottom + 32), "robots, tools included", LETTERS, "axis", "end")
        self.canvas.text((left, top - 14), self.name, LETTERS, "axis")

    def _bound(self, work: float) -> None:
        """The part of the line work / robots that is on the page."""
        ends_at = work / self.y.high, work / self.y.low
        first, last = (min(max(robots, self.x.low), self.x.high) for robots in ends_at)
        if first < last:
            ends = [(self.x.at(robots), self.y.at(work / robots)) for robots in (first, last)]
            self.canvas.line("bound", *ends)

    def _stairs(self) -> None:
        """The best value with at most each number of robots."""
        best: list[Point] = []
        for point in self.front.points:
            at = self._at(point)
            if not best or at[1] > best[-1][1] + 1e-9:
                best.append(at)
        corners = [corner for a, b in pairwise(best) for corner in (a, (b[0], a[1]))]
        if best:
            self.canvas.line("stairs", *corners, best[-1])

    def _point(self, name: str, point: FrontPoint) -> None:
        """A point, with a link to its panel."""
        at, trial = self._at(point), point.trial
        style = "point" if trial is None else "point held" if trial.holds else "point failed"
        with _link(self.canvas, f"#{name}"):
            self.canvas.circle(at, DOT, style, title=f"{name}: {point}")
        self.canvas.block((at[0] - DOT, at[0] + DOT, at[1] - DOT, at[1] + DOT))


@contextmanager
def _link(canvas: Canvas, target: str) -> Iterator[None]:
    """Elements drawn in this context link to a place of the page."""
    canvas.elements.append(f'<a href="{target}">')
    yield
    canvas.elements.append("</a>")
