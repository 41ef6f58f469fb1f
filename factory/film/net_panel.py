"""The net beside the 3-D: each robot's gear is a ring in a row of its own.

From left to right a robot waits, works and waits again, and goes back to its beginning below.
Where robots work together bars join their rows: the two transitions of the operation. A token is
the robot in a slot of a marked place (the thread of the paper's Definition 3.3), in the robot's
paint; so the place of an operation shows as many as robots are in it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from factory.film.colours import operation_colours, robot_colours
from factory.film.history import History, OperationProgress, Spell
from factory.film.sheet import PanelRow, PanelSheet, Rows, robots_shown
from factory.support.arrays import Array
from factory.support.boxes import Point2
from factory.support.pictures.ink import (
    FAINT,
    FLASH,
    GROUND,
    INK,
    LINE,
    WHITE,
    Colour,
    Ink,
    Pixels,
    blended,
    fitted,
    pale,
    width,
)
from factory.theory.plant.operation import Operation

WORK = 0.66
"""Share of a column that an operation takes; the rest is for the place before it."""

LEAST_NOTE = 30.0
"""Room beside a ring in which it is said what its robot is doing, at least, at 1280x720 [px]."""


class Rings:
    """The places of tokens and transitions [px] on a panel of a size; they move with the rows.
    `sheet`: its measures."""

    def __init__(self, size: tuple[int, int], scale: float, rows: Rows) -> None:
        self.factory, self.rows = rows.factory, rows
        self.sheet = PanelSheet(size, scale, rows)

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

    def ends(self, robot: int) -> tuple[float, float]:
        """From where to where a robot's ring is in sight."""
        gear = self.factory.robots[robot].operations
        left, right = self.rest(gear[0]) - self.radius, self.span(gear[-1])[1]
        return max(left, self.sheet.gutter), min(right, self.sheet.size[0] - self.sheet.edge)

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


GLIDE = 0.09
"""Time constant with which a token follows its place [s]."""

BAR = (84, 93, 107)
"""The colour of transitions."""

FADE = 0.3
"""Time constant of the flash of a transition that fires [s]."""


class NetPanel:
    """Draws the net at the times of a film, in their order."""

    def __init__(self, size: tuple[int, int], scale: float, history: History, rows: Rows) -> None:
        self.history, self.factory, self.rows = history, history.factory, rows
        self.rings = Rings(size, scale, rows)
        self.sheet = self.rings.sheet
        self.progress = OperationProgress(history.subject)
        self.paints, self.colours = robot_colours(self.factory), operation_colours(self.factory)
        self.tokens: dict[int, float] = {}
        self.ground: tuple[object, Pixels] | None = None

    def draw(self, time: float, x: Array, elapsed: float) -> Pixels:
        """The panel (height, width, 3) at a time, with robots at `x` [m]; `elapsed` [s] since the
        last, 0 for a picture of its own."""
        ink = Ink(self._ground().copy())
        active = dict(self._active(time, x))
        self._move(time, active, elapsed)
        for number, (_, age) in active.items():
            self._work(ink, self.factory.operations[number], age)
        self._flashes(ink, time)
        for row in self.rows.shown:
            self._note(ink, row, time)
        for row in self.rows.shown:
            self._token(ink, row)
        return ink.pixels

    def target(self, robot: int, time: float, active: dict[int, tuple[float, float]]) -> float:
        """Where on its ring a robot's token belongs, in places gone through since the beginning:
        half way in a place where it waits, as far in an operation as that is done."""
        spell = self.history.at(robot, time)
        begun = self.history.spells[robot][0].step + spell.number
        if not spell.operation:
            return begun + 0.5
        return begun + active[self._operation(robot, spell)][0]

    def _operation(self, robot: int, spell: Spell) -> int:
        return self.factory.robots[robot].operations[spell.step // 2]

    def _active(self, time: float, x: Array) -> Iterator[tuple[int, tuple[float, float]]]:
        """The operations under way that are shown: how far each is, and for how long it has been
        [s]."""
        for row in self.rows.shown:
            spell = self.history.at(row.robot, time)
            if spell.operation:
                operation = self.factory.operations[self._operation(row.robot, spell)]
                age = time - spell.start
                yield operation.index, (self.progress.of(operation, x, age), age)

    def _ground(self) -> Pixels:
        rows = self.rows
        key = (tuple(rows.shown), round(rows.count, 3), round(rows.first, 3), rows.focus)
        if self.ground is None or self.ground[0] != key:
            self.ground = key, self._drawn()
        return self.ground[1]

    def _drawn(self) -> Pixels:
        net, detail = self.factory.net.threaded, robots_shown(self.rows)
        if not self.rows.reduced:
            detail += f", {len(net.places)} places, {len(net.transitions)} transitions"
        ink = self.sheet.blank("Net", detail)
        for row in self.rows.shown:
            self._ring(ink, row)
        for operation in self._operations():
            self._place(ink, operation, pale(self.colours[operation.index]))
            for end in self.rings.span(operation.index):
                self._bar(ink, operation, end, BAR, 1.0)
        for row in self.rows.shown:
            for number in self.factory.robots[row.robot].operations:
                self._rests(ink, row, number)
        if self.rows.reduced:
            ink.box(1, self.sheet.top - 4, self.sheet.gutter - 6, self.sheet.size[1], GROUND)
        self.sheet.names(ink)
        return ink.pixels

    def _operations(self) -> list[Operation]:
        """The operations of the robots that are shown, as far as they are in sight."""
        numbers = {n for row in self.rows.shown for n in self.factory.robots[row.robot].operations}
        sight = self.sheet.gutter, self.sheet.size[0]
        return [
            self.factory.operations[number]
            for number in sorted(numbers)
            if self.rings.span(number)[1] > sight[0] and self.rings.span(number)[0] < sight[1]
        ]

    def _ring(self, ink: Ink, row: PanelRow) -> None:
        """The way of a robot's token."""
        gear, y = self.factory.robots[row.robot].operations, self.sheet.height(row)
        left, right = self.rings.rest(gear[0]), self.rings.span(gear[-1])[1] - self.rings.radius
        line, corner = 1.4 * self.sheet.scale, 7 * self.sheet.scale
        ink.box(left, y - line / 2, right, y + self.rings.deep, LINE, row.alpha, corner, line)

    def _place(self, ink: Ink, operation: Operation, colour: Colour, named: bool = True) -> None:
        """The place of an operation in each of its rows, its name in the carrier's."""
        start, end = self.rings.span(operation.index)
        start = max(start, self.sheet.gutter)
        for row in self._rows_of(operation):
            y = self.sheet.height(row)
            ink.box(start, y - self.rings.half, end, y + self.rings.half, colour, row.alpha)
            if named and row.robot == operation.carrier:
                name = self._name(operation)
                y -= self.rings.half + 10 * self.sheet.scale if self.rings.airy else 0
                ink.words((start + end) / 2, y, name, self.sheet.small, INK, "m", row.alpha)

    def _name(self, operation: Operation) -> str:
        """What an operation does to what, as far as there is room."""
        start, end = self.rings.span(operation.index)
        room = end - max(start, self.sheet.gutter) + (6 if self.rings.airy else -6)
        short, label = operation.template.name, operation.label
        long = short if short == label else f"{short} {label}"
        whole = (name for name in (long, label) if width(name, self.sheet.small) <= room)
        return next(whole, "")

    def _bar(
        self,
        ink: Ink,
        operation: Operation,
        x: float,
        colour: Colour,
        alpha: float,
        wide: float = 1.0,
    ) -> None:
        """A transition: a bar in each of its rows, a line between them."""
        if x < self.sheet.gutter:
            return
        rows = self._rows_of(operation)
        heights = [self.sheet.height(row) for row in rows]
        thin, thick = 0.7 * wide * self.sheet.scale, 1.7 * wide * self.sheet.scale
        shown = min(row.alpha for row in rows) * alpha
        ink.box(x - thin, min(heights), x + thin, max(heights), colour, shown)
        for row, y in zip(rows, heights, strict=True):
            reach = self.rings.half + 2 * self.sheet.scale
            ink.box(x - thick, y - reach, x + thick, y + reach, colour, row.alpha * alpha, thick)

    def _rests(self, ink: Ink, row: PanelRow, number: int) -> None:
        """The place before an operation."""
        x, y, radius = (
            self.rings.rest(number),
            self.sheet.height(row),
            self.rings.radius + self.sheet.scale,
        )
        ink.disc(x, y, radius, WHITE, row.alpha)
        line = 1.3 * self.sheet.scale
        ink.box(x - radius, y - radius, x + radius, y + radius, FAINT, row.alpha, radius, line)

    def _rows_of(self, operation: Operation) -> list[PanelRow]:
        return [row for row in self.rows.shown if row.robot in operation.robots]

    def _work(self, ink: Ink, operation: Operation, age: float) -> None:
        """An operation under way: its place lights up, a line joins its robots."""
        rows = self._rows_of(operation)
        colour = self.colours[operation.index]
        self._place(ink, operation, pale(colour, 0.45), named=False)
        for end in self.rings.span(operation.index):
            self._bar(ink, operation, end, BAR, 1.0)
        if len(rows) > 1:
            y = [self.sheet.height(row) for row in rows]
            x = sum(self._at(row)[0] for row in rows) / len(rows)
            thin, alpha = 1.3 * self.sheet.scale, min(1.0, age / GLIDE) * min(r.alpha for r in rows)
            ink.box(x - thin, min(y), x + thin, max(y), colour, alpha)

    def _note(self, ink: Ink, row: PanelRow, time: float) -> None:
        """What a robot is doing, beside its ring, where no name is seen above the operation."""
        spell, sheet = self.history.at(row.robot, time), self.sheet
        if not spell.operation:
            return
        operation = self.factory.operations[self._operation(row.robot, spell)]
        if self.rings.airy and row.robot == operation.carrier and self._name(operation):
            return
        left, right = self.rings.ends(row.robot)
        free, gap = (left - sheet.gutter, sheet.size[0] - sheet.edge - right), 6 * sheet.scale
        room = max(free) - gap
        label = fitted(operation.label, sheet.small, room)
        if room < LEAST_NOTE * sheet.scale or not label:
            return
        dark, wide = blended(self.colours[operation.index], INK, 0.35), width(label, sheet.small)
        x, y = left - gap - wide if free[0] > free[1] else right + gap, sheet.height(row)
        half = 0.6 * sheet.small
        ink.box(x - 1, y - half, x + wide + 1, y + half, GROUND, 0.85 * row.alpha)
        ink.words(x, y, label, sheet.small, dark, "l", row.alpha)

    def _flashes(self, ink: Ink, time: float) -> None:
        shown = {operation.index for operation in self._operations()}
        for when, event in self.history.recent(time - 4 * FADE, time):
            if event // 2 in shown:
                strength = float(np.exp(-(time - when) / FADE))
                x = self.rings.span(event // 2)[event % 2]
                operation = self.factory.operations[event // 2]
                self._bar(ink, operation, x, FLASH, strength, 1.0 + strength)

    def _move(self, time: float, active: dict[int, tuple[float, float]], elapsed: float) -> None:
        """Tokens follow what happens, a little behind."""
        share = 1.0 - float(np.exp(-elapsed / GLIDE)) if elapsed > 0 else 1.0
        moved = {}
        for row in self.rows.shown:
            target = self.target(row.robot, time, active)
            last = self.tokens.get(row.robot, target)
            moved[row.robot] = last + share * (target - last)
        self.tokens = moved

    def _at(self, row: PanelRow) -> Point2:
        """Where the token of a row is."""
        return self.rings.point(row.robot, self.tokens[row.robot], self.sheet.height(row))

    def _token(self, ink: Ink, row: PanelRow) -> None:
        x, y = self._at(row)
        radius, rim = self.rings.radius, 1.4 * self.sheet.scale
        if x > self.sheet.gutter - radius:
            ink.disc(x, y, radius, WHITE, row.alpha)
            ink.disc(x, y, radius - rim, self.paints[row.robot], row.alpha)
