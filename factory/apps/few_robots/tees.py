"""Tees by the labels that two robots bring, and why two robots cannot share a stem."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from factory.api import Catalogue, Diagnostic, Factory, InputError, Plan
from factory.apps.few_robots.folding import Line, line_faults, lines_of_labels

ROOM = 2
"""Robots that share a stem."""

HINT = "a tee has two labels that come to one carrier, from one side, by one kind of robot"


def with_tees(factory: Factory, stems: Sequence[Sequence[str]], catalogue: Catalogue) -> Plan:
    """The plan in which the two robots that bring the labels of each of `stems` share one. Raises
    InputError (BadTee) with every reason why they cannot."""
    lines = lines_of_labels(factory, stems)
    faults = [f for both in zip(lines, stems, strict=True) for f in _faults(factory, *both)]
    for line in lines if not faults else ():
        for fault in line_faults(factory, line, lines, catalogue):
            message = fault.message.replace("share a robot", "share a stem")
            faults.append(replace(fault, code="BadTee", message=message, hint=HINT))
    if faults:
        raise InputError(faults)
    return replace(factory.plan, tees=tuple((line[0], line[1]) for line in lines))


def _faults(factory: Factory, line: Line, labels: Sequence[str]) -> Iterator[Diagnostic]:
    """Why the robots of two labels cannot share a stem, whatever else."""
    names = " and ".join(f"'{label}'" for label in labels)
    if len(line) != ROOM or len(labels) != ROOM:
        message = f"{names}: a stem has room for {ROOM} robots, each with a label of its own"
        yield Diagnostic("BadTee", message, None, HINT)
        return
    ends = [factory.last(robot) for robot in line]
    if ends[0] is ends[1]:
        message = f"{names} are both needed in '{ends[0].label}'"
        message += ": one stem has room for one at its end"
        hint = "let them be brought to different operations of one carrier"
        yield Diagnostic("BadTee", message, ends[0].position, hint)
    if factory.period > 1:
        message = f"{names} are brought by several robots in turn"
        yield Diagnostic("BadTee", message, ends[0].position, "leave out --parallel, or the tee")
