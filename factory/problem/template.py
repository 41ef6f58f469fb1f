"""Operation templates O = (R, j, ~, <a; b>, F): Definition 4.1, as values.

The text of a template is read by `factory.lang.read_template`; the shipped ones lie in
`templates/`, one file each.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.problem.pag import NOPART, Value
from factory.support.errors import Position


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


@dataclass(frozen=True, slots=True)
class Template:
    """An operation template (Definition 4.1).

    `robots` R: the type of each robot; `carrier` j, from 1; `identifications` ~: classes of points
    that are one; `before` a and `after` b: the label each robot carries, NOPART or a variable such
    as LAB1; `law` F; `further`: the template that takes inputs beyond those in a, "" if none does;
    `instead`: the one that does the same with one robot fewer, where the robot of one input keeps
    what is joined, "" if none does;
    `parameters`: keyword arguments and their defaults; `geometry`: True where the operation makes a
    part and takes mesh, pos, box and so on.
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
    position: Position | None = field(default=None, compare=False)
    further_position: Position | None = field(default=None, compare=False)
    instead_position: Position | None = field(default=None, compare=False)
    robot_positions: tuple[Position, ...] = field(default=(), compare=False)

    @property
    def inputs(self) -> tuple[str, ...]:
        """The sub-assemblies: the distinct label variables of a, in the order of the robots."""
        return tuple(dict.fromkeys(label for label in self.before if label != NOPART))

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

    def tools(self) -> tuple[int, ...]:
        """Indices (from 0) of the robots that bring nothing and are not the carrier."""
        return tuple(
            i for i, label in enumerate(self.before) if label == NOPART and i != self.carrier - 1
        )


def variable_number(variable: str) -> tuple[int, str]:
    """The sort key of a label variable: its number, so that `LAB10` comes after `LAB2`."""
    digits = "".join(c for c in variable if c.isdigit())
    return int(digits or 0), variable
