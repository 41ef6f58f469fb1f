"""The table of control laws, by the name a template gives its F.

A law is a function from a template and the guidepaths of one operation's robots to a `Mode`. To add
one: write the function, and a line in `LAWS`, or name it by an entry point of `factory.laws` in a
package of your own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from types import MappingProxyType

import numpy as np

from factory.support.arrays import Array, Index
from factory.support.errors import Diagnostic, InputError, did_you_mean
from factory.support.extensions import bad_extension, blaming, extensions, position_of
from factory.theory.control.mode import Mode, lock
from factory.theory.problem.template import Point, Template


@dataclass(frozen=True, slots=True, eq=False)
class Setting:
    """The place of an operation: the guidepaths of its k robots, in the template's order.

    Attributes:
        lower: A, the lower end of each guidepath [m] (k,).
        upper: B, the upper end [m] (k,).
        r: the length that multiples in the template's points count [m] (k,).
        eps: the factory's own radius of a goal ball, used where the template says so [m].
        station: S, the interior station of each guidepath [m] (k,); NaN for none.
        width: width of each robot [m] (k,). Two robots touch at the mean of theirs.
        dwell: as in `Mode` [s].
        gate: as in `Mode` (k,).
        standoff: as in `Mode` [m] (k,).
    """

    lower: Array
    upper: Array
    r: Array
    eps: float
    station: Array
    width: Array
    dwell: float
    gate: Index
    standoff: Array

    def __post_init__(self) -> None:
        for name in ("lower", "upper", "r", "station", "width", "standoff"):
            object.__setattr__(self, name, lock(getattr(self, name)))
        object.__setattr__(self, "gate", lock(self.gate, np.intp))

    def coordinate(self, point: Point) -> float:
        """The arc length [m] of a template's point on its robot's guidepath.

        Raises InputError (BadTemplate) for a station where the guidepath has none.
        """
        robot = point.robot - 1
        ends = {"A": self.lower, "B": self.upper, "S": self.station}
        arc = float(ends[point.end][robot] + point.multiple * self.r[robot])
        if np.isnan(arc):
            message = f"{point} names a station, but the guidepath of robot {point.robot} has none"
            raise InputError(Diagnostic("BadTemplate", message, point.position, "use A or B"))
        return arc


Law = Callable[[Template, Setting], Mode]


def navigation(template: Template, setting: Setting) -> Mode:
    """The mode derived from a navigation function on W - Δ: each robot moves to its goal point, and
    no two touch. Guidepaths meet where ~ says so.

    Args:
        template: the operation.
        setting: the guidepaths of its robots.

    Raises InputError (NotPrepared) where that is no mode: a goal off its guidepath, or robots that
    touch at their goals.
    """
    law = template.law
    meetings = list(_meetings(template, setting))
    try:
        return Mode(
            goals=np.array([setting.coordinate(goal) for goal in law.goals]),
            lower=setting.lower,
            upper=setting.upper,
            eps=law.eps if isinstance(law.eps, float) else setting.eps,
            pairs=np.array([pair for pair, _ in meetings], np.intp),
            meet=np.array([meet for _, meet in meetings]),
            touch=np.array([setting.width[list(pair)].mean() for pair, _ in meetings]),
            gate=setting.gate,
            standoff=setting.standoff,
            dwell=setting.dwell,
        )
    except ValueError as error:
        message = f"{template.name}: {error}"
        raise InputError(Diagnostic("NotPrepared", message, template.law_position)) from error


def hold(template: Template, setting: Setting) -> Mode:
    """F = 0 with everything for a domain and a goal: the robots stay where they are."""
    return Mode.still(len(template.robots))


LAWS: Mapping[str, Law] = MappingProxyType({"navigation": navigation, "hold": hold, "wait": hold})
"""Every control law, by name."""


def law_of(template: Template) -> Law:
    """The control law that a template's F names: a shipped one, or that of an entry point. Raises
    InputError (BadTemplate) where there is none."""
    name = template.law.name
    if name in LAWS:
        return LAWS[name]
    laws = extensions("laws")
    if name not in laws:
        hint = did_you_mean(name, sorted({*LAWS, *laws}), "control laws")
        message = f"{template.name}: unknown control law '{name}'"
        raise InputError(Diagnostic("BadTemplate", message, template.law_position, hint))
    return partial(_of_user, name, laws[name])


def _of_user(name: str, law: Law, template: Template, setting: Setting) -> Mode:
    """What a user's law gives. Raises InputError (BadExtension) where that is no mode."""
    at = position_of(law)
    with blaming(f"the control law {name}", Path(at.file) if at else None):
        mode = law(template, setting)
    if not isinstance(mode, Mode):
        raise bad_extension(f"the control law {name} gave {type(mode).__name__}, not a Mode", at)
    return mode


def _meetings(
    template: Template, setting: Setting
) -> Iterator[tuple[tuple[int, int], tuple[float, float]]]:
    """The robots (from 0) whose guidepaths share a point, and its coordinate on either."""
    for points in template.identifications:
        for one, other in combinations(points, 2):
            if one.robot != other.robot:
                pair = one.robot - 1, other.robot - 1
                yield pair, (setting.coordinate(one), setting.coordinate(other))
