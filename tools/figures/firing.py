"""The firing of a transition, with its threads; and fragments of nets."""

from __future__ import annotations

from collections.abc import Mapping

from factory.api import Factory
from factory.apps.drawing.canvas import Point
from tools.figures.sheet import RADIUS, SMALL, Sheet

LANE, SLOT = 62.0, 24.0
"""Distances of lanes, and of the slots of a place."""


class Firing:
    """The mate of two parts, its robots before, in and after it, as one transition fires.

    Attributes:
        factory: the factory.
        label: what the operation makes.
    """

    def __init__(self, factory: Factory, label: str) -> None:
        self.factory, self.operation = factory, factory.by_label[label]
        self.net, self.slots = factory.net.threaded, factory.net.slots
        start = self.net.redistribution[self.operation.start]
        end = self.net.redistribution[self.operation.end]
        self.before = {after: place for (place, _), after in start}
        self.after = {before: place for before, (place, _) in end}

    def draw(self) -> str:
        """Both markings side by side, the transition's redistribution in words below."""
        sheet = Sheet(322.0)
        names = self.operation.label
        for left, marked, title in (
            (8.0, False, f"Before {names}_{{s}} fires:  (m, f_{{m}})"),
            (386.0, True, "After it has fired:  (m′, f_{m′})"),
        ):
            sheet.panel(left, left + 366, 8, 264)
            sheet.title((left + 14, 27), title)
            self._panel(sheet, left, marked)
        self._table(sheet)
        return sheet.svg(f"{self.operation.label}: a firing with its threads")

    def _panel(self, sheet: Sheet, left: float, fired: bool) -> None:
        robots = sorted(self.operation.robots)
        lanes = {robot: 82.0 + LANE * row for row, robot in enumerate(robots)}
        x = {"before": 56.0, "start": 124.0, "in": 186.0, "end": 248.0, "after": 316.0}
        across = {name: left + value for name, value in x.items()}
        middle = sum(lanes.values()) / len(lanes)
        inside = {
            slot: (across["in"], middle + SLOT * (slot - 1) * 1.2)
            for slot in range(len(self.operation.robots))
        }
        self._operation(sheet, inside)
        for slot, robot in enumerate(self.operation.robots):
            y, (x_in, y_in) = lanes[robot], inside[slot]
            way = [(across["before"] + RADIUS, y), (across["start"], y), (x_in - 10, y_in)]
            sheet.thread(way, f"gear{robot}")
            way = [(x_in + 10, y_in), (across["end"], y), (across["after"] - RADIUS - 6, y)]
            sheet.thread(way, f"gear{robot}")
            with sheet.group(f"gear{robot}"):
                for tip in (across["start"] - 3, across["after"] - RADIUS):
                    sheet.head((tip, y), (tip - 8, y), 3.8, "tip")
            if fired:
                sheet.robot((x_in, y_in), robot)
            else:
                sheet.words((x_in, y_in), str(slot + 1), SMALL, "grey")
        top, bottom = min(lanes.values()) - 17, max(lanes.values()) + 17
        for name, sign in (("start", "s"), ("end", "e")):
            sheet.bar((across[name], (top + bottom) / 2), (bottom - top) / 2)
            words = f"{self.operation.label}_{{{sign}}}"
            sheet.words((across[name], bottom + 14), words, SMALL, "grey")
        for robot in robots:
            slot = self.operation.robots.index(robot)
            for name, places in (("before", self.before), ("after", self.after)):
                place = places[self.operation.place, slot]
                at = across[name], lanes[robot]
                sheet.node(at, f"gear{robot}")
                if name == "before" and not fired:
                    sheet.robot(at, robot)
                shown = self.net.places[place]
                sheet.words((at[0], at[1] + 21), f"r_{{{robot + 1}}}:{shown.label}", SMALL)

    def _operation(self, sheet: Sheet, inside: Mapping[int, Point]) -> None:
        """The place of the operation, with a slot for each robot."""
        xs, ys = zip(*inside.values(), strict=True)
        box = xs[0] - 21, xs[0] + 21, min(ys) - 22, max(ys) + 22
        sheet.rectangle(box, "op", 21.0)
        for at in inside.values():
            sheet.circle(at, 10.5, "slot")
        words = f"{self.operation.template.name} {self.operation.label}"
        sheet.words((xs[0], max(ys) + 34), words, SMALL)

    def _table(self, sheet: Sheet) -> None:
        """d_e and f_m as rows of one table."""
        name = self.operation.label
        entries = []
        for slot, robot in enumerate(self.operation.robots):
            held = self.net.places[self.before[self.operation.place, slot]].label
            entries.append(f"d(r_{{{robot + 1}}}:{held}, 1) = ({name}, {slot + 1})")
        for column, words in enumerate(entries):
            sheet.words((134.0 + 246 * column, 286.0), words)
        threads = ", ".join(f"r_{{{robot + 1}}}" for robot in self.operation.robots)
        words = f"so f_{{m′}} puts {threads} into the slots 1, 2, 3 of {name}, in this order"
        sheet.words((380.0, 308.0), words, SMALL, "grey")


def draw_fragments() -> str:
    """The fragment N_O of an operation, and N_0, with which Compile begins (figures 2 and 3)."""
    sheet = Sheet(250.0)
    sheet.panel(8, 452, 8, 242)
    sheet.title((22, 27), "N_{O}(r_{1}, …, r_{k}):  an operation")
    rows = {"1": 74.0, "2": 126.0, "k": 200.0}
    left, start, middle, end, right = 66.0, 158.0, 228.0, 298.0, 390.0
    for row, y in enumerate(rows.values()):
        style = f"gear{(4, 5, 2)[row]}"
        sheet.thread([(left + RADIUS, y), (start, y), (middle, 130 + 16.0 * (row - 1))], style)
        sheet.thread([(middle, 130 + 16.0 * (row - 1)), (end, y), (right - RADIUS - 6, y)], style)
        with sheet.group(style):
            for tip in (start - 3, right - RADIUS):
                sheet.head((tip, y), (tip - 8, y), 3.8, "tip")
    for x, sign in ((start, "s"), (end, "e")):
        sheet.bar((x, 137.0), 86.0)
        sheet.words((x, 232.0), f"O_{{{sign}}}", SMALL)
    sheet.circle((middle, 130.0), 32.0, "op")
    sheet.words((middle, 124.0), "O", 14.0, "h")
    sheet.words((middle, 141.0), "l = k", SMALL, "grey")
    for row, (name, y) in enumerate(rows.items()):
        style = f"gear{(4, 5, 2)[row]}"
        for x, label in ((left, "a"), (right, "b")):
            sheet.node((x, y), style)
            sheet.words((x, y + 22), f"wait(r_{{{name}}}, {label}_{{{name}}})", SMALL)
    for x in (left, right):
        sheet.words((x, 171.0), "⋮", 14.0, "grey")
    _draw_first(sheet)
    return sheet.svg("The fragment of an operation, and the fragment with which Compile begins")


def _draw_first(sheet: Sheet) -> None:
    sheet.panel(466, 752, 8, 242)
    sheet.title((480, 27), "N_{0}:  the output robot")
    left, middle, right, top, bottom = 532.0, 602.0, 670.0, 98.0, 186.0
    sheet.link((left + RADIUS, top), (middle, top), "gear0", 3.0)
    sheet.link((middle, top), (right - RADIUS, top), "gear0")
    sheet.link((right, top + RADIUS), (right, (top + bottom) / 2), "gear0", 3.0)
    with sheet.group("gear0"):
        sheet.line("arc", (right, (top + bottom) / 2), (right, bottom), (middle + 20, bottom))
        sheet.head((middle + RADIUS, bottom), (middle + RADIUS + 8, bottom), 3.8, "tip")
        sheet.line("faint", (middle - RADIUS, bottom), (left, bottom), (left, top + RADIUS + 8))
        sheet.head((left, top + RADIUS), (left, top + RADIUS + 8), 3.8, "tip")
    for at in ((left, top), (right, top), (middle, bottom)):
        sheet.node(at, "gear0", tokens=at[1] == bottom)
    sheet.bar((middle, top), 17.0)
    sheet.bar((right, (top + bottom) / 2), 17.0, 0.0)
    for at, words in (
        ((left, top - 25), "wait(r, FinalAssem)"),
        ((right, top - 25), "DropOff(r)"),
        ((middle, bottom + 24), "wait(r, nopart)"),
    ):
        sheet.words(at, words, SMALL)
    sheet.words((middle, top + 28), "DropOff_{s}", SMALL, "grey")
    sheet.words((right + 44, (top + bottom) / 2), "DropOff_{e}", SMALL, "grey")
    for row, words in enumerate(("the operation", "of the root")):
        sheet.words((left + 10, 141.0 + 15 * row), words, SMALL, "grey", "start")
