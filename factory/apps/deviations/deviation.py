"""Deviations, and the catalogue of their kinds: every kind of what goes wrong in a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from math import isfinite
from types import MappingProxyType

from factory.apps.deviations.kind import TIMES, DeviationKind, DeviationParameter

Vector = tuple[float, float, float]

ASKEW, SLIPPED = 5e-3, 1e-3
"""How far a part lies askew that is not turned, and how far one has slipped, unless asked otherwise
[m]: more than the tests of the shipped templates allow."""

_SECONDS = DeviationParameter("seconds", "s", "its duration", 5.0)
_METRES = DeviationParameter("metres", "m", "how far the part has slipped", SLIPPED)
_FACTOR = DeviationParameter(
    "factor", "", "the share of what it should be", valid="a positive number"
)
_REFUSED = "the feeder takes it back and presents another"
_WAITS = "the net waits"

KINDS: Mapping[str, DeviationKind] = MappingProxyType(
    {
        kind.name: kind
        for kind in (
            DeviationKind(
                "drop",
                "a robot drops its payload",
                "payload",
                ("label", "robot"),
                test="lost",
                response="it is made again; robots that could touch the dropped part stand still"
                " until it is cleared away",
            ),
            DeviationKind(
                "bad_part",
                "a feeder presents a defective part",
                "part",
                ("label",),
                parameters=(
                    DeviationParameter(
                        "hidden", "", "whether only an inspection finds it", False, "true or false"
                    ),
                ),
                test="rejected",
                response=f"{_REFUSED}; after an `inspect`, the sub-assembly that contains it is"
                " scrapped and made again",
            ),
            DeviationKind(
                "misplaced",
                "a feeder presents a part shifted to the left of its robot's heading, or turned"
                " about that heading",
                "part",
                ("label",),
                parameters=(
                    replace(_METRES, what="how far it is shifted", default=ASKEW),
                    DeviationParameter("degrees", "°", "how far it is turned", 0.0),
                ),
                test="misplaced",
                response=_REFUSED,
            ),
            DeviationKind(
                "no_part",
                "a feeder is empty for some time",
                "feeder",
                ("label",),
                parameters=(_SECONDS,),
                response="its robot waits",
            ),
            DeviationKind(
                "bad_joint",
                "an input has slipped in its hand when it is joined",
                "joint",
                ("label",),
                parameters=(_METRES,),
                test="residual",
                response="the operation is repeated; after more repetitions than its template"
                " allows, the input is scrapped",
            ),
            DeviationKind(
                "blackout",
                "no sensor reports for some time",
                "operation",
                narrowed=("label",),
                parameters=(_SECONDS,),
                response="nothing starts or ends",
            ),
            DeviationKind(
                "down",
                "a robot stands still for some time",
                "robot",
                ("robot",),
                ("label",),
                (_SECONDS,),
                response=_WAITS,
            ),
            DeviationKind(
                "dead",
                "a robot never moves again",
                "robot",
                ("robot",),
                ("label",),
                test="jammed",
                response="a spare comes from the depot; without one, the run ends with a message",
            ),
            DeviationKind(
                "push",
                "a force acts on a body; a robot gives way along its guidepath only",
                "time",
                ("body",),
                parameters=(
                    DeviationParameter(
                        "force",
                        "N",
                        "[x, y, z], in the directions of the world",
                        valid="three numbers",
                    ),
                    replace(_SECONDS, default=0.1, valid="a positive number"),
                ),
            ),
            DeviationKind(
                "slow",
                "a robot moves at a share of its speed limit: its drive knows, the other robots and"
                " the prediction do not",
                "time",
                ("robot",),
                parameters=(_FACTOR,),
            ),
            DeviationKind(
                "drag",
                "a robot is held back by viscous friction: its drive at full force reaches a share"
                " of its speed limit",
                "always",
                ("robot",),
                parameters=(_FACTOR,),
            ),
            DeviationKind(
                "mass",
                "parts weigh more or less than the drives were sized for, with their inertia",
                "always",
                narrowed=("label",),
                parameters=(_FACTOR,),
            ),
            DeviationKind(
                "gain",
                "drives give more or less force than they are asked for: gains, feed-forward and"
                " limit",
                "always",
                narrowed=("robot",),
                parameters=(_FACTOR,),
            ),
            DeviationKind(
                "friction",
                "empty axes have another dry friction than their robot type says; the share of the"
                " load stays",
                "always",
                narrowed=("robot",),
                parameters=(DeviationParameter("newtons", "N", "the dry friction of each axis"),),
            ),
            DeviationKind(
                "noise",
                "white noise in the measurements of all axes, for drives and supervisor, drawn in"
                " every timestep",
                "always",
                parameters=(
                    replace(_METRES, what="standard deviation of positions", default=0.0),
                    DeviationParameter("speed", "m/s", "standard deviation of speeds", 0.0),
                ),
            ),
            DeviationKind(
                "delay",
                "the measurements of all axes are old, for drives and supervisor",
                "always",
                parameters=(replace(_SECONDS, what="their age", default=None),),
            ),
        )
    }
)
"""Every kind of deviation, by name: single faults, then disturbances."""


@dataclass(frozen=True, slots=True)
class Deviation:
    """Something that goes wrong in a run, of a kind in `KINDS`, which says which keys it takes.

    Attributes:
        kind: the name of its kind.
        label: the part, or what is joined or carried; "" for any.
        robot: the robot; "" for any.
        body: the body, as the model names it: `r3/carriage`, `part/part1#2`.
        unit: it strikes in an operation for this unit, counted from 1.
        at: it strikes once, in the first operation from this time on [s]; a disturbance begins
            then.
        rate: it strikes in this share of all operations.
        seconds, metres, degrees, hidden, force, factor, newtons, speed: the parameters; where they
            are None they have the default of the kind.

    Raises ValueError.
    """

    kind: str
    label: str = ""
    robot: str = ""
    unit: int | None = None
    at: float | None = None
    rate: float | None = None
    seconds: float | None = None
    metres: float | None = None
    degrees: float | None = None
    hidden: bool = False
    body: str = ""
    force: Vector | None = None
    factor: float | None = None
    newtons: float | None = None
    speed: float | None = None

    def __post_init__(self) -> None:
        for _, message in misfits(self.kind, self.values):
            raise ValueError(message)

    @property
    def values(self) -> dict[str, object]:
        """What is given, by key, but for the kind."""
        named = ((field.name, field.default) for field in fields(self) if field.name != "kind")
        return {n: value for n, default in named if (value := getattr(self, n)) != default}

    @property
    def of_kind(self) -> DeviationKind:
        """Its kind."""
        return KINDS[self.kind]

    def number(self, name: str) -> float:
        """A parameter that is a number, as given or by default."""
        value = getattr(self, name)
        if value is None:
            value = self.of_kind.parameter(name).default
        return float(value)

    @property
    def way(self) -> float:
        """Displacement of a part that is misplaced or has slipped [m]; a part that is turned is
        shifted less, unless asked otherwise."""
        return SLIPPED if self.metres is None and self.degrees else self.number("metres")


def misfits(name: str, values: Mapping[str, object]) -> Iterator[tuple[str, str]]:
    """What is wrong with the values of a deviation, each of its type: the key, "" for none, and a
    message."""
    if name not in KINDS:
        yield "kind", f"there is no fault '{name}'"
        return
    kind = KINDS[name]
    for key in values:
        if key not in kind.keys:
            verb = "concerns" if key in ("label", "robot", "body") else "takes"
            yield key, f"'{name}' {verb} no '{key}': it takes {', '.join(kind.keys)}"
    yield from _of_time(kind, values)
    chosen = [key for key in kind.concerns if values.get(key)]
    if len(chosen) < bool(kind.concerns) and values.get("rate") is None:
        yield "", f"'{name}' needs a {' or a '.join(map(repr, kind.concerns))}"
    for parameter in kind.parameters:
        value = values.get(parameter.name)
        if value is None and parameter.default is None:
            yield "", f"'{name}' needs a '{parameter.name}'"
        elif value is not None and not parameter.admits(value):
            yield parameter.name, f"'{parameter.name}' is {value}: {parameter.valid} is needed"


def _of_time(kind: DeviationKind, values: Mapping[str, object]) -> Iterator[tuple[str, str]]:
    unit, at, rate = (values.get(key) for key in TIMES)
    if kind.times == TIMES and sum(value is not None for value in (unit, at, rate)) != 1:
        yield "", "one of 'unit', 'at' and 'rate' is needed"
    if isinstance(unit, int) and unit < 1:
        yield "unit", f"'unit' is {unit}: they are counted from 1"
    if isinstance(rate, int | float) and not 0 <= rate <= 1:
        yield "rate", f"'rate' is {rate}: a share from 0 to 1 is needed"
    if isinstance(at, int | float) and not (isfinite(at) and at >= 0):
        yield "at", f"'at' is {at}: a number from 0 on is needed"
