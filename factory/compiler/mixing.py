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

from collections.abc import Iterator, Sequence
from itertools import permutations

from factory.compiler.folding import begun_by, kind_of, sides_of
from factory.plant.factory import Factory
from factory.problem.pag import NOPART, Mix
from factory.problem.plan import NOBODY, Turns
from factory.problem.robot_types import Catalogue
from factory.support.errors import Diagnostic, InputError

NECKLACES = 8
"""All orders are tried of a period of so many units."""


_Key = tuple[int, str, object]
"""What the tours of a line have in common: the line that they come to (by number, -1 for the
outfeed), and what they bring in which way."""


def turns_of(forest: Factory, on: Sequence[int], sequence: Sequence[str]) -> Turns:
    """The turns of a sequence of products: for each unit and each robot of the forest the line
    (index) that does its tours, NOBODY for another product. `on`: the line of each robot."""
    unit = {product: number for number, product in enumerate(forest.sequence)}
    makes = {robot: o.turn for o in forest.operations for robot in o.robots}
    return [
        [line if makes[robot] == unit[product] else NOBODY for robot, line in enumerate(on)]
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
    apart: set[int] = set()
    while True:
        on = _lines(forest, apart, catalogue)
        split = [*_begun_otherwise(forest, on)]
        outputs = [dropoff.carrier for dropoff in forest.dropoffs]
        faults = [_fault(forest, r) for r in outputs if r in split or on[r] != on[outputs[0]]]
        if faults:
            raise InputError(faults)
        if not split:
            return on
        apart.update(split)


def lowered_alike(products: Sequence[Factory]) -> dict[int, dict[str, str]]:
    """By products (index) whose output robot begins with two inputs that slide, where that of
    another begins with one that is lowered: the operation, and the input to be lowered there, so
    that one line with a lift can bring both."""
    begins = [one.first(one.dropoff.carrier) for one in products]
    model = next((first for first in begins if first.lowered >= 0), None)
    lowered_inputs = dict[int, dict[str, str]]()
    for number, first in enumerate(begins):
        inputs = [label for label in first.before if label != NOPART]
        if model is not None and first.lowered < 0 and len(inputs) == 2:
            lowered = model.before[model.lowered]
            stays = [x for x in inputs if x in model.before and x != lowered]
            others = [x for x in inputs if x not in stays]
            lowered_inputs[number] = {first.label: lowered if lowered in inputs else others[-1]}
    return lowered_inputs


def _lines(forest: Factory, apart: set[int], catalogue: Catalogue) -> list[int]:
    """The line of each robot: the first with its key that it fits on, a new one for those to be
    kept `apart`."""
    on: list[int] = []
    tours: list[list[int]] = []
    lines: dict[_Key, list[int]] = {}
    begins = _Begins(forest)
    for robot in range(len(forest.robots)):
        key = begins.key(robot, on)
        several = lines.setdefault(key, [])
        fitting = (n for n in several if _fits(forest, [*tours[n], robot], catalogue))
        line = len(tours) if robot in apart else next(fitting, len(tours))
        if line == len(tours):
            tours.append([])
            several.append(line)
        tours[line].append(robot)
        on.append(line)
    return on


class _Begins:
    """The keys of tours. The two inputs that begin the tours of a line come on the same two lines:
    those with a label that one of these has brought already on that, the others on the other."""

    def __init__(self, forest: Factory) -> None:
        self.forest, self.sides = forest, dict[int, tuple[set[str], set[str]]]()

    def key(self, robot: int, on: Sequence[int]) -> _Key:
        """The key of a robot's tour, whose carrier is on a line already."""
        last = self.forest.last(robot)
        if self.forest.drops(last.index):
            return -1, "product", None
        onto, slot = on[last.carrier], last.robots.index(robot)
        if last.before[slot] == NOPART:
            return onto, "tool", kind_of(self.forest, robot)
        guests = [
            s for s, x in enumerate(last.before) if x != NOPART and last.robots[s] != last.carrier
        ]
        label = self._written(last.index, slot)
        if last.pile != NOPART or len(guests) != 2:
            return onto, label, kind_of(self.forest, robot)
        one, other = self.sides.setdefault(onto, (set(), set()))
        first, second = (self._written(last.index, s) for s in guests)
        if first in other or second in one:
            first, second = second, first
        one.add(first)
        other.add(second)
        return onto, "second" if label == second else "first", "begins"

    def _written(self, operation: int, slot: int) -> str:
        o = self.forest.operations[operation]
        return self.forest.by_label[o.before[slot]].written


def _fits(forest: Factory, tours: Sequence[int], catalogue: Catalogue) -> bool:
    """Whether the tours of different products, or tools, can be on one line."""
    kinds = {kind_of(forest, robot) for robot in tours}
    kind = forest.robots[tours[0]].type
    for robot in tours:
        met = catalogue.meet(kind, forest.robots[robot].type)
        if met is None:
            return False
        kind = met
    deliveries = [forest.last(robot).index for robot in tours]
    sides = set.intersection(*(sides_of(forest, robot) for robot in tours))
    return len(kinds) == 1 and len({*deliveries}) == len(deliveries) and bool(sides)


def _begun_otherwise(forest: Factory, on: Sequence[int]) -> Iterator[int]:
    """The tours that begin with inputs from other lines than the first tour of their line."""
    begun: dict[int, frozenset[int]] = {}
    for robot, line in enumerate(on):
        lines = frozenset(on[guest] for guest in begun_by(forest, robot))
        if begun.setdefault(line, lines) != lines:
            yield robot


def _fault(forest: Factory, robot: int) -> Diagnostic:
    """Why the output robot cannot begin the tours of two products."""
    here, there = robot, forest.dropoff.carrier
    first, other = (forest.first(r) for r in (here, there))
    message = (
        f"'{first.written}' and '{other.written}' begin products on one robot, and their inputs"
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
    return " and ".join(
        f"{forest.by_label[label].written} {'is lowered' if slot == first.lowered else 'slides'}"
        for slot, label in enumerate(first.before)
        if label != NOPART
    )
