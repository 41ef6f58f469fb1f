"""The pace of any timed marked graph, such as a net in PNML, with a table of delays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from factory.nets.cycle_ratio import max_cycle_ratio
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet, marked
from factory.study.analysis.slack import Slack, circuits, slacks
from factory.study.analysis.tables import SHOWN, PrintedTable, cut
from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.settings import LONGEST
from factory.support.user_defaults import key_position, read_toml

MOST = 1_000
"""Number of places whose slack is computed; of larger nets, those on the critical circuit."""


@dataclass(frozen=True)
class NetAnalysis:
    """The cycle time `pace` of a net [s]; its `circuits`, the tightest through each place with a
    time, the critical ones first; the `slack` of each of these places."""

    net: MarkedNet
    seconds: tuple[float, ...]
    pace: float
    circuits: tuple[Slack, ...]
    slack: dict[int, Slack]


def analyse_net(net: GearNet | MarkedNet, delays: dict[str, float], name: str) -> NetAnalysis:
    """Analyse a net. Raises InputError (BadNet) where it has no cycle time."""
    subject = marked(net)
    index = subject.net.place_index
    seconds = [0.0] * len(subject.tokens)
    for place, delay in delays.items():
        seconds[index[place]] = delay
    try:
        ratio = max_cycle_ratio(subject, seconds)
    except ValueError as error:
        hint = "run `factory check` on it for the reason"
        raise InputError(Diagnostic("BadNet", f"{name}: {error}", None, hint)) from error
    timed = [p for p, delay in enumerate(seconds) if delay > 0]
    chosen = timed if len(timed) <= MOST else [p for p in ratio.circuit if seconds[p] > 0]
    critical = [*ratio.circuit[:1], *chosen]
    return NetAnalysis(
        subject,
        tuple(seconds),
        ratio.seconds,
        circuits(ratio, critical),
        slacks(ratio, chosen),
    )


def net_document(name: str, analysis: NetAnalysis) -> dict[str, object]:
    """The keys of `analyze --json` for a net."""
    places = analysis.net.net.places
    return {
        "net": name,
        "cycle_time_s": analysis.pace,
        "circuits": _circuits(analysis),
        "slack_s": {places[p].name: slack.seconds for p, slack in analysis.slack.items()},
    }


def _circuits(analysis: NetAnalysis) -> list[dict[str, Any]]:
    places = analysis.net.net.places
    return [
        {
            "seconds": sum(analysis.seconds[p] for p in c.circuit),
            "tokens": sum(analysis.net.tokens[p] for p in c.circuit),
            "slack_s": c.seconds,
            "places": [places[p].name for p in c.circuit],
        }
        for c in analysis.circuits
    ]


def net_tables(analysis: NetAnalysis, verbose: bool) -> Iterator[PrintedTable]:
    """The tables of circuits and of places with little slack."""
    places, most = analysis.net.net.places, None if verbose else SHOWN
    heads = ("slack [s]", "time [s]", "tokens", "places")
    rows = [
        (f"{c['slack_s']:.6g}", f"{c['seconds']:.6g}", str(c["tokens"]), " · ".join(c["places"]))
        for c in _circuits(analysis)
    ]
    yield cut("Circuits, the critical first", heads, rows, most)
    ordered = sorted(analysis.slack.items(), key=lambda item: item[1].seconds)
    slack = [(places[p].name, f"{analysis.seconds[p]:.6g}", f"{s.seconds:.6g}") for p, s in ordered]
    yield cut("Places", ("place", "time [s]", "slack [s]"), slack, most)


def read_delays(path: Path, net: GearNet | MarkedNet) -> dict[str, float]:
    """A table of delays in TOML: `place = seconds`, the name in quotes where it has other
    characters than letters, digits, - and _.

    Raises InputError with every fault: broken TOML, an unknown place, a value that is not a time.
    """
    text, table = read_toml(path, 'write lines as "p1" = 0.5')
    index = marked(net).net.place_index
    faults = []
    for name, value in table.items():
        where = key_position(path, text, name)
        if name not in index:
            hint = did_you_mean(name, list(index), "places")
            faults.append(Diagnostic("BadValue", f"the net has no place '{name}'", where, hint))
        elif isinstance(value, bool) or not isinstance(value, int | float):
            faults.append(Diagnostic("BadValue", f"{name} must be a number", where, EXAMPLE))
        elif not 0 <= value <= LONGEST:
            message = f"{name} = {value!s:.20} is not between 0 and {LONGEST:g} s"
            faults.append(Diagnostic("BadValue", message, where, EXAMPLE))
    if faults:
        raise InputError(faults)
    return {name: float(value) for name, value in table.items()}


EXAMPLE = 'seconds, for example "p1" = 0.5'
