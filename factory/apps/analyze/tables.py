"""An analysis as lines of text and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from factory.apps.analyze.analysing import Analysis, Scenario, listed
from factory.apps.analyze.measured import ComparedFigure, Comparison

SHOWN = 12
"""Number of rows of a table; `-v` shows all."""


ASSUMED = """\
assumptions: 2 × r are two robots that alternate, with room for both; operations of such robots
alone are done one at a time; shorter ways scale all ways of a robot alike"""


@dataclass(frozen=True, slots=True)
class PrintedTable:
    """A table to be printed, with its title and a note after it."""

    title: str
    columns: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    note: str = ""


def summary(analysis: Analysis) -> Iterator[str]:
    """The main results, in a few lines."""
    flow, net, timing = analysis.flow, analysis.net, analysis.timing
    does = "sets" if len(analysis.bottlenecks) == 1 else "set"
    hourly = f", {3600 / net.pace:.0f} products an hour" if net.pace else ""
    yield (
        f"{timing.factory.pag.title}, {timing.world}: cycle time {net.pace:.3f} s{hourly}; "
        f"{listed(list(analysis.bottlenecks))} {does} the pace"
    )
    yield f"  {critical_words(analysis)}"
    if spent := analysis.by_product:
        each = listed([f"{seconds:.3f} s for a {product}" for product, seconds in spent.items()])
        yield f"  {analysis.bottlenecks[0]} takes {each}"
    yield (
        f"first product after {flow.first:.2f} s, {flow.units} after {flow.last:.2f} s; "
        f"--wip {analysis.least_wip} or more keeps the full pace"
    )


def critical_words(analysis: Analysis) -> str:
    """The first critical circuit: its places that take time, with their times."""
    circuit, net = analysis.net.critical[0], analysis.net
    spent = dict[str, float]()
    for place, seconds in ((net.net.net.places[p], net.seconds[p]) for p in circuit.places):
        name = f"{place.mode} {place.label}".strip()
        spent[name] = spent.get(name, 0.0) + seconds
    names = [f"{name} {seconds:.3f}" for name, seconds in spent.items() if seconds]
    tokens = f", {circuit.products} products a turn" if circuit.products > 1 else ""
    return f"{circuit.name}: {' · '.join(names)} = {circuit.seconds:.3f} s{tokens}"


def tables(analysis: Analysis, verbose: bool) -> Iterator[PrintedTable]:
    """The tables, in order."""
    most = None if verbose else SHOWN
    yield _shares(analysis, most)
    yield _gains(analysis, most)
    if analysis.asked is not None:
        yield _asked(analysis.net.pace, analysis.asked)
    if analysis.measured is not None:
        yield _totals(analysis.measured)
        yield _durations(analysis.measured, most)


def _shares(analysis: Analysis, most: int | None) -> PrintedTable:
    run, shares = analysis.measured, analysis.flow.shares
    columns = ("robot", "type", "moving", "working", "standing", "waiting", "busy")
    rows = []
    for number in sorted(range(len(shares)), key=lambda n: -shares[n].busy):
        share, robot = shares[number], analysis.timing.factory.robots[number]
        times = (share.moving, share.working, share.standing, share.waiting)
        busy = (run.busy[number].predicted, run.busy[number].measured) if run else ()
        percents = map(_percent, (share.busy, *busy))
        rows.append((robot.name, robot.type, *(f"{t:.3f}" for t in times), *percents))
    added = ("predicted for that run", "measured") if run else ()
    return cut("Robot time in a cycle [s]", (*columns, *added), rows, most)


def _gains(analysis: Analysis, most: int | None) -> PrintedTable:
    rows = []
    for s in analysis.sensitivities:
        worth = max(s.faster, s.shorter, s.copy)
        if worth > 0 or len(analysis.sensitivities) <= SHOWN:
            times = (s.slack, s.faster, s.shorter, s.copy)
            rows.append((worth, (s.robot, *(f"{t + 0.0:.3f}" for t in times))))
    columns = ("robot", "slack", "speed +10 %", "ways -10 %", "second robot")
    ordered = [row for _, row in sorted(rows, key=lambda item: -item[0])]
    made = cut("Cycle time saved by changing one robot [s]", columns, ordered, most)
    return replace(made, note=ASSUMED)


def _asked(pace: float, change: Scenario) -> PrintedTable:
    then = listed(list(change.then), 3)
    row = (change.words, f"{change.pace:.3f}", f"{pace - change.pace:.3f}", then)
    columns = ("change", "cycle time [s]", "saved [s]", "then sets the pace")
    return PrintedTable("What if", columns, [row])


def _totals(run: Comparison) -> PrintedTable:
    rows = [
        ("cycle time [s]", *_compared(run.cycle)),
        ("first product [s]", *_compared(run.first)),
        (f"product {run.units} [s]", *_compared(run.last)),
    ]
    return PrintedTable(f"Against {run.source}", ("", "predicted", "measured", "error"), rows)


def _durations(run: Comparison, most: int | None) -> PrintedTable:
    ordered = sorted(run.durations, key=lambda d: -abs(d.time.error or 0.0))
    rows = [
        (d.label, *_compared(d.time), f"{d.least:.3f} to {d.greatest:.3f}", str(d.count))
        for d in ordered
    ]
    columns = ("operation", "predicted", "measured", "error", "range", "count")
    return cut("Durations of operations [s]", columns, rows, most)


def _compared(pair: ComparedFigure) -> tuple[str, str, str]:
    if pair.measured is None:
        return f"{pair.predicted:.3f}", "–", ""
    error = "" if pair.error is None else f"{100 * pair.error:+.1f} %"
    return f"{pair.predicted:.3f}", f"{pair.measured:.3f}", error


def cut(
    title: str, columns: tuple[str, ...], rows: Sequence[tuple[str, ...]], most: int | None
) -> PrintedTable:
    """A table of at most `most` rows, and the number of further rows."""
    if most is None or len(rows) <= most:
        return PrintedTable(title, columns, rows)
    rest = (f"... {len(rows) - most} more (-v)",) + ("",) * (len(columns) - 1)
    return PrintedTable(title, columns, [*rows[:most], rest])


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"
