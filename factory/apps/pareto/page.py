"""The page of a Pareto front: charts, a table, and the floor plan and command of each point."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from pathlib import Path

from factory.api import Layout
from factory.apps.drawing.canvas import Box, page_box
from factory.apps.drawing.tables import alike, differing, table
from factory.apps.exports.floor_sheet import draw_floor, write_svg
from factory.apps.pareto.chart import cycle_chart, floor_chart
from factory.apps.pareto.front import JITTER, SEED, FrontPoint, ParetoFront, point_name
from factory.apps.report.page import filled

PLAN_NAME = "floor.svg"

TALLEST = 0.8
"""Greatest height of a floor plan, over the width of its panel."""

STYLES = ("report/report.css", "pareto/pareto.css")

COLUMNS = (
    "",
    "robots",
    "tools",
    "lines",
    "relays",
    "cycle, predicted",
    "least for its work",
    "floor",
    "measured",
    "predicted for that run",
    "error",
)


def floor_plans(front: ParetoFront, folder: Path) -> dict[Path, bytes]:
    """The floor plan of each point that has a layout, in the folder of the point."""
    return {
        folder / point_name(number) / PLAN_NAME: write_svg(point.project.layout).encode()
        for number, point in enumerate(front.points)
        if point.predicted is not None
    }


def front_page(front: ParetoFront, commands: Sequence[str]) -> str:
    """The text of the page; `commands` build the points."""
    pictures = _pictures(front)
    points = "".join(
        _point(point_name(number), point, command, pictures.get(number, ""))
        for number, (point, command) in enumerate(zip(front.points, commands, strict=True))
    )
    floors = front.points and front.points[0].area is not None
    fields = {
        "name": escape(front.name, quote=True),
        "counts": escape(_counts(front)),
        "heading": "".join(_cards(front)),
        "ending": _ending(front),
        "cycles": cycle_chart(front),
        "floors": floor_chart(front) if floors else '<p class="text note">No layouts.</p>',
        "table": _table(front),
        "points": points,
        "how": _how(front),
    }
    return filled("pareto/pareto.html", fields, {}, "", (), STYLES)


def _counts(front: ParetoFront) -> str:
    parts = sum(1 for _ in front.points[0].project.pag.parts()) if front.points else 0
    judged = "robots, cycle time, floor" if front.work is not None else "robots, cycle time"
    return f"{parts} parts; the Pareto-optimal factories in {judged}"


def _cards(front: ParetoFront) -> list[str]:
    """The key figures."""
    few, fast = front.points[0], min(front.points, key=lambda point: point.seconds)
    least = f"bound: {front.least.total}, tools included"
    cards = [
        ("Points", f"{len(front.points)}", f"of {front.laid_out or front.estimated} tried"),
        ("Fewest robots", f"{few.robots} <small>{few.seconds:.2f} s</small>", least),
        (
            "Fastest",
            f"{fast.seconds:.2f} <small>s</small>",
            f"{fast.robots} robots; {3600 / fast.seconds:.0f} products an hour",
        ),
    ]
    if front.written is not None:
        written = front.written
        value = f"{written.seconds:.2f} <small>s</small>"
        cards.append(("As written", value, f"{written.robots} robots, {written.area:.2f} m²"))
    if front.trials:
        good = sum(trial.holds for trial in front.trials)
        style = "good" if good == len(front.trials) else "bad"
        value = f'<span class="{style}">{good} of {len(front.trials)}</span>'
        cards.append(("Run in both worlds", value, "as predicted within 2 %"))
    return [
        f'<div class="card"><h3>{name}</h3><p class="value">{value}</p><p>{note}</p></div>'
        for name, value, note in cards
    ]


def _ending(front: ParetoFront) -> str:
    words = [escape(one) for one in (front.ending, front.unproved) if one]
    return "".join(f'<p class="notice" role="note">{w[0].upper()}{w[1:]}.</p>' for w in words)


def _table(front: ParetoFront) -> str:
    made = [
        (_judged(point), _cells(f'<a class="link" href="#{name}">{name}</a>', point))
        for name, point in ((point_name(n), p) for n, p in enumerate(front.points))
    ]
    if front.written is not None:
        made.append((' class="own"', _cells("as written", front.written)))
    every = [cells for _, cells in made]
    shown = differing(every)
    rows = "".join(
        f"<tr{style}><th>{cells[0]}</th>{''.join(f'<td>{cells[n]}</td>' for n in shown if n)}</tr>"
        for style, cells in made
    )
    same = alike(COLUMNS, every)
    note = f'<p class="note">The same for all: {same}.</p>' if same else ""
    return table([COLUMNS[n] for n in shown], rows) + note


def _judged(point: FrontPoint) -> str:
    return ' class="bad"' if point.trial is not None and not point.trial.holds else ""


def _cells(name: str, point: FrontPoint) -> tuple[str, ...]:
    trial = point.trial
    return (
        name,
        str(point.robots),
        str(point.tools or "none"),
        str(len(point.lines) or "none"),
        str(point.relays or "none"),
        _figure(point.seconds, "s"),
        _figure(point.bound, "s"),
        _figure(point.area, "m²"),
        _figure(trial.measured if trial else None, "s"),
        _figure(trial.predicted if trial else None, "s"),
        "not run"
        if trial is None
        else "failed"
        if trial.error is None
        else f"{100 * trial.error:+.1f} %",
    )


def _figure(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:.2f} {unit}"


def _pictures(front: ParetoFront) -> dict[int, str]:
    """The floors of points that have a layout, by number, all at one scale."""
    layouts = {n: p.project.layout for n, p in enumerate(front.points) if p.predicted is not None}
    ruler = max((right - left for left, right, *_ in map(_box, layouts.values())), default=0.0) / 4
    drawn = {number: draw_floor(layout, ruler) for number, layout in layouts.items()}
    sizes = [(right - left, bottom - top) for _, (left, right, top, bottom) in drawn.values()]
    wide, tall = (max(sides) for sides in zip(*sizes, strict=True)) if sizes else (1.0, 1.0)
    whole, pictures = max(wide, tall / TALLEST), dict[int, str]()
    for (number, (text, _)), (width, _) in zip(drawn.items(), sizes, strict=True):
        data = b64encode(text.encode()).decode()
        alt = f"Floor plan of {point_name(number)}: {front.points[number]}"
        pictures[number] = (
            f'<div class="plan" style="aspect-ratio:{whole / tall:.4f}">'
            f'<img alt="{alt}" style="width:{100 * width / whole:.2f}%"'
            f' src="data:image/svg+xml;base64,{data}"></div>'
        )
    return pictures


def _box(layout: Layout) -> Box:
    return page_box(layout.floor)


def _point(name: str, point: FrontPoint, command: str, picture: str) -> str:
    """A panel: what the point is, its floor plan, its lines and its command."""
    words = str(point)
    return (
        f'<section class="panel" id="{name}" aria-labelledby="h-{name}"><div class="bar">'
        f'<h2 id="h-{name}">{name}</h2><span class="note">{words}</span></div>{picture}'
        f'<div class="text"><pre class="command">{escape(command)}</pre>'
        f"{_lines(point)}{_trial(point)}</div></section>"
    )


def _lines(point: FrontPoint) -> str:
    """The labels that share a robot."""
    if not point.lines:
        return '<p class="note">A robot for each label.</p>'
    rows = "".join(f"<li>{escape(', '.join(line))}</li>" for line in point.lines)
    shared = sum(map(len, point.lines))
    count = len(point.lines)
    summary = f"{count} {'robots serve' if count > 1 else 'robot serves'} {shared} labels"
    return f"<details><summary>{summary}</summary><ul>{rows}</ul></details>"


def _trial(point: FrontPoint) -> str:
    """The result of a run of it."""
    trial = point.trial
    if trial is None:
        return ""
    if trial.failures:
        listed = "".join(f"<li>{escape(failure)}</li>" for failure in trial.failures)
        return f'<p class="bad">Its run failed:</p><ul class="violations">{listed}</ul>'
    ideal = f", {trial.ideal:.2f} s in the ideal world" if trial.ideal else ""
    style = "good" if trial.holds else "bad"
    return (
        f'<p class="note {style}">{trial.units} units in MuJoCo: {_figure(trial.measured, "s")}'
        f"{ideal}; predicted {trial.predicted:.2f} s.</p>"
    )


def _how(front: ParetoFront) -> str:
    """The search for the front, and the definitions of its figures."""
    rows = [
        ("Searched", f"{front.estimated} estimates, {front.laid_out} layouts, each certified"),
        (
            "Cycle",
            "predicted for the layout, with all robots at their nominal speed; without a layout"
            " estimated from the sizes of sub-assemblies",
        ),
        (
            "Least",
            "total time of the point's robots in operations in a cycle, divided by their number;"
            " the dashed line has the least total of all points",
        ),
        (
            "Runs",
            f"in both worlds, seed {SEED}: speeds and gains drawn within ± {100 * JITTER:.0f} %, so"
            " the prediction for a run is that for its speeds",
        ),
    ]
    return "".join(f"<dt>{name}</dt><dd>{escape(words)}</dd>" for name, words in rows)
