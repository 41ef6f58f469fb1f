"""Operation templates O = (R, j, ~, <a; b>, F): Definition 4.1, as values.

The text of a template is read by `factory.theory.lang.read_template`; the shipped ones lie in
`templates/`, one file each.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from math import inf
from typing import Literal

from factory.support.errors import Position
from factory.support.settings import DWELL
from factory.theory.problem.pag import NOPART, Value
from factory.theory.problem.parameters import WRITTEN, ParameterKind


@dataclass(frozen=True, slots=True)
class Point:
    """A point of robot i's guidepath [A_i, B_i]: `end` + `multiple` * r_i, e.g. A1 + 2r.

    `robot` counts from 1 as in the paper; `end` is A, B or S, an interior station.
    """

    end: str
    robot: int
    multiple: float = 0.0
    position: Position | None = field(default=None, compare=False)

    def __str__(self) -> str:
        """The point as the language writes it: `A1`, `A1 + 2r`."""
        if not self.multiple:
            return f"{self.end}{self.robot}"
        size = "" if abs(self.multiple) == 1 else repr(abs(float(self.multiple))).removesuffix(".0")
        return f"{self.end}{self.robot} {'+' if self.multiple > 0 else '-'} {size}r"


@dataclass(frozen=True, slots=True)
class Law:
    """F: the name of a control law, its goal point for each robot, the goal ball's radius eps
    (a number [m], or the word `eps` for the factory's own) and a dwell: a number of seconds or
    the name of a parameter, None without one."""

    name: str
    goals: tuple[Point, ...]
    eps: float | str = "eps"
    dwell: float | str | None = None
    position: Position | None = field(default=None, compare=False)


Test = Literal["lost", "residual", "misplaced", "rejected", "jammed"]
"""What is tested: a part is further than 5 mm from its nest, or no grip holds it; the joint's error
[m] when the goal is reached, before X_e fires; a part's error at its feeder [m]; a tool says that
it is bad; a robot makes no progress for longer than the timed net allows."""

Kind = Literal["again", "scrap", "stop"]


@dataclass(frozen=True, slots=True)
class Response:
    """What is done about a failure: the operation `again`, at most `times` times on end (0 for the
    others); `scrap`, what was to be joined goes to the bin and is made anew; `stop`, the run."""

    kind: Kind
    times: int = 0

    def __str__(self) -> str:
        """The response as the language writes it: `again 2`, `scrap`."""
        return f"{self.kind} {self.times}" if self.times else self.kind


@dataclass(frozen=True, slots=True)
class Failure:
    """A test with its `limit` [m], None for those without one, and the responses, in order: at most
    one `again`, then a `scrap` or a `stop`."""

    test: Test
    limit: float | None
    responses: tuple[Response, ...]
    position: Position | None = field(default=None, compare=False)

    @property
    def last(self) -> Kind:
        """What is done when doing it again has not helped: `scrap` or `stop`."""
        return self.responses[-1].kind

    def as_json(self) -> dict[str, object]:
        """The failure as `templates --json` and `check --json` list it."""
        responses = [str(response) for response in self.responses]
        return {"test": self.test, "limit": self.limit, "responses": responses}


LOST = (Failure("lost", None, (Response("scrap"),)),)
"""The failures of a template that says nothing of them."""


@dataclass(frozen=True, slots=True)
class Signature:
    """What an operation takes.

    Attributes:
        name: its name.
        inputs: the least number of its inputs.
        further: whether it takes more.
        parameters: the kinds of its parameters, by name.
    """

    name: str
    inputs: int
    further: bool
    parameters: Mapping[str, ParameterKind]

    @property
    def takes(self) -> str:
        """The number of inputs in words."""
        if not self.inputs and not self.further:
            return "no sub-assembly"
        number = ("no", "one", "two", "three", "four", "five")[self.inputs : self.inputs + 1]
        words = (number[0] if number else str(self.inputs)) + " or more" * self.further
        return f"{words} sub-assembl{'y' if words == 'one' else 'ies'}"


@dataclass(frozen=True, slots=True)
class Template:
    """An operation template (Definition 4.1).

    Attributes:
        name: as a PAG uses it.
        robots: R, the type of each robot.
        carrier: j, the robot that carries the result, from 1.
        identifications: ~, classes of points that are one.
        before: a, the label that each robot carries before: NOPART, or a variable such as LAB1.
        after: b, the label that each robot carries after.
        law: F, the control law.
        further: template that takes inputs beyond those in a; "" for none.
        instead: template that does the same with one robot fewer, where the robot of one input
            keeps what is joined; "" for none.
        parameters: keyword arguments and their defaults.
        geometry: whether the operation makes a part, and takes mesh, pos, box and so on.
        failures: what is tested, and the response to each failure.
        position: its place in the text; not compared.
        further_position: place of `further`.
        instead_position: place of `instead`.
        robot_positions: places of the robots.
        brought: template by which a robot first hands over what one that is not the carrier brings;
            "" for none.
        brought_position: place of `brought`.
    """

    name: str
    robots: tuple[str, ...]
    carrier: int
    identifications: tuple[tuple[Point, ...], ...]
    before: tuple[str, ...]
    after: tuple[str, ...]
    law: Law
    further: str = ""
    instead: str = ""
    parameters: tuple[tuple[str, Value], ...] = ()
    geometry: bool = False
    failures: tuple[Failure, ...] = LOST
    position: Position | None = field(default=None, compare=False)
    further_position: Position | None = field(default=None, compare=False)
    instead_position: Position | None = field(default=None, compare=False)
    robot_positions: tuple[Position, ...] = field(default=(), compare=False)
    brought: str = ""
    brought_position: Position | None = field(default=None, compare=False)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The sub-assemblies: the label variables of a, in the order in which they are written."""
        return _variables(self.before)

    @property
    def signature(self) -> Signature:
        """What it takes. A duration has a greatest value."""
        kinds = dict(WRITTEN) if self.geometry else {}
        for name, default in self.parameters:
            kinds[name] = ParameterKind.of(default, DWELL if name == self.law.dwell else inf)
        return Signature(self.name, len(self.inputs), bool(self.further), kinds)

    @property
    def held(self) -> str:
        """The label variable that the carrier brings, NOPART for none."""
        return self.before[self.carrier - 1]

    def robot_position(self, slot: int) -> Position | None:
        """The place of a robot's type; else that of the template."""
        return self.robot_positions[slot] if self.robot_positions else self.position

    @property
    def law_position(self) -> Position | None:
        """The place of F; else that of the template."""
        return self.law.position or self.position

    @property
    def result(self) -> str:
        """b_j, the label the carrier holds afterwards; NOPART for dropoff."""
        return self.after[self.carrier - 1]

    def failure(self, test: str) -> Failure | None:
        """What is done where a test finds a failure; None where it is not tested."""
        return next((failure for failure in self.failures if failure.test == test), None)

    def tools(self) -> tuple[int, ...]:
        """Indices (from 0) of the robots that bring nothing and are not the carrier."""
        return tuple(
            i for i, label in enumerate(self.before) if label == NOPART and i != self.carrier - 1
        )


@cache
def _variables(before: tuple[str, ...]) -> tuple[str, ...]:
    """The distinct label variables of a template's a, by number: `LAB10` comes after `LAB2`."""

    def number(variable: str) -> tuple[int, str]:
        return int("".join(c for c in variable if c.isdigit()) or 0), variable

    return tuple(sorted({*before} - {NOPART}, key=number))
