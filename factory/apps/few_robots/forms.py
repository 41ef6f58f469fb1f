"""Forms of operations: a third robot takes what two bring, or the robot of one of them keeps it.

With `instead`, a template names the template that does the same with one robot fewer. Each
operation in that form saves a robot, but the robot that keeps the pile has a longer cycle. A form
also turns what is below it: a robot makes what it holds on its own way, so the inputs come along
the other axis than they would to a robot that brings it to a third.

The forms chosen are optimal in a lexicographic order, for instance fewest blocked operations, then
no estimated cycle above a bound, then fewest robots: exact for these estimates. Cycles are
estimated from the sizes of sub-assemblies; layouts decide (`search.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf
from typing import Literal

from factory.api import PAG, Assembly, Matings, Node, Pace, Plan, Template
from factory.apps.few_robots.lines import Admitted
from factory.support.boxes import Box

APART = 0.06
"""Length of guidepath from one station to the next, beside the sub-assembly [m]."""

GRAIN = 0.1
"""Resolution of estimated cycles above the bound [s]."""

Order = Literal["robots", "lines", "fewest"]
"""Objective by which forms are chosen: few robots that serve one label each, few lines, or few
lines even if more operations are blocked."""


@dataclass(frozen=True, slots=True)
class Option:
    """One way to make a sub-assembly: the numbers of `blocked` and `loose` operations; the sum of
    estimated cycles `over` the bound [s]; the number of `robots` that have finished their cycles;
    the `time` that the robot which holds it needs up to here, with the way back [s]; which input is
    the `pile`, and the options of the `inputs`; the number of `lines` that hold it if as many
    robots as possible share one; the `order` in which options are compared."""

    blocked: int
    loose: int
    over: float
    robots: int
    time: float
    pile: int = Plan.THIRD
    inputs: tuple[Option, ...] = ()
    lines: int = 1
    order: Order = "robots"

    @property
    def rank(self) -> tuple[float, ...]:
        """The rank, the less the better."""
        clean, few = (self.blocked, self.loose), (self.robots, self.time)
        if self.order == "robots":
            return *clean, self.over, *few
        if self.order == "lines":
            return *clean, self.over, self.lines, *few
        return self.over, self.lines, *clean, *few


@dataclass(frozen=True)
class FormsTask:
    """A product whose forms are to be chosen: what its operations `admitted` along either axis,
    nothing for a product of default boxes, the boxes of its sub-assemblies (`payloads`), the `pace`
    of robots, forms that are `refused`: joins, and the pile of each, which count as blocked; and
    the `order` in which ways are compared."""

    pag: PAG
    templates: Mapping[str, Template]
    admitted: Mapping[str, Admitted]
    payloads: Mapping[str, Box]
    pace: Pace
    refused: frozenset[tuple[str, int]] = frozenset()
    order: Order = "robots"

    @cached_property
    def nodes(self) -> Mapping[str, Node]:
        """Its operations, in postorder."""
        return Node.expand(self.pag, self.templates)

    def size(self, label: str) -> float:
        """Length of the longer side of a sub-assembly on the floor [m]."""
        xlo, xhi, ylo, yhi = self.payloads[label]
        return max(xhi - xlo, yhi - ylo)

    @cached_property
    def free(self) -> Mapping[str, Template]:
        """The joins that may have either form, by their labels, with the template with a third
        robot: all joins of statements whose template has an alternative with a robot fewer."""
        free: dict[str, Template] = {}
        for node in self.pag.nodes:
            template = self.templates[node.operation]
            if template.instead:
                free |= dict.fromkeys(joins(node), template)
        return free


def best_forms(task: FormsTask, bound: float = inf) -> tuple[dict[str, int], float]:
    """The pile of each free join, or THIRD; and the sum of estimated cycles above a `bound` [s].
    Near linear."""
    options: dict[tuple[str, int], list[Option]] = {}
    for label, node in task.nodes.items():
        for axis in (0, 1):
            inputs = [(options[x, axis], options[x, 1 - axis]) for x in node.inputs]
            options[label, axis] = _best(_options(task, node, axis, inputs, bound))
    chosen: dict[str, int] = {}
    root = task.pag.root
    last = min((_finished(task, root, o, bound) for o in options[root, 1]), key=lambda o: o.rank)
    stack = [(root, last)]
    while stack:
        label, option = stack.pop()
        node = task.nodes[label]
        if label in task.free:
            chosen[label] = option.pile
        stack.extend(zip(node.inputs, option.inputs, strict=True))
    return chosen, last.over


def written_forms(task: FormsTask) -> dict[str, int]:
    """The forms of a product as written: the first two inputs of a statement go to a third robot,
    each further one to the pile."""
    return {
        label: Plan.THIRD if task.nodes[label].template == template else 0
        for label, template in task.free.items()
    }


def _options(
    task: FormsTask,
    node: Node,
    axis: int,
    each: Sequence[tuple[list[Option], list[Option]]],
    bound: float,
) -> Iterator[Option]:
    """The options of a node whose inputs come along an axis; `each`: the options of each input if
    its own inputs come along the same axis, or along the other one."""
    if not node.inputs:
        yield Option(0, 0, 0.0, 0, task.pace.lost, order=task.order)
        return
    for pile in (Plan.THIRD, 0, 1) if node.label in task.free else (node.held,):
        faults = _faults(task, node, axis, pile)
        for inputs in _combined([options[n != pile] for n, options in enumerate(each)]):
            yield _joined(task, node, pile, inputs, bound, faults)


def _combined(each: Sequence[list[Option]]) -> Iterator[tuple[Option, ...]]:
    if not each:
        yield ()
        return
    for rest in _combined(each[1:]):
        for first in each[0]:
            yield (first, *rest)


def _joined(
    task: FormsTask,
    node: Node,
    pile: int,
    inputs: tuple[Option, ...],
    bound: float,
    faults: tuple[int, int],
) -> Option:
    """The inputs joined on the robot of the `pile`, or on a third; the cycles of the others end."""
    blocked, loose = faults
    over, robots, time = 0.0, 0, 0.0
    for number, (label, option) in enumerate(zip(node.inputs, inputs, strict=True)):
        blocked, loose = blocked + option.blocked, loose + option.loose
        over, robots = over + option.over, robots + option.robots
        if number == pile:
            time = option.time
        else:
            robots += 1
            over += _over(task, label, option, bound)
    come = [task.size(x) for n, x in enumerate(node.inputs) if n != pile]
    step = max(come, default=0.0) + APART
    time += task.pace.rest(step) + node.dwell + task.pace.lost
    time += 0.0 if pile == Plan.THIRD else step / task.pace.speed
    lines = _lines(node, pile, inputs)
    return Option(blocked, loose, over, robots, time, pile, inputs, lines, task.order)


def _lines(node: Node, pile: int, inputs: tuple[Option, ...]) -> int:
    """Number of lines that hold what is joined: a third robot has two lines beside its own, the
    robot of a pile one, shared by those that come one after the other."""
    if len(node.inputs) < 2:
        return inputs[0].lines
    if pile == Plan.THIRD:
        return 1 + sum(option.lines for option in inputs)
    return max(o.lines if n == pile else o.lines + 1 for n, o in enumerate(inputs))


def _over(task: FormsTask, label: str, option: Option, bound: float) -> float:
    """Excess over the bound of the estimated cycle of the robot that delivers a label [s]."""
    leg = task.size(label) + APART
    cycle = option.time + 2 * task.pace.rest(leg) + task.pace.lost
    return max(0.0, round((cycle - bound) / GRAIN) * GRAIN) if bound < inf else 0.0


def _finished(task: FormsTask, label: str, option: Option, bound: float) -> Option:
    """An option of a label, with the cycle of the robot that delivers it."""
    return replace(option, over=option.over + _over(task, label, option, bound))


def _best(options: Iterator[Option]) -> list[Option]:
    """The options that are Pareto-optimal in rank and time."""
    front: list[Option] = []
    for option in sorted(options, key=lambda o: o.rank):
        if not front or option.time < front[-1].time - 1e-9:
            front.append(option)
    return front


def _faults(task: FormsTask, node: Node, axis: int, pile: int) -> tuple[int, int]:
    """Whether a node is blocked or refused (1 or 0), and whether it is not clean on the way, as its
    inputs come along an axis to the pile."""
    if (node.label, pile) in task.refused:
        return 1, 1
    if len(node.inputs) < 2 or node.label not in task.admitted:
        return 0, 0
    admits = task.admitted[node.label]
    lowers = [level for n, level in enumerate(admits.lowers) if n != pile]
    if len(node.inputs) > 2:
        lowers = lowers[-1:]
    level = max(admits.slides[axis], *lowers)
    return int(level == Matings.LEVEL.BLOCKED), int(level < Matings.LEVEL.NO_DEEPER)


def joins(node: Assembly) -> Iterator[str]:
    """The labels of the piles that a statement with two inputs or more makes, in order."""
    for number in range(2, len(node.inputs)):
        yield f"{node.label}/{number}"
    yield node.label
