"""Mixes: the products of one floor, each unit of a period with a tree of its own.

The products are compiled apart (`compiler`), and a mix is a fold of that forest (`folding`): two
tours are on one line if they bring the same label to the same line in the same way, and so are
tools of one kind that come to one line. What begins a tour of a line comes on the same two lines in
all products. The units of a period follow a *sequence* of products, and a line passes over the
units that need nothing of it.

Theorem 9: for every sequence the net is a gear train, live, safe and reversible, and products leave
in the order of the sequence. For all programs ascend in one order, by unit and then in postorder,
the pile first (`assigning`). Any other order of the tours of a line is dead.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import permutations

from factory.support.errors import Diagnostic, InputError
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART, Mix
from factory.theory.problem.plan import Plan, Turns
from factory.theory.problem.robot_types import Catalogue

NECKLACES = 8
"""All orders are tried of a period of so many units."""


_Key = tuple[int, object, object]
"""What the tours of a line have in common: the line that they come to (by number, -1 for the
outfeed), and what they bring in which way."""


def turns_of(forest: Factory, on: Sequence[int], sequence: Sequence[str]) -> Turns:
    """The turns of a sequence of products: for each unit and each robot of the forest the line
    (index) that does its tours, NOBODY for another product. `on`: the line of each robot."""
    unit = {product: number for number, product in enumerate(forest.sequence)}
    makes = {int(robot): o.turn for o in forest.operations for robot in o.robots}
    return [
        [line if makes[robot] == unit[product] else Plan.NOBODY for robot, line in enumerate(on)]
        for product in sequence
    ]


def even(mix: Mix) -> tuple[str, ...]:
    """The sequence of a mix in which each product is spread evenly (goal chasing): the next product
    is the one that is farthest behind its share."""
    total, made, sequence = sum(count for _, count in mix.counts), dict[str, int](), list[str]()
    for unit in range(1, total + 1):
        behind = {x: count * unit - made.get(x, 0) * total for x, count in mix.counts}
        sequence.append(max(behind, key=behind.__getitem__))
        made[sequence[-1]] = made.get(sequence[-1], 0) + 1
    return tuple(sequence)


def orders(mix: Mix) -> Iterator[tuple[str, ...]]:
    """The sequences of a mix that are not the same but for where a period begins: that as written
    alone, or the even one and, of at most NECKLACES units, all others."""
    if mix.sequence:
        yield mix.sequence
        return
    yield even(mix)
    first, tried = mix.counts[0][0], {_necklace(even(mix))}
    left = [label for label, count in mix.counts for _ in range(count)][1:]
    for rest in permutations(left) if len(left) < NECKLACES else ():
        if (necklace := _necklace((first, *rest))) not in tried:
            tried.add(necklace)
            yield first, *rest


def _necklace(sequence: tuple[str, ...]) -> tuple[str, ...]:
    """The first in alphabetical order of the rotations of a sequence."""
    return min(sequence[n:] + sequence[:n] for n in range(len(sequence)))


def lines_of_mix(forest: Factory, catalogue: Catalogue) -> list[int]:
    """The line of each robot of the forest, numbered in the order of the robots. Raises InputError
    (BadLine) where what begins the tours of the output robot does not come in one way in all
    products."""
    apart, outputs = dict[int, int](), [dropoff.carrier for dropoff in forest.dropoffs]
    while True:
        on = _lines(forest, apart, catalogue)
        split = dict(_begun_otherwise(forest, on))
        otherwise = [r for r in outputs if r in split or on[r] != on[outputs[0]]]
        faults = [_fault(forest, r, outputs[0], apart) for r in otherwise]
        if faults:
            raise InputError(faults)
        if not split:
            return on
        apart.update(split)


def lowered_alike(products: Sequence[Factory]) -> dict[int, dict[str, str]]:
    """By products (index): the operations that begin with two inputs that slide, where one of
    another product that begins on the same line has one that is lowered; and the input to be
    lowered there, so that one line with a lift can bring both."""
    lowered_inputs: dict[int, dict[str, str]] = {number: {} for number in range(len(products))}
    todo: list[list[tuple[int, int]]] = [
        [(number, one.dropoff.carrier) for number, one in enumerate(products)]
    ]
    for line in todo:
        begins = [(n, products[n].first(r)) for n, r in line]
        if {len(first.inputs) for _, first in begins} != {2}:
            continue
        model = max((first for _, first in begins), key=lambda first: first.lowered >= 0)
        low = model.before[model.lowered] if model.lowered >= 0 else model.inputs[-1]
        (stays,) = {*model.inputs} - {low}
        sides: tuple[list[tuple[int, int]], ...] = [], []
        for number, first in begins:
            others = [x for x in first.inputs if x != stays]
            lowered = low if low in others else [*others, *others][model.inputs.index(low)]
            if first.lowered >= 0:
                lowered = first.before[first.lowered]
            elif model.lowered >= 0:
                lowered_inputs[number][first.label] = lowered
            for slot in map(first.before.index, first.inputs):
                sides[first.before[slot] == lowered].append((number, first.robots[slot]))
        todo += sides
    return lowered_inputs


def _lines(forest: Factory, apart: Collection[int], catalogue: Catalogue) -> list[int]:
    """The line of each robot: the first with its key that it fits on, a new one for those to be
    kept `apart`."""
    on, tours, lines = list[int](), list[list[int]](), dict[_Key, list[int]]()
    begins = _Begins(forest)
    for robot in range(len(forest.robots)):
        several = lines.setdefault(begins.key(robot, on), [])
        fitting = (n for n in several if _fits(forest, [*tours[n], robot], catalogue))
        line = len(tours) if robot in apart else next(fitting, len(tours))
        if line == len(tours):
            tours.append([])
            several.append(line)
        tours[line].append(robot)
        on.append(line)
    return on


class _Begins:
    """The keys of tours. The two inputs that begin the tours of a line come on the same two lines
    (`sides`, by their carrier's): those with a label that one of these has brought already on that,
    the others on the other; without such a label in the order in which they are alike."""

    def __init__(self, forest: Factory) -> None:
        self.forest, self.sides = forest, dict[int, tuple[dict[str, int], dict[str, int]]]()

    def key(self, robot: int, on: Sequence[int]) -> _Key:
        """The key of a robot's tour, whose carrier is on a line already."""
        last = self.forest.last(robot)
        if self.forest.drops(last.index):
            return -1, "product", None
        onto, slot = on[last.carrier], last.robots.index(robot)
        if last.before[slot] == NOPART:
            return onto, "tool", self.forest.tour_kind(robot)
        guests = [
            s for s, x in enumerate(last.before) if x != NOPART and last.robots[s] != last.carrier
        ]
        label = self._written(last.index, slot)
        if last.pile != NOPART or len(guests) != 2:
            return onto, label, self.forest.tour_kind(robot)
        one, other = self.sides.setdefault(onto, ({}, {}))
        by = {self._written(last.index, s): last.robots[s] for s in guests}

        def like(pair: tuple[str, ...]) -> tuple[int, bool]:
            """How many labels are on their sides already; whether all come as those there do."""
            tours = [[*side.values(), by[x]] for side, x in zip((one, other), pair, strict=True)]
            return (pair[0] in one) + (pair[1] in other), all(_alike(self.forest, t) for t in tours)

        first, second = max((tuple(by), tuple(by)[::-1]), key=like)
        one.setdefault(first, by[first])
        other.setdefault(second, by[second])
        return onto, "second" if label == second else "first", "begins"

    def _written(self, operation: int, slot: int) -> str:
        o = self.forest.operations[operation]
        return self.forest.by_label[o.before[slot]].written


def _fits(forest: Factory, tours: Sequence[int], catalogue: Catalogue) -> bool:
    """Whether the tours of different products, or tools, can be on one line."""
    kind: str | None = forest.robots[tours[0]].type
    for robot in tours:
        kind = kind and catalogue.meet(kind, forest.robots[robot].type)
    deliveries = {forest.last(robot).index for robot in tours}
    return kind is not None and len(deliveries) == len(tours) and _alike(forest, tours)


def _alike(forest: Factory, tours: Sequence[int]) -> bool:
    """Whether tours are of one kind, and can all come from one side."""
    kinds = {forest.tour_kind(robot) for robot in tours}
    sides = set.intersection(*(forest.sides(robot) for robot in tours))
    return len(kinds) == 1 and bool(sides)


def _begun_otherwise(forest: Factory, on: Sequence[int]) -> Iterator[tuple[int, int]]:
    """The tours that begin with inputs from other lines than the first tour of their line; and
    that."""
    begun: dict[int, tuple[int, frozenset[int]]] = {}
    for robot, line in enumerate(on):
        lines = frozenset(on[guest] for guest in forest.begun_by(robot))
        first, others = begun.setdefault(line, (robot, lines))
        if others != lines:
            yield robot, first


def _fault(forest: Factory, here: int, there: int, apart: Mapping[int, int]) -> Diagnostic:
    """Why one robot cannot begin two tours (of robots of the forest), or what begins them, where
    that had to be kept `apart`."""
    while (guest := next((r for r in forest.begun_by(here) if r in apart), None)) is not None:
        here, there = guest, apart[guest]
    first, other = (forest.first(r) for r in (here, there))
    message = (
        f"'{first.written}' and '{other.written}' have to begin on one robot, and their inputs"
        f" cannot come on the same two lines: {_ways_in(forest, here)}; {_ways_in(forest, there)}"
    )
    hint = (
        "let both products begin alike: with two parts, or two sub-assemblies, that come in the"
        " same way from the same sides"
    )
    return Diagnostic("BadLine", message, first.position, hint)


def _ways_in(forest: Factory, robot: int) -> str:
    """How the inputs come with which a tour begins, in words."""
    first = forest.first(robot)
    inputs = [(n, forest.by_label[first.before[n]]) for n in map(first.before.index, first.inputs)]
    return " and ".join(
        f"{'sub-assembly' if o.inputs else 'part'} {o.written}"
        f" {'is lowered' if slot == first.lowered else 'slides'}"
        for slot, o in inputs
    )
