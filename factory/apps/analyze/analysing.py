"""The analysis of a factory's pace by its timed net, as it is and under the changes of a what-if
question."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from factory.api import Diagnostic, Factory, InputError, Timing
from factory.apps.analyze.firing import slacks
from factory.apps.analyze.measured import Comparison, RunRecord, compare
from factory.apps.analyze.timed import Circuit, Flow, TimedNet, flow, timed_net
from factory.apps.drawing.tables import Tabular, titled
from factory.engine.timing.timing import Change
from factory.support.errors import did_you_mean, usage_error

MOST: Mapping[str, float] = {"faster": 1e6, "shorter": 100.0}
"""The most that a robot is faster, and its ways are shorter [percent]."""


def change_of(
    factory: Factory,
    second: Sequence[str] = (),
    faster: Mapping[str, float] | None = None,
    shorter: Mapping[str, float] | None = None,
) -> tuple[str, Change] | None:
    """The change in which each robot named in `second` has one more beside it, and those of
    `faster` and `shorter` are faster or have shorter ways by so many percent, with its description;
    None without any. Raises InputError: Usage for a name that no robot has, BadValue for a
    number."""
    robots = {robot.name: robot.index for robot in factory.robots}
    for name in (*second, *(faster or {}), *(shorter or {})):
        if name not in robots:
            hint = did_you_mean(name, list(robots), "robots")
            raise usage_error(f"there is no robot '{name}'", hint)
    copies: dict[int, int] = {robots[name]: 1 + second.count(name) for name in second}
    speed, way = _shares("faster", faster), _shares("shorter", shorter)
    words = [f"{count} × {factory.robots[r].name}" for r, count in copies.items()]
    words += [f"{name} {100 * share:g} % faster" for name, share in speed.items()]
    words += [f"ways of {name} {100 * share:g} % shorter" for name, share in way.items()]
    if not words:
        return None
    change = Change(
        speed={robots[name]: 1 + share for name, share in speed.items()},
        way={robots[name]: 1 - share for name, share in way.items()},
        copies=copies,
    )
    return ", ".join(words), change


def _shares(kind: str, percents: Mapping[str, float] | None) -> dict[str, float]:
    """Percent as shares. Raises InputError (BadValue)."""
    for name, percent in (percents or {}).items():
        if not 0 < percent <= MOST[kind]:
            most, text = f"{MOST[kind]:g}", f"{name}={percent:g}"
            message = f"{kind} takes a robot and percent above 0, at most {most}, not '{text}'"
            raise InputError(Diagnostic("BadValue", message, None, f"for example {name}=20"))
    return {name: percent / 100 for name, percent in (percents or {}).items()}


STEP = 0.1
"""Relative change of a speed or a way."""

SAVING = ("if a tenth faster", "by ways a tenth shorter", "with a second one")
"""What a sensitivity is to, in words."""


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Reduction of the cycle time [s] by changes of one robot alone.

    `faster`: its speed (and its lift's) a tenth higher; `shorter`: each of its ways a tenth
    shorter; `copy`: a second robot alternates with it. `slack`: waiting time of the robot in a
    cycle."""

    robot: str
    slack: float
    faster: float
    shorter: float
    copy: float


def sensitivities(timing: Timing, net: TimedNet, wip: int | None) -> tuple[Sensitivity, ...]:
    """The sensitivity to each robot, in the order of the robots."""
    gears = {circuit.name: circuit for circuit in net.named}
    return tuple(
        _sensitivity(timing, net, wip, number, gears[robot.name])
        for number, robot in enumerate(timing.factory.robots)
    )


def _sensitivity(
    timing: Timing, net: TimedNet, wip: int | None, number: int, gear: Circuit
) -> Sensitivity:
    def gain(change: Change) -> float:
        saved = net.pace - timed_net(timing, change, wip).pace
        return saved if abs(saved) > 1e-9 * net.pace else 0.0

    if not any(set(gear.places) & set(circuit.places) for circuit in net.critical):
        return Sensitivity(gear.name, net.slack(gear), 0.0, 0.0, 0.0)
    return Sensitivity(
        gear.name,
        net.slack(gear),
        gain(Change(speed={number: 1 + STEP})),
        gain(Change(way={number: 1 - STEP})),
        gain(Change(copies={number: 2})),
    )


@dataclass(frozen=True, slots=True)
class Scenario:
    """A change in words, the cycle time with it [s], and its bottlenecks."""

    words: str
    pace: float
    then: tuple[str, ...]


def scenario(timing: Timing, words: str, change: Change, wip: int | None) -> Scenario:
    """The scenario of a change."""
    net = timed_net(timing, change, wip)
    return Scenario(words, net.pace, tuple(c.name for c in net.critical))


def least_wip(timing: Timing) -> int:
    """The least bound on copies of each part with the full pace, by bisection: the cycle time never
    grows with the bound."""
    net = timed_net(timing)
    low, high = 0, max(net.pool.values()) * timing.factory.period
    while high - low > 1:
        middle = (low + high) // 2
        enough = timed_net(timing, wip=middle).pace <= net.pace * (1 + net.SAME)
        low, high = (low, middle) if enough else (middle, high)
    return high


def listed(names: list[str], most: int = 6) -> str:
    """Names as an enumeration: `a, b and c`."""
    shown = names[:most] + ([f"{len(names) - most} more"] if len(names) > most else [])
    return " and ".join([", ".join(shown[:-1]), shown[-1]] if len(shown) > 1 else shown)


@dataclass(frozen=True)
class Analysis(Tabular):
    """The results of the timed net of a laid-out factory.

    `slack[i]`: increase of the duration of operation i from which it sets the pace [s]; `asked`:
    the change that was asked about, if any; `least_wip`: the least bound on copies of each part
    with the full pace.
    """

    timing: Timing
    wip: int | None
    net: TimedNet = field(repr=False)
    flow: Flow = field(repr=False)
    slack: tuple[float, ...] = field(repr=False)
    sensitivities: tuple[Sensitivity, ...] = field(repr=False)
    asked: Scenario | None
    least_wip: int
    measured: Comparison | None = field(repr=False)

    def __repr__(self) -> str:
        sets = f"{listed([*self.bottlenecks])} set{'s' * (len(self.bottlenecks) == 1)} the pace"
        name = self.timing.factory.pag.title
        return f"<Analysis of {name}: cycle time {self.net.pace:.3f} s, {sets}>"

    def _repr_html_(self) -> str:
        columns = ("robot", "waits [s]", *(f"saves {how} [s]" for how in SAVING))
        rows = ((s.robot, s.slack, s.faster, s.shorter, s.copy) for s in self.sensitivities)
        return titled(repr(self), columns, rows)

    def records(self) -> list[dict[str, object]]:
        """A row for each robot: what it does in a cycle, and what changes of it alone save [s]."""
        rows = zip(self.timing.factory.robots, self.flow.shares, self.sensitivities, strict=True)
        return [
            {
                "robot": robot.name,
                "type": robot.type,
                "moving_s": share.moving,
                "working_s": share.working,
                "standing_s": share.standing,
                "waiting_s": share.waiting,
                "busy": share.busy,
                "slack_s": gain.slack,
                "gain_10_percent_faster_s": gain.faster,
                "gain_10_percent_shorter_s": gain.shorter,
                "gain_second_robot_s": gain.copy,
            }
            for robot, share, gain in rows
        ]

    @property
    def bottlenecks(self) -> tuple[str, ...]:
        """The names of the critical circuits."""
        return tuple(circuit.name for circuit in self.net.critical)

    @property
    def by_product(self) -> dict[str, float]:
        """How long the first critical circuit is taken by a unit of each product, on average [s];
        empty where there is one product. What is no operation counts to the one it leads to.
        Weighted by the products' counts, these are the cycle time."""
        operations, sequence = self.timing.factory.operations, self.timing.factory.sequence
        circuit, spent = self.net.critical[0].places, dict.fromkeys(sequence, 0.0)
        turns = [operations[p].turn for p in circuit if p < len(operations)]
        if len(spent) == 1 or not turns:
            return {}
        turn = turns[0]
        for place in reversed(circuit):
            turn = operations[place].turn if place < len(operations) else turn
            spent[sequence[turn]] += self.net.seconds[place]
        return {product: seconds / sequence.count(product) for product, seconds in spent.items()}


def analyse(
    timing: Timing,
    units: int = 20,
    wip: int | None = None,
    asked: tuple[str, Change] | None = None,
    record: RunRecord | None = None,
) -> Analysis:
    """The analysis of a laid-out factory: of `units` products from the initial marking, with a
    bound `wip` on copies of each part, a change `asked` for, with its description, and the `record`
    of a run to compare with.

    Raises InputError if `wip` is below 1 or a mode cannot reach its goal.
    """
    net = timed_net(timing, wip=wip)
    products = flow(timing, net, units)
    return Analysis(
        timing,
        wip,
        net,
        products,
        operation_slacks(timing, net),
        sensitivities(timing, net, wip),
        None if asked is None else scenario(timing, *asked, wip),
        least_wip(timing),
        compare(timing, net, products, record) if record else None,
    )


def operation_slacks(timing: Timing, net: TimedNet) -> tuple[float, ...]:
    """Increase of the duration of each operation from which it sets the pace [s]: the slack of the
    tightest circuit through it."""
    operations = timing.factory.operations
    tightest = slacks(net.ratio, (o.place for o in operations))
    return tuple(tightest[o.place].seconds for o in operations)
