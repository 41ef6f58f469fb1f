"""The page of a Pareto front: charts, a table, and the floor plan and command of each point."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path

from factory.apps.exports.floor_sheet import write_svg
from factory.apps.pareto.chart import cycle_chart, floor_chart
from factory.apps.pareto.front import JITTER, SEED, FrontPoint, ParetoFront, point_name
from factory.apps.report.page import filled

PLAN_NAME = "floor.svg"

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


def front_page(
    front: ParetoFront, commands: Sequence[str], plans: Mapping[Path, bytes], folder: Path
) -> str:
    """The text of the page: `commands` build the points, `plans` are their floor plans by the paths
    that `floor_plans` gives them in the same folder."""
    pictures = [plans.get(folder / point_name(n) / PLAN_NAME) for n in range(len(front.points))]
    points = "".join(
        _point(point_name(number), point, command, picture)
        for number, (point, command, picture) in enumerate(
            zip(front.points, commands, pictures, strict=True)
        )
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
    words = [escape(front.unproved)] * bool(front.unproved)
    if not front.complete:
        words.append("The search is incomplete: it ran out of time or was stopped.")
    return "".join(f'<p class="notice" role="note">{one}</p>' for one in words)


def _table(front: ParetoFront) -> str:
    rows = "".join(
        f"<tr{_judged(point)}>{_row(point_name(n), point)}</tr>"
        for n, point in enumerate(front.points)
    )
    if front.written is not None:
        rows += f'<tr class="own">{_row("", front.written)}</tr>'
    head = "".join(f"<th>{name}</th>" for name in COLUMNS)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _judged(point: FrontPoint) -> str:
    return ' class="bad"' if point.trial is not None and not point.trial.holds else ""


def _row(name: str, point: FrontPoint) -> str:
    """The cells of a point; one without a name is the product as it is written."""
    trial = point.trial
    cells = (
        str(point.robots),
        str(point.tools or "–"),
        str(len(point.lines) or "–"),
        str(point.relays or "–"),
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
    first = f'<a class="link" href="#{name}">{name}</a>' if name else "as written"
    return f"<th>{first}</th>" + "".join(f"<td>{cell}</td>" for cell in cells)


def _figure(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:.2f} {unit}"


def _point(name: str, point: FrontPoint, command: str, plan: bytes | None) -> str:
    """A panel: what the point is, its floor plan, its lines and its command."""
    words, picture = str(point), ""
    if plan is not None:
        data = b64encode(plan).decode()
        alt = f"Floor plan of {name}: {words}"
        picture = f'<img class="plan" alt="{alt}" src="data:image/svg+xml;base64,{data}">'
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
