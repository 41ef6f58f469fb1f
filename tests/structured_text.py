"""An executor of the Structured Text that is exported, for tests: its blocks as Python functions.

It knows the statements that are written and no others, one a line: an unknown one is an error.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

PATTERNS = (
    (r"IF (.*) THEN", "if {0}:"),
    (r"ELSE", "else:"),
    (r"(\d+): *(?:\(\*.*\*\))?", "if state == {0}:"),
    (r"Dwell\(IN := (.*), PT := T#(\d+)ms\);", "my.Dwell.call({0}, {1} / 1000)"),
    (r"([\w.\[\]]+) := (.*);", "{0} = {1}"),
)
SKIPPED = ("CASE State OF", "END_CASE;", "END_IF;", "")
OWN = ("State", "Unit", "Reached", "Dwell", "Ready")


@dataclass(slots=True)
class Timer:
    """TON of the standard: Q once IN has been true for PT."""

    clock: list[float]
    since: float | None = None
    Q: bool = False

    def call(self, on: bool, wait: float) -> None:
        if not on:
            self.since, self.Q = None, False
            return
        if self.since is None:
            self.since = self.clock[0]
        self.Q = self.clock[0] - self.since >= wait - 1e-9


@dataclass
class Controller:
    """The blocks of a text with their memories; `scan` runs each once, in the order given."""

    text: str
    clock: list[float] = field(default_factory=lambda: [0.0])

    def __post_init__(self) -> None:
        (labels,) = re.findall(r"LABEL : \((.*)\);", self.text)
        self.labels = labels.split(", ")
        (robots,) = set(re.findall(r"Cells : ARRAY \[1\.\.(\d+)\]", self.text))
        (axes,) = set(re.findall(r"Axes : ARRAY \[1\.\.(\d+)\]", self.text))
        self.cells = [SimpleNamespace(Carries="NOPART", Finished=0) for _ in range(int(robots))]
        self.axes = [SimpleNamespace(Position=0.0, Speed=0.0, Target=0.0) for _ in range(int(axes))]
        found = re.findall(r"FUNCTION_BLOCK (\w+)\n(.*?)END_FUNCTION_BLOCK", self.text, re.S)
        self.blocks = [self._function(body.rpartition("END_VAR\n")[2]) for _, body in found]
        self.memories = [
            SimpleNamespace(State=0, Unit=0, Reached=False, Ready=True, Dwell=Timer(self.clock))
            for _ in found
        ]

        self.scope: dict[str, Any] = {label: label for label in self.labels}
        self.scope |= {"Cells": [None, *self.cells], "Axes": [None, *self.axes], "ABS": abs}

    def scan(self, robot: int) -> None:
        """One call of a robot's block."""
        self.scope["my"] = self.memories[robot]
        exec(self.blocks[robot], self.scope)

    def _function(self, body: str) -> Any:
        lines = ["state = my.State"]
        for line in body.splitlines():
            if line.strip() in SKIPPED:
                continue
            indent = " " * (len(line) - len(line.lstrip()) - 4)
            lines.append(indent + self._statement(line.strip()))
        return compile("\n".join(lines), "<st>", "exec")

    def _statement(self, line: str) -> str:
        for pattern, python in PATTERNS:
            match = re.fullmatch(pattern, line)
            if match:
                return python.format(*(_expression(group) for group in match.groups()))
        raise AssertionError(f"no statement that is known: {line}")


def _expression(text: str) -> str:
    """An expression, or a place, in Python."""
    text = re.sub(r"(?<![<>:])=", "==", text)
    for word, python in (("AND", "and"), ("OR", "or"), ("NOT", "not")):
        text = re.sub(rf"\b{word}\b", python, text)
    for word, python in (("TRUE", "True"), ("FALSE", "False")):
        text = re.sub(rf"\b{word}\b", python, text)
    return re.sub(rf"(?<!\.)\b({'|'.join(OWN)})\b", r"my.\1", text)
