"""Variants by the command line: whatever options make of a product, all commands make the same of
it, and a log tells them without the options."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from tests.apps.relay.test_relay_hands import sawn
from tests.command_line import Terminal
from tests.paths import PAPER
from tests.slow import slow_but

SLOW = """root = c; c = insert(p, b); b = weld(a, dwell = 6); a = insert(q, r);
p = atomic(); q = atomic(); r = atomic()"""
"""A product one of whose operations is slow."""

VARIANTS = {
    "as written": (PAPER.read_text(), ()),
    "fewer robots": (PAPER.read_text(), ("--robots", "least")),
    "branches": (SLOW, ("--parallel", "b=2")),
    "relays": (sawn(4), ("--relay",)),
}
"""A product's text and options."""

OF_RUNS = {"staged": ("--stage",), "little inside": ("--wip", "1")}
"""Options that make no other factory, but other runs of it."""


@pytest.mark.parametrize("name", slow_but(["branches"], [*VARIANTS, *OF_RUNS]))
def test_all_commands_make_the_same_factory(
    name: str, run: Terminal, out: Path, here: None
) -> None:
    text, options = VARIANTS.get(name, VARIANTS["as written"])
    file, log, net, rows = (out / x for x in ("p.pag", "run.log", "net.pnml", "rows.db"))
    file.write_text(text)
    checked = run("check", file, *options, "--json").json
    assert all(checked[claim] for claim in ("live", "safe", "reversible", "legal"))
    robots, more = checked["robots"], (*options, *OF_RUNS.get(name, ()))
    ideal = (*more, "--world", "ideal", "--units", 8)
    done = run("run", file, *ideal, "--seed", 1, "--json").json
    built = run("build", file, *options, "-o", out / "built", "--json").json
    assert robots == done["robots"] == built["robots"]
    swept = run("sweep", file, *ideal, "--vary", "seed=1", "-o", rows, "--json")
    assert (swept.status, swept.json["done"]) == (0, 1), swept.err
    with closing(sqlite3.connect(rows)) as database:
        (row,) = database.execute("SELECT robots, cycle_time_s FROM runs")
    assert row == (robots, done["cycle_time_s"])
    assert done["cycle_time_s"] == pytest.approx(done["predicted_cycle_time_s"], rel=0.03)
    assert run("export", file, *options, "--format", "pnml", "-o", net).status == 0
    assert run("check", net).status == 0
    assert len(run("programs", file, *options, "--json").json["programs"]) == robots
    made = run("run", file, *more, "--units", 2, "--log", log, "--json")
    assert made.status == 0 and made.json["robots"] == robots
    assert run("monitor", log).status == 0
    assert run("report", log, "-o", out / "report.html", "-q").status == 0
    assert run("export", log, "--format", "csv", "-o", out / "log.csv").status == 0
