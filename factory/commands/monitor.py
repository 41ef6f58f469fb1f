"""The command `monitor`."""

from __future__ import annotations

from pathlib import Path

import click

from factory.commands.options import OUTPUT, PATH
from factory.support.console import emit, say


@click.command()
@click.argument("file", metavar="LOG", type=PATH)
@OUTPUT
def monitor(file: Path, as_json: bool, quiet: bool, verbose: bool) -> int:
    """Judge the run in a LOG that `run --log` has kept against its net, from its states alone."""
    from factory.commands.run_factory import say_violations, verdict
    from factory.record.log import read_log
    from factory.record.monitor.record import watch_log

    log = read_log(file)
    report, subject = watch_log(log)
    if as_json:
        document = {
            "log": str(file),
            "product": subject.factory.pag.root,
            "sim_time_s": round(float(log.time[-1]), 6),
            "complete": log.complete,
            **report.as_json(),
            "monitor_time_s": report.time_s,
        }
        emit(document)
    elif not quiet:
        say(verdict(report))
        for firing in (*report.seen, *report.inferred) if verbose else ():
            how = "inferred" if firing.seen is None else "seen"
            span = f"{firing.earliest:.3f} to {firing.latest:.3f} s"
            say(f"  {firing.transition} of unit {firing.unit}: {how}, {span}")
    say_violations(report, len(report.violations) if verbose else 8)
    return 0 if report.refines_net else 1
