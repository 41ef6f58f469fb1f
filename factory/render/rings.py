"""Where everything is in the panel of the net: each robot's gear is a ring, unrolled in its row."""

from __future__ import annotations

from factory.layout.layout import Point2
from factory.render.rows import Rows
from factory.render.sheet import PanelSheet

WORK = 0.66
"""Share of a column that an operation takes; the rest is for the place before it."""

NARROW, NOTES = 50.0, 84.0
"""Where operations are narrower than this at 1280x720, what each robot is doing is said beside its
name, in so much room [px]."""


class Rings:
    """The places of tokens and transitions [px] on a panel of a size; they move with the rows.
    `sheet`: its measures."""

    def __init__(self, size: tuple[int, int], scale: float, rows: Rows) -> None:
        self.factory, self.rows = rows.factory, rows
        self.sheet = PanelSheet(size, scale, rows)
        if WORK * self.pitch < NARROW * scale:
            self.sheet = PanelSheet(size, scale, rows, notes=NOTES * scale)

    @property
    def radius(self) -> float:
        """Of a token."""
        return min(8.5 * self.sheet.scale, 0.34 * self.sheet.pitch, 0.17 * self.pitch)

    @property
    def half(self) -> float:
        """Half the height of an operation in a row."""
        return min((10 if self.airy else 11) * self.sheet.scale, 0.4 * self.sheet.pitch)

    @property
    def airy(self) -> bool:
        """Whether names have room above the rows, where tokens don't cover them."""
        return self.sheet.pitch >= 38 * self.sheet.scale

    @property
    def pitch(self) -> float:
        """Width of a column."""
        room = self.sheet.size[0] - self.sheet.gutter - self.sheet.edge
        return room / self.rows.columns

    def span(self, operation: int) -> tuple[float, float]:
        """From where to where an operation is."""
        right = self.sheet.gutter + (self.rows.column[operation] + 1 - self.rows.first) * self.pitch
        right -= 3 * self.sheet.scale
        return right - WORK * self.pitch, right

    def point(self, robot: int, place: float, y: float) -> Point2:
        """Where on the panel a token is that is so far on its ring."""
        gear = self.factory.robots[robot].operations
        step, share = divmod(place % (2 * len(gear)), 1.0)
        number = int(step) // 2
        if step % 2:
            return self.within(gear[number], share), y
        start, rest = self.span(gear[number])[0], self.rest(gear[number])
        if share >= 0.5:
            return rest + (2 * share - 1) * (start + self.radius - rest), y
        if number:
            before = self.span(gear[number - 1])[1] - self.radius
            return before + 2 * share * (rest - before), y
        return self._back(self.span(gear[-1])[1] - self.radius, rest, y, 2 * share)

    def within(self, operation: int, done: float) -> float:
        """Where tokens are in an operation that is so far."""
        start, end = self.span(operation)
        inset = min(self.radius, (end - start) / 2)
        return start + inset + done * (end - start - 2 * inset)

    def rest(self, operation: int) -> float:
        """Where the place before an operation is."""
        return self.span(operation)[0] - (1 - WORK) * self.pitch / 2

    def _back(self, right: float, left: float, y: float, share: float) -> Point2:
        """The way back to the beginning: down, left, up."""
        deep = self.deep
        way = share * (right - left + 2 * deep)
        if way < deep:
            return right, y + way
        if way < deep + right - left:
            return right - (way - deep), y + deep
        return left, y + (right - left + 2 * deep - way)

    @property
    def deep(self) -> float:
        """How far below its row a robot goes back."""
        return min(self.half + 8 * self.sheet.scale, 0.56 * self.sheet.pitch)
