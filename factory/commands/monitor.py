"""The command `monitor`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from factory.commands.options import OUTPUT, PATH
from factory.commands.requests import OutputOptions
from factory.support.console import emit, say

if TYPE_CHECKING:
    from factory.record.ending import CutOff
    from factory.record.monitor import Report

SHOWN = 8
"""The most violations that are printed, unless `-v` asks for all."""


@click.command()
@click.argument("file", metavar="LOG", type=PATH)
@OUTPUT
def monitor(file: Path, out: OutputOptions) -> int:
    """Judge the run in a LOG that `run --log` has kept against its net, from its states alone.

    The status is 1 for a run that does not follow its net, or was cut off before its units were
    made, and 2 for a LOG that ends before there is anything to judge."""
    from factory.record.log import read_log
    from factory.record.monitor.record import watch_log

    log = read_log(file)
    report, subject = watch_log(log)
    if out.as_json:
        document = {
            "log": str(file),
            "product": subject.factory.pag.root,
            "sim_time_s": round(float(log.time[-1]), 6),
            "complete": log.complete,
            "cut_off": log.cut_off and log.cut_off.as_json(),
            **report.as_json(),
            "monitor_time_s": report.time_s,
        }
        emit(document)
    elif not out.quiet:
        say(verdict(report, log.cut_off))
        for firing in (*report.seen, *report.inferred) if out.verbose else ():
            how = "inferred" if firing.seen is None else "seen"
            span = f"{firing.earliest:.3f} to {firing.latest:.3f} s"
            say(f"  {firing.transition} of unit {firing.unit}: {how}, {span}")
    say_violations(report, len(report.violations) if out.verbose else SHOWN)
    if log.cut_off:
        print(log.cut_off.diagnostic(file), file=sys.stderr)
    return 0 if report.refines_net and not log.cut_off else 1


def verdict(report: Report, cut_off: CutOff | None) -> str:
    """What a monitor found, in a line for people."""
    counts = f"{len(report.seen)} firings seen, {len(report.inferred)} inferred"
    judged = f"{len(report.violations)} VIOLATIONS"
    if report.refines_net:
        judged = f"they explain the run{' as far as it goes' if cut_off else ''}"
    return f"monitor: {counts}; {judged}" + (f", {cut_off}" if cut_off else "")


def say_violations(report: Report | None, shown: int = SHOWN) -> None:
    """The first violations, on stderr."""
    for violation in report.violations[:shown] if report else ():
        print(violation.diagnostic(), file=sys.stderr)
