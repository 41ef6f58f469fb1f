"""Robots of a factory that are those of the factory of the product's next revision.

A robot stays if what it carries, or the operation that it is a tool of, is mapped by the
`Matching` of the two products, and if it delivers to a mapped operation of the same template.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from factory.api import NOPART, Factory, Operation
from factory.apps.revise.matching import Matching


@dataclass(frozen=True)
class Pairing:
    """The robots and the operations (index) of a factory with those of another that they are;
    either has a robot for each tour."""

    matching: Matching = field(repr=False)
    old: Factory
    new: Factory

    @cached_property
    def operations(self) -> Mapping[int, int]:
        """The operations of the old factory with those of the new. The piles of a statement are
        mapped by what is joined to them, else by the label that they make."""
        labels = self.matching.labels
        by_inputs = {_joined(self.new, o): o for o in self.new.making}
        pairs = dict[int, int]()
        for o in self.old.making:
            stem, template, inputs = _joined(self.old, o)
            mapped = frozenset(labels.get(label, "") for label in inputs)
            other = by_inputs.get((labels.get(stem, ""), template, mapped))
            if other is None and o.label in labels:
                other = self.new.by_label[labels[o.label]]
                other = other if other.template.name == template else None
            if other is not None and other.index not in pairs.values():
                pairs[o.index] = other.index
        return {**pairs, self.old.dropoff.index: self.new.dropoff.index}

    @cached_property
    def robots(self) -> Mapping[int, int]:
        """The robots of the old factory with those of the new that they are."""
        pairs = {0: 0}
        for robot in self.old.robots[1:]:
            other = self._partner(robot.index)
            if other is not None and other not in pairs.values():
                pairs[robot.index] = other
        return pairs

    def _partner(self, robot: int) -> int | None:
        last = self.old.last(robot)
        slot = last.robots.index(robot)
        if last.before[slot] == NOPART:
            number = self.operations.get(last.index)
            return None if number is None else self.new.operations[number].robots[slot]
        labels = self.matching.labels
        program = (self.old.operations[n] for n in self.old.robots[robot].operations)
        made = [o.label for o in program if o.carrier == robot and o.label in self.old.pag.by_label]
        carried = [label for label in made if label in labels]
        if not carried:
            return None
        other = self.new.by_label[labels[carried[-1]]].carrier
        onward = self.new.last(other)
        same = labels.get(_stem(self.old, last)) == _stem(self.new, onward)
        return other if same and last.template.name == onward.template.name else None

    def keeps_program(self, robot: int) -> bool:
        """Whether a robot that stays has the same operations, but for names of labels."""
        before = [(*row, self.operations.get(n, -1)) for *row, n in _program(self.old, robot)]
        return before == [*_program(self.new, self.robots[robot])]

    def keeps_contents(self, robot: int) -> bool:
        """Whether all that a robot that stays ever holds is equal to what it held."""
        return self._contents(0, robot) == self._contents(1, self.robots[robot])

    def _contents(self, which: int, robot: int) -> list[list[str]]:
        factory, digests = (self.old, self.new)[which], self.matching.digests[which]
        program = (factory.operations[number] for number in factory.robots[robot].operations)
        held = (o.after[o.robots.index(robot)] for o in program)
        return [
            sorted(digests[part] for part in factory.contents[label])
            for label in held
            if label != NOPART
        ]


def _program(factory: Factory, robot: int) -> Iterator[tuple[str, float, int, int]]:
    """Template, dwell, slot and index of each operation of a robot."""
    for number in factory.robots[robot].operations:
        o = factory.operations[number]
        yield o.template.name, o.dwell, o.robots.index(robot), number


def _stem(factory: Factory, operation: Operation) -> str:
    """The label of the PAG whose statement an operation is of."""
    label = operation.label
    return label if label in factory.pag.by_label else label.rpartition("/")[0]


def _joined(factory: Factory, operation: Operation) -> tuple[str, str, frozenset[str]]:
    """The statement of an operation, its template, and its inputs but the pile of the statement."""
    labels = factory.pag.by_label
    inputs = frozenset(label for label in operation.inputs if label in labels)
    return _stem(factory, operation), operation.template.name, inputs
