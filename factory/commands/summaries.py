"""What is printed of a run: its figures and verdict, what failed in it, what a monitor found."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from factory.support.console import say, table

if TYPE_CHECKING:
    from factory.apps.monitor import Report
    from factory.engine.record.ending import CutOff
    from factory.engine.record.failures import Failures
    from factory.engine.record.verdict import RunVerdict
    from factory.engine.simulation.run import Run
    from factory.theory.plant.factory import Factory


def summarise(record: Run, factory: Factory, verbose: bool) -> None:
    """Print a run in a few lines; the first line of a failed run says why."""
    from factory.engine.simulation.figures import figures

    if not record.succeeded:
        say_verdict(record.verdict, verbose)
    for line in figures(record, verbose):
        say(line)
    if record.failures is not None:
        say_failures(record.failures, verbose)
    if record.monitor is not None:
        say(found_by(record.monitor, record.cut_off))
    if record.succeeded:
        say_verdict(record.verdict, verbose)
    busy = sorted(zip(factory.robots, record.utilisation, strict=True), key=lambda p: -p[1])
    rows = [(r.name, r.type, f"{100 * u:.0f} %") for r, u in (busy if verbose else busy[:6])]
    table("Utilisation", ("robot", "type", "busy"), rows)
    if more := len(busy) - len(rows):
        say(f"... and {more} more robot{'s' if more > 1 else ''} (-v shows all)")


def say_verdict(verdict: RunVerdict, verbose: bool = False) -> None:
    """Whether a run succeeded and what of its verdict failed, the cause first and, unless it is
    `verbose`, a line for each code."""
    failures = verdict.failures if verbose else verdict.gathered
    lines = [f"{failure.code}: {failure.message}" for failure in failures]
    doubts = "; ".join(verdict.qualified)
    if verdict.succeeded:
        words = f"the run succeeded, but {doubts}" if doubts else "the run succeeded"
        say(words + (f"{'; ' if doubts else ', as '}--lenient leaves this out:" if lines else ""))
    elif verdict.judged:
        say(f"the run FAILED: {lines.pop(0)}")
    else:
        say(f"the run was NOT JUDGED: {lines.pop(0)}")
    for line in lines:
        say(f"  {line}")
    if doubts and not verdict.succeeded and not verdict.strict:
        say(f"  and {doubts}")


def found_by(report: Report, cut_off: CutOff | None) -> str:
    """The findings of a monitor, in one line."""
    counts = f"{len(report.seen)} firings observed, {len(report.inferred)} inferred"
    judged = f"{len(report.violations)} VIOLATIONS"
    if report.refines_net:
        judged = f"consistent with the net{' up to its end' if cut_off else ''}"
    if report.calm_s is not None:
        judged += f" in the {report.calm_s:.1f} s without failure or recovery"
    return f"monitor: {counts}; {judged}" + (f", {cut_off}" if cut_off else "")


def say_failures(failures: Failures, verbose: bool) -> None:
    """What went wrong in a run, in a few lines."""
    struck = ", ".join(f"{count} {kind}" for kind, count in failures.struck.items() if count)
    missed, alarms = failures.missed, failures.false_alarms
    say(f"faults: {struck or 'none'}; {missed} missed, {alarms} false alarms")
    say(
        f"{len(failures.found)} failures, {failures.undone} transitions undone,"
        f" {failures.scrapped} scrapped, {failures.spares} spares used,"
        f" {failures.contacts} contacts with fallen or misplaced parts"
    )
    if failures.binned or failures.spilled:
        spilled = ", ".join(failures.spilled)
        none = f"; no bin for the scrap of {spilled}" if spilled else ""
        say(f"scrap in bins: {failures.binned}{none}")
    for one in failures.found if verbose else ():
        say(f"  {one.t:.2f} s: {one}")


def tell_failures(verdict: RunVerdict, verbose: bool) -> None:
    """What of a verdict failed, with where it comes from, on stderr."""
    for failure in verdict.failures if verbose else verdict.gathered:
        print(failure, file=sys.stderr)
