"""What is printed of a run's verdict, of what failed in it, and of what a monitor found."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from factory.support.console import say

if TYPE_CHECKING:
    from factory.apps.monitor import Report
    from factory.engine.record.ending import CutOff
    from factory.engine.record.failures import Failures
    from factory.engine.record.verdict import RunVerdict


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
