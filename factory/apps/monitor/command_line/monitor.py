"""The command `monitor`."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import click

from factory.commands.options import LENIENT, OUTPUT, PATH, STRICT
from factory.commands.requests import OutputOptions
from factory.commands.summaries import found_by, say_failures, say_verdict, tell_failures
from factory.support.console import emit, say


@click.command()
@click.argument("file", metavar="LOG", type=PATH)
@LENIENT
@STRICT
@OUTPUT
def monitor(file: Path, lenient: bool, strict: bool, out: OutputOptions) -> int:
    """Judge the run in a LOG against its net, from its states.

    `run --log` writes a LOG. Where something failed, it is judged from the states between failures,
    and from what fired and was undone.

    The status is 1 for a run that does not follow its net, in which bodies did otherwise than the
    net says, or that was cut off before its units were made, for a LOG that is not that of its PAG
    or was kept with other versions, whose states are not judged, and 2 for a LOG that ends before
    there is anything to judge."""
    from factory.apps.log import read_log
    from factory.apps.monitor.record import recorded_subject, verdict_on, watch_log
    from factory.apps.resume.remade import forged, model_faults

    log = read_log(file)
    of = recorded_subject(log.header).factory
    faults, why = model_faults(log, file.parent)
    report = None if forged(faults) else watch_log(log)[0]
    verdict = replace(verdict_on(log, of, report, faults), lenient=lenient, strict=strict)
    if out.as_json:
        watched = {} if report is None else report.as_json()
        document = {
            "log": str(file),
            "product": of.pag.root,
            "sim_time_s": round(float(log.time[-1]), 6),
            "complete": log.complete,
            "cut_off": log.cut_off and log.cut_off.as_json(),
            "judged": report is not None,
            **watched,
            "refines_net": verdict.refines and report is not None and report.refines_net,
            "monitor_time_s": report.time_s if report else None,
            "model_compared": not why,
            "verdict": verdict.as_json(),
            "qualified": [*verdict.qualified],
            **({} if log.failures is None else {"failures": log.failures.as_json()}),
        }
        emit(document)
    else:
        if not verdict.succeeded:
            say_verdict(verdict, out.verbose)
        if report is not None:
            say(found_by(report, log.cut_off))
        if why and report is not None:
            say(f"its model was not compared with that of its PAG: {why}")
        if log.failures is not None:
            say_failures(log.failures, out.verbose)
        if verdict.succeeded:
            say_verdict(verdict, out.verbose)
        for firing in (*report.seen, *report.inferred) if out.verbose and report else ():
            how = "inferred" if firing.seen is None else "seen"
            span = f"{firing.earliest:.3f} to {firing.latest:.3f} s"
            say(f"  {firing.transition} of unit {firing.unit}: {how}, {span}")
    tell_failures(verdict, out.verbose)
    if log.cut_off:
        print(log.cut_off.diagnostic(file), file=sys.stderr)
    return 0 if verdict.succeeded else 1
