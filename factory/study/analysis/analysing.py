"""The analysis of a factory's pace by its timed net."""

from __future__ import annotations

from dataclasses import dataclass, field

from factory.study.analysis.flow import Flow, flow
from factory.study.analysis.measured import Comparison, RunRecord, compare
from factory.study.analysis.slack import slacks
from factory.study.analysis.timed import TimedNet, timed_net
from factory.study.analysis.what_if import (
    Scenario,
    Sensitivity,
    least_wip,
    scenario,
    sensitivities,
)
from factory.timing.timing import AS_IT_IS, Change, Timing


@dataclass(frozen=True)
class Analysis:
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
    net = timed_net(timing, AS_IT_IS, wip)
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
