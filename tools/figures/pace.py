"""What each robot does in a run of the ideal world, and which gear sets the pace."""

from __future__ import annotations

from itertools import pairwise

import factory
from factory.api import Event, Layout
from tools.figures.sheet import HEAD, SMALL, WIDTH, Sheet

UNITS, LANE, BAR = 4, 40.0, 24.0
"""Products of the run; distance of rows and height of bars [pixels]."""

LEFT, TOP = 44.0, 46.0
"""Where time and rows begin [pixels]."""


def draw_pace(layout: Layout) -> str:
    """A row for each robot, a bar for each operation; the gear of the slowest, twice around."""
    run, made = factory.run(layout, world="ideal", units=UNITS), layout.factory
    ends = {int(operation.end): operation for operation in made.operations}
    names = [transition.name for transition in made.net.threaded.transitions]
    fired = [(e.t, names.index(e.transition)) for e in run.events if isinstance(e, Event)]
    last = max(t for t, _ in fired)
    scale = (WIDTH - LEFT - 12.0) / last
    sheet = Sheet(TOP + LANE * len(made.robots) + 54.0)
    bottom = sheet.height - 24.0
    for second in range(int(last) + 1):
        x = LEFT + scale * second
        sheet.line("faint", (x, TOP - 8), (x, bottom - 26))
        sheet.words((x, bottom - 14), f"{second} s", SMALL, "grey")
    for robot in range(len(made.robots)):
        with sheet.group(f"gear{robot}"):
            sheet.words(
                (8.0, TOP + LANE * (robot + 0.5)), f"r_{{{robot + 1}}}", 15.0, "h hue", "start"
            )
    begun = dict[int, list[float]]()
    for t, event in fired:
        operation = ends.get(event)
        if operation is None:
            begun.setdefault(event, []).append(t)
            continue
        start = begun[operation.start].pop(0)
        for robot in operation.robots:
            middle = TOP + LANE * (robot + 0.5)
            box = LEFT + scale * start, LEFT + scale * t, middle - BAR / 2, middle + BAR / 2
            with sheet.group(f"gear{robot}"):
                sheet.rectangle(box, "busy" if len(operation.robots) > 1 else "alone", 3.0)
            if box[1] - box[0] > 4 + 6.3 * len(operation.label):
                at, words = ((box[0] + box[1]) / 2, middle), operation.label
                sheet.words(at, words, 10.0, "white" if len(operation.robots) > 1 else "")
    for x, style, words in (
        (LEFT, "busy", "with others"),
        (LEFT + 120, "alone", "alone: fetching a part, dropping off the product"),
    ):
        with sheet.group("shared"):
            sheet.rectangle((x, x + 14, bottom + 3, bottom + 17), style, 2.0)
        sheet.words((x + 20, bottom + 10), words, SMALL, "", "start")
    _cycle(sheet, [t for t, event in fired if names[event] == "sub1_s"], scale)
    return sheet.svg("What robots do in a run of the ideal world", STYLE)


def _cycle(sheet: Sheet, starts: list[float], scale: float) -> None:
    """The time from one start of the slowest robot's gear to the next."""
    y = TOP - 16.0
    for begin, end in pairwise(starts[1:]):
        left, right = LEFT + scale * begin, LEFT + scale * end
        with sheet.group("wrong"):
            sheet.line("arc", (left + HEAD[0], y), (right - HEAD[0], y))
            sheet.head((left, y), (left + HEAD[0], y), HEAD[1], "tip")
            sheet.head((right, y), (right - HEAD[0], y), HEAD[1], "tip")
            sheet.words(
                ((left + right) / 2, y - 12),
                f"once around r_{{3}}: {end - begin:.2f} s",
                SMALL,
                "hue",
            )


STYLE = """
.busy { fill: currentColor; } .alone { fill: currentColor; fill-opacity: 0.28; }
"""
