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
"""At most so many robots are drawn, the busiest."""

BARS = 8
"""At most so many robots have bars of what a change of them alone saves."""

CYCLES = 2.2
"""So many cycles of the schedule are drawn."""

STYLE = {**plotting.STYLE, "svg.hashsalt": "factory", "svg.fonttype": "none"}


def check_picture(path: Path | None) -> None:
    """Whether a picture can be made, before anything is computed. Raises InputError (BadFile) for
    an ending that is not known, MissingError where there is no matplotlib."""
    if path is None:
        return
    if path.suffix.lower() not in FORMATS:
        message = f"'{path}' is no name for a picture"
        raise InputError(Diagnostic("BadFile", message, None, "let it end in .svg or .png"))
    plotting.require_matplotlib("a picture", "leave out -o")


def picture(found: Analysis, suffix: str) -> bytes:
    """The picture as a file of a kind, .svg or .png; the same bytes for the same analysis."""
    check_picture(Path(f"x{suffix}"))
    import matplotlib
    from matplotlib.figure import Figure

    shown = _shown(found)
    with matplotlib.rc_context(STYLE):
        high = 1.2 + 0.24 * len(shown)
        figure = Figure(figsize=(13.0, 1.0 + high + 3.2), layout="constrained")
        grid = figure.add_gridspec(2, 6, height_ratios=[high, 3.2])
        _schedule(figure.add_subplot(grid[0, :3]), found, shown)
        _time(figure.add_subplot(grid[0, 3:]), found, shown)
        _gains(figure.add_subplot(grid[1, :2]), found)
        _changes(figure.add_subplot(grid[1, 2:4]), found)
        _copies(figure.add_subplot(grid[1, 4:]), found)
        figure.suptitle(_title(found), x=0.01, ha="left", fontsize=12)
        stream = BytesIO()
        kind = suffix.lower().removeprefix(".")
        metadata = {"Date": None} if kind == "svg" else {"Software": None}
        figure.savefig(stream, format=kind, dpi=110, metadata=metadata)
    return stream.getvalue()


def _title(found: Analysis) -> str:
    names = listed(list(found.bottlenecks), 4)
    return (
        f"{found.timing.factory.pag.root}: cycle time {found.net.pace:.3f} s, "
        f"set by {names} ({found.timing.world})"
    )


def _shown(found: Analysis) -> list[int]:
    """The robots that are drawn, in their order."""
    shares = found.flow.shares
    busiest = sorted(range(len(shares)), key=lambda robot: -shares[robot].busy)
    return sorted(busiest[:ROWS])


def _rows(axes: Any, found: Analysis, shown: list[int]) -> None:
    axes.set_yticks(range(len(shown)), [found.flow.shares[r].robot for r in shown])
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.grid(axis="y", visible=False)


def _schedule(axes: Any, found: Analysis, shown: list[int]) -> None:
    """What each robot does over two cycles in the long run; critical operations stand out."""
    operations = found.timing.factory.operations
    critical = {p for circuit in found.net.critical for p in circuit.places}
    length = CYCLES * found.net.pace * found.net.units
    begin = _begin(found, length)
    for row, robot in enumerate(shown):
        for number, start, end in _bars(found, robot, begin, length):
            left, right = max(start, 0.0), min(end, length)
            colour = RED if number in critical else LIGHT
            axes.barh(row, right - left, 0.7, left, color=colour, edgecolor="white", linewidth=0.6)
            dwell = found.timing.modes[number].dwell
            rest = found.timing.rest
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
        axes.axvline(cycle * found.net.pace, color=GREY, linewidth=0.8, linestyle=":")
    _rows(axes, found, shown)
    axes.set_xlim(0, length)
    axes.set_xlabel("time [s]")
    axes.set_title("in the long run; red: critical, hatched: dwell, dotted: a cycle")


def _begin(found: Analysis, length: float) -> float:
    """A moment [s] at which an operation of the critical circuit begins and after which all firings
    are known for `length` [s]."""
    dates, net = found.flow.firings.dates, found.net
    last = float(dates[-1].min()) - length
    count = len(found.timing.factory.operations)
    place = next((p for p in net.critical[0].places if p < count), count - 1)
    starts = dates[:, 2 * place]
    return float(starts[max(0, int(np.searchsorted(starts, last, "right")) - 1)])


def _bars(
    found: Analysis, robot: int, begin: float, length: float
) -> Iterator[tuple[int, float, float]]:
    """Operations of a robot, their starts and ends [s] after `begin`, that fall within."""
    dates, seconds = found.flow.firings.dates, found.net.seconds
    for number in found.timing.factory.robots[robot].operations:
        starts = dates[:, 2 * number] - begin
        within = (starts < length) & (starts + seconds[number] > 0)
        for start in starts[within].tolist():
            yield number, start, start + seconds[number]


def _time(axes: Any, found: Analysis, shown: list[int]) -> None:
    """Where the time of each robot goes, and what was measured."""
    at = np.arange(len(shown))
    left = np.zeros(len(shown))
    for name, colour in (
        ("moving", BLUE),
        ("working", ORANGE),
        ("standing", GREY),
        ("waiting", PALE),
    ):
        shares = (found.flow.shares[r] for r in shown)
        wide = np.array([100 * getattr(s, name) / (s.cycle or 1.0) for s in shares])
        axes.barh(at, wide, 0.7, left, color=colour, label=name)
        left += wide
    if found.measured is not None:
        seen = [100 * (found.measured.busy[r].measured or 0.0) for r in shown]
        axes.plot(seen, at, "|", ms=11, mew=2, color="black", label="busy in the run")
    _rows(axes, found, shown)
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the time [%]")
    axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=5, fontsize=8)


def _gains(axes: Any, found: Analysis) -> None:
    """What a change of one robot alone saves, for the robots that save most."""
    kinds = (
        ("speed +10 %", "faster", BLUE),
        ("acceleration +10 %", "quicker", LIGHT),
        ("ways −10 %", "shorter", ORANGE),
    )
    worth = [(max(getattr(s, k) for _, k, _ in kinds), s) for s in found.sensitivities]
    chosen = [s for w, s in sorted(worth, key=lambda item: -item[0])[:BARS] if w > 0]
    axes.set_title("what one robot alone saves")
    axes.set_xlabel("share of the cycle time [%]")
    axes.grid(axis="y", visible=False)
    if not chosen:
        axes.text(0.5, 0.5, "no robot alone saves time", ha="center", transform=axes.transAxes)
        axes.set_xticks([])
        axes.set_yticks([])
        return
    at = np.arange(len(chosen))
    for place, (words, key, colour) in enumerate(kinds):
        wide = [100 * getattr(s, key) / found.net.pace for s in chosen]
        bars = axes.barh(at + 0.26 * (place - 1.0), wide, 0.26, color=colour, label=words)
        axes.bar_label(bars, [f"{w:.1f}" if w >= 0.05 else "" for w in wide], padding=2, fontsize=7)
    axes.set_yticks(at, [s.robot for s in chosen])
    axes.set_ylim(len(chosen) - 0.4, -0.6)
    axes.margins(x=0.1)
    axes.legend(loc="best", fontsize=8)


def _changes(axes: Any, found: Analysis) -> None:
    """The cycle time with each of the changes examined."""
    rows = [("as it is", found.net.pace), *((s.words, s.pace) for s in found.scenarios)]
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


def _copies(axes: Any, found: Analysis) -> None:
    """The cycle time against the bound on copies of each part."""
    curve, pace = found.curve, found.curve.points[-1][1]
    at, paces = zip(*curve.points, strict=True)
    axes.plot(at, paces, "-o", color=BLUE, ms=4)
    axes.axhline(pace, color=GREY, linewidth=0.8)
    axes.plot([curve.least], [pace], "o", color=RED, ms=7, label=f"W = {curve.least}: full pace")
    if found.wip is not None:
        axes.axvline(found.wip, color=ORANGE, linewidth=1.2, label=f"--wip {found.wip}")
    axes.set_ylim(0, 1.1 * max(paces))
    axes.set_xlim(0.5, max(at) + 0.5)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("W")
    axes.set_ylabel("cycle time [s]")
    axes.set_title("copies of each part let in at once (--wip)")
    axes.legend(loc="lower left", fontsize=8)
