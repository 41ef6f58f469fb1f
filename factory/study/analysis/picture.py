"""An analysis as a picture: schedule with the critical circuit, times, sensitivity, copies in work.

It needs matplotlib, an optional part.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from factory.study.analysis.analysing import Analysis
from factory.study.analysis.what_if import listed
from factory.support import plotting
from factory.support.errors import Diagnostic, InputError
from factory.support.plotting import BLUE, GREY, ORANGE, PALE, RED

LIGHT = "#9db8db"
FORMATS = (".svg", ".png")

ROWS = 24
"""Upper bound on the robots that are drawn, the busiest."""

BARS = 8
"""Upper bound on the robots with bars of the time that changing them saves."""

CYCLES = 2.2
"""Number of cycles of the schedule that are drawn."""

STYLE = {**plotting.STYLE, "svg.hashsalt": "factory", "svg.fonttype": "none"}


def check_picture(path: Path | None) -> None:
    """Whether a picture can be made, before anything is computed. Raises InputError (BadFile) for
    an ending that is not known, MissingError where there is no matplotlib."""
    if path is None:
        return
    if path.suffix.lower() not in FORMATS:
        message = f"'{path}' does not end in .svg or .png"
        raise InputError(Diagnostic("BadFile", message, None, "a picture is an SVG or a PNG file"))
    plotting.require_matplotlib("a picture", "leave out -o")


def picture(analysis: Analysis, suffix: str) -> bytes:
    """The picture as a file of a kind, .svg or .png; the same bytes for the same analysis."""
    check_picture(Path(f"x{suffix}"))
    import matplotlib
    from matplotlib.figure import Figure

    shown = _shown(analysis)
    with matplotlib.rc_context(STYLE):
        high = 1.2 + 0.24 * len(shown)
        figure = Figure(figsize=(13.0, 1.0 + high + 3.2), layout="constrained")
        grid = figure.add_gridspec(2, 6, height_ratios=[high, 3.2])
        _schedule(figure.add_subplot(grid[0, :3]), analysis, shown)
        _time(figure.add_subplot(grid[0, 3:]), analysis, shown)
        _gains(figure.add_subplot(grid[1, :2]), analysis)
        _changes(figure.add_subplot(grid[1, 2:4]), analysis)
        _copies(figure.add_subplot(grid[1, 4:]), analysis)
        figure.suptitle(_title(analysis), x=0.01, ha="left", fontsize=12)
        stream = BytesIO()
        kind = suffix.lower().removeprefix(".")
        metadata = {"Date": None} if kind == "svg" else {"Software": None}
        figure.savefig(stream, format=kind, dpi=110, metadata=metadata)
    return stream.getvalue()


def _title(analysis: Analysis) -> str:
    names = listed(list(analysis.bottlenecks), 4)
    return (
        f"{analysis.timing.factory.pag.root}: cycle time {analysis.net.pace:.3f} s, "
        f"set by {names} ({analysis.timing.world})"
    )


def _shown(analysis: Analysis) -> list[int]:
    """The robots that are drawn, in their order."""
    shares = analysis.flow.shares
    busiest = sorted(range(len(shares)), key=lambda robot: -shares[robot].busy)
    return sorted(busiest[:ROWS])


def _rows(axes: Any, analysis: Analysis, shown: list[int]) -> None:
    axes.set_yticks(range(len(shown)), [analysis.flow.shares[r].robot for r in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)


def _schedule(axes: Any, analysis: Analysis, shown: list[int]) -> None:
    """Operations of each robot over two cycles in the long run; critical ones in red."""
    operations = analysis.timing.factory.operations
    critical = {p for circuit in analysis.net.critical for p in circuit.places}
    length = CYCLES * analysis.net.pace * analysis.net.units
    begin = _begin(analysis, length)
    for row, robot in enumerate(shown):
        for number, start, end in _bars(analysis, robot, begin, length):
            left, right = max(start, 0.0), min(end, length)
            colour = RED if number in critical else LIGHT
            axes.barh(row, right - left, 0.7, left, color=colour, edgecolor="white", linewidth=0.6)
            dwell = analysis.timing.modes[number].dwell
            rest = analysis.timing.rest
            if dwell and end - rest > 0:
                left = max(end - rest - dwell, 0.0)
                wide = max(0.0, min(end - rest, length) - left)
                axes.barh(row, wide, 0.7, left, color="none", hatch="////", edgecolor="white", lw=0)
            label = operations[number].label
            if right - left > 0.011 * len(label) * length and len(shown) <= ROWS:
                ink = "white" if colour == RED else "black"
                middle = (max(start, 0.0) + right) / 2
                axes.text(middle, row, label, ha="center", va="center", fontsize=7, color=ink)
    for cycle in range(1, int(CYCLES) + 1):
        axes.axvline(cycle * analysis.net.pace, color=GREY, linewidth=0.8, linestyle=":")
    _rows(axes, analysis, shown)
    axes.set_xlim(0, length)
    axes.set_xlabel("time [s]")
    axes.set_title("schedule in the long run; red: critical, hatched: dwell, dotted: cycles")


def _begin(analysis: Analysis, length: float) -> float:
    """A moment [s] at which an operation of the critical circuit begins and after which all firings
    are known for `length` [s]."""
    dates, net = analysis.flow.firings.dates, analysis.net
    last = float(dates[-1].min()) - length
    count = len(analysis.timing.factory.operations)
    place = next((p for p in net.critical[0].places if p < count), count - 1)
    starts = dates[:, 2 * place]
    return float(starts[max(0, int(np.searchsorted(starts, last, "right")) - 1)])


def _bars(
    analysis: Analysis, robot: int, begin: float, length: float
) -> Iterator[tuple[int, float, float]]:
    """Operations of a robot, their starts and ends [s] after `begin`, that fall within."""
    dates, seconds = analysis.flow.firings.dates, analysis.net.seconds
    for number in analysis.timing.factory.robots[robot].operations:
        starts = dates[:, 2 * number] - begin
        within = (starts < length) & (starts + seconds[number] > 0)
        for start in starts[within].tolist():
            yield number, start, start + seconds[number]


def _time(axes: Any, analysis: Analysis, shown: list[int]) -> None:
    """Shares of each robot's time, predicted and measured."""
    at = np.arange(len(shown))
    left = np.zeros(len(shown))
    for name, colour in (
        ("moving", BLUE),
        ("working", ORANGE),
        ("standing", GREY),
        ("waiting", PALE),
    ):
        shares = (analysis.flow.shares[r] for r in shown)
        wide = np.array([100 * getattr(s, name) / (s.cycle or 1.0) for s in shares])
        axes.barh(at, wide, 0.7, left, color=colour, label=name)
        left += wide
    if analysis.measured is not None:
        measured = [100 * (analysis.measured.busy[r].measured or 0.0) for r in shown]
        axes.plot(measured, at, "|", ms=11, mew=2, color="black", label="busy in the run")
    _rows(axes, analysis, shown)
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the time [%]")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=5, fontsize=8)


def _gains(axes: Any, analysis: Analysis) -> None:
    """Cycle time saved by changing one robot, for the robots that save most."""
    kinds = (
        ("speed +10 %", "faster", BLUE),
        ("acceleration +10 %", "quicker", LIGHT),
        ("ways −10 %", "shorter", ORANGE),
    )
    worth = [(max(getattr(s, k) for _, k, _ in kinds), s) for s in analysis.sensitivities]
    chosen = [s for w, s in sorted(worth, key=lambda item: -item[0])[:BARS] if w > 0]
    axes.set_title("saved by changing one robot")
    axes.set_xlabel("share of the cycle time [%]")
    axes.grid(axis="y", visible=False)
    if not chosen:
        axes.text(0.5, 0.5, "no robot alone saves time", ha="center", transform=axes.transAxes)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    at = np.arange(len(chosen))
    for place, (words, key, colour) in enumerate(kinds):
        wide = [100 * getattr(s, key) / analysis.net.pace for s in chosen]
        bars = axes.barh(at + 0.26 * (place - 1.0), wide, 0.26, color=colour, label=words)
        axes.bar_label(bars, [f"{w:.1f}" if w >= 0.05 else "" for w in wide], padding=2, fontsize=7)
    axes.set_yticks(at, [s.robot for s in chosen])
    axes.set_ylim(len(chosen) - 0.4, -0.6)
    axes.margins(x=0.1)
    axes.legend(loc="best", fontsize=8)


def _changes(axes: Any, analysis: Analysis) -> None:
    """The cycle time with each of the changes examined."""
    rows = [("as it is", analysis.net.pace), *((s.words, s.pace) for s in analysis.scenarios)]
    paces = [pace for _, pace in rows]
    bars = axes.barh(range(len(rows)), paces, 0.7, color=[GREY] + [LIGHT] * (len(rows) - 1))
    axes.bar_label(bars, [f"{pace:.2f}" for pace in paces], padding=3, fontsize=8)
    for at, (words, _) in enumerate(rows):
        axes.text(0.02 * max(paces), at, _short(words), va="center", fontsize=8)
    axes.set_yticks([])
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.margins(x=0.12)
    axes.grid(axis="y", visible=False)
    axes.set_title("what if")
    axes.set_xlabel("cycle time [s]")


def _short(words: str, most: int = 42) -> str:
    return words if len(words) <= most else f"{words[: most - 1]}…"


def _copies(axes: Any, analysis: Analysis) -> None:
    """The cycle time against the bound on copies of each part."""
    curve, pace = analysis.curve, analysis.curve.points[-1][1]
    at, paces = zip(*curve.points, strict=True)
    axes.plot(at, paces, "-o", color=BLUE, ms=4)
    axes.axhline(pace, color=GREY, linewidth=0.8)
    axes.plot([curve.least], [pace], "o", color=RED, ms=7, label=f"W = {curve.least}: full pace")
    if analysis.wip is not None:
        axes.axvline(analysis.wip, color=ORANGE, linewidth=1.2, label=f"--wip {analysis.wip}")
    axes.set_ylim(0, 1.1 * max(paces))
    axes.set_xlim(0.5, max(at) + 0.5)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("W")
    axes.set_ylabel("cycle time [s]")
    axes.set_title("bound on copies of each part (--wip)")
    axes.legend(loc="lower left", fontsize=8)
