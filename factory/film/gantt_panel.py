"""What each robot did in the last seconds: a bar for each operation, the present at the right."""

from __future__ import annotations

from math import ceil

from factory.film.colours import AMBER, DEAD, operation_colours, template_colours
from factory.film.history import TIE, History, OperationProgress, Spell
from factory.film.sheet import FOOT, PanelRow, PanelSheet, Rows
from factory.support.arrays import Array
from factory.support.pictures.ink import FAINT, FLASH, LINE, WHITE, Ink, Pixels, fitted, pale, width

CYCLES = 2.2
"""How many rounds of the busiest robot are shown."""

SHORTEST, LONGEST = 6.0, 40.0
"""Time that is shown [s]."""

STEPS = (1.0, 2.0, 5.0, 10.0)
"""Time between two lines [s]: the least of which there are no more than eight."""


def _window(history: History) -> float:
    """Duration that is shown [s]."""
    progress, factory = OperationProgress(history.subject), history.factory
    times = [progress.expected(operation) for operation in factory.operations]
    busiest = max(sum(times[n] for n in robot.operations) for robot in factory.robots)
    return float(round(min(max(CYCLES * busiest, SHORTEST), LONGEST)))


class GanttPanel:
    """Draws the robots' modes over time."""

    def __init__(self, size: tuple[int, int], scale: float, history: History, rows: Rows) -> None:
        self.history, self.factory, self.rows = history, history.factory, rows
        self.sheet = PanelSheet(size, scale, rows, FOOT * scale)
        self.colours = operation_colours(self.factory)
        self.window = _window(history)
        self.step = next((s for s in STEPS if self.window / s <= 8), STEPS[-1])
        self.left, self.right = self.sheet.gutter, size[0] - self.sheet.edge

    def draw(self, time: float, x: Array, elapsed: float) -> Pixels:
        """The panel (height, width, 3) at a time."""
        ink = self.sheet.blank("Robots over time", "")
        self._legend(ink)
        bottom = self.sheet.top + self.rows.count * self.sheet.pitch
        self._lines(ink, time, bottom)
        for row in self.rows.shown:
            self._stands(ink, row, time)
            for spell in self.history.since(row.robot, time - self.window):
                self._spell(ink, row, spell, time)
        thin = self.sheet.scale
        ink.box(self.right - thin, self.sheet.top, self.right + thin, bottom, FLASH)
        self.sheet.names(ink, self.history.stands(time))
        return ink.pixels

    def at(self, time: float, now: float) -> float:
        """Horizontal position of a time [px]."""
        return self.right - (now - time) / self.window * (self.right - self.left)

    def _legend(self, ink: Ink) -> None:
        """The legend: colours of the operations, from the right, and of failures."""
        x, y, small = self.right, 20 * self.sheet.scale, self.sheet.points - 2
        colours = template_colours(self.factory)
        colours |= {"stands": AMBER} if self.history.standing else {}
        colours |= {"dead": DEAD} if self.history.deaths() else {}
        colours |= {"undone": FLASH} if self.history.undone else {}
        for name, colour in reversed(colours.items()):
            if x - width(name, small) < 0.52 * self.sheet.size[0]:
                break
            ink.words(x, y, name, small, FAINT, "r")
            x -= width(name, small) + 0.5 * small
            ink.box(x - 0.7 * small, y - 0.35 * small, x, y + 0.35 * small, colour, 1.0, 2)
            x -= 1.6 * small

    def _lines(self, ink: Ink, now: float, bottom: float) -> None:
        thin, small = self.sheet.scale / 2, self.sheet.points - 2
        y = bottom + 11 * self.sheet.scale
        number = max(ceil((now - self.window) / self.step), 0)
        while number * self.step <= now:
            x = self.at(number * self.step, now)
            ink.box(x - thin, self.sheet.top, x + thin, bottom, LINE)
            if self.left + small < x < self.right - 4 * small:
                ink.words(x, y, f"{number * self.step:.0f} s", small, FAINT, "m")
            number += 1
        ink.words(self.right, y, "now", small, FLASH, "r")

    def _stands(self, ink: Ink, row: PanelRow, now: float) -> None:
        """A band where a robot stood, a dark one where it was dead, to where a spare took its
        place."""
        y, half = self.sheet.height(row), 0.5 * self.sheet.pitch
        for start, end in self.history.stood(row.robot, now - self.window, now):
            left, right = max(self.at(start, now), self.left), self.at(end, now)
            ink.box(left, y - half, right, y + half, AMBER, 0.3 * row.alpha)
        for death in self.history.deaths():
            past = death.start > now or death.end < now - self.window
            if self.history.index[death.robot] != row.robot or past:
                continue
            left = max(self.at(death.start, now), self.left)
            right = self.at(min(death.end, now), now)
            ink.box(left, y - half, right, y + half, DEAD, 0.45 * row.alpha)
            if death.end <= now:  # a spare goes on from here
                ink.box(right - self.sheet.scale, y - half, right, y + half, DEAD, row.alpha)

    def _spell(self, ink: Ink, row: PanelRow, spell: Spell, now: float) -> None:
        """A bar for an operation of a robot, hatched where that was undone, a thin one where it
        waits with a part; empty-handed it has none."""
        if spell.start > now or not spell.step:
            return
        is_undone = spell.undone < now - TIE
        left = max(self.at(spell.start, now), self.left)
        right = self.at(min(spell.end, now), now)
        y, gear = self.sheet.height(row), self.factory.robots[row.robot].operations
        if not spell.operation:
            before = FLASH if is_undone else self.colours[gear[spell.step // 2 - 1]]
            thin = 1.6 * self.sheet.scale
            ink.box(left, y - thin, right, y + thin, pale(before, 0.35), row.alpha)
            return
        operation = self.factory.operations[gear[spell.step // 2]]
        half, colour = (
            0.38 * min(self.sheet.pitch, 30 * self.sheet.scale),
            self.colours[operation.index],
        )
        room = right - left - 8 * self.sheet.scale
        name = fitted(operation.label, self.sheet.small, room)
        start = left + 4 * self.sheet.scale
        if is_undone:
            ink.box(left, y - half, right, y + half, WHITE, row.alpha)
            ink.hatched(left, y - half, right, y + half, FLASH, 6 * self.sheet.scale)
            if name:
                end = start + width(name, self.sheet.small)
                ink.box(start - 2, y - half + 2, end + 2, y + half - 2, WHITE, row.alpha)
        else:
            ink.box(left, y - half, right, y + half, colour, row.alpha, 3 * self.sheet.scale)
        paint = FLASH if is_undone else WHITE
        ink.words(start, y, name, self.sheet.small, paint, "l", row.alpha)
