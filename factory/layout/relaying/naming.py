"""The PAG with its relays: the same tree, with a label for what each relaying robot takes over."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from factory.plant.factory import Factory, Operation
from factory.problem.pag import PAG, Assembly
from factory.problem.template import variable_number

RELAY = "relay"
"""The template of a hand-over."""


@dataclass(frozen=True)
class Named:
    """A PAG with relays. `made[X]`: the label that operation X of the factory without them has in
    it; `relays[X]`: the labels of the hand-overs of X, first to last."""

    pag: PAG
    made: Mapping[str, str]
    relays: Mapping[str, tuple[str, ...]]

    @property
    def origins(self) -> dict[str, str]:
        """For each label with relays that of the operation, without them, that made it."""
        made = {name: label for label, name in self.made.items()}
        return made | {name: label for label, names in self.relays.items() for name in names}

    def delivered(self, label: str) -> str:
        """What a label is called when it comes to the next operation."""
        return self.relays[label][-1] if self.relays.get(label) else self.made[label]


def named(factory: Factory, numbers: Mapping[str, int]) -> Named:
    """The PAG of a factory with so many relays for each label.

    The piles in which an operation takes many inputs are written out where one of them is relayed.
    Statements keep the source lines of what they are about.
    """
    taken, made, relays = set(factory.pag.by_label), dict[str, str](), dict[str, tuple[str, ...]]()
    piles = {node.label: _piles(factory, node) for node in factory.pag.nodes}
    for operations in piles.values():
        relayed = any(numbers.get(pile.label) for pile in operations[:-1])
        for operation in operations:
            label = operation.label
            written = relayed and label not in factory.pag.by_label
            made[label] = free_label(label.replace("/", "."), taken) if written else label
            wanted = (f"{made[label]}.relay{n + 1}" for n in range(numbers.get(label, 0)))
            relays[label] = tuple(free_label(name, taken) for name in wanted)
    found = Named(factory.pag, made, relays)
    nodes = tuple(
        statement
        for node in factory.pag.nodes
        for statement in _written(found, piles[node.label], node)
    )
    pag = replace(factory.pag, root=found.delivered(factory.pag.root), nodes=nodes, count=None)
    return replace(found, pag=pag)


def free_label(name: str, taken: set[str]) -> str:
    """The name, with a stroke below for each time that it is `taken`; it is then."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _piles(factory: Factory, node: Assembly) -> list[Operation]:
    """The operations of one statement, the first pile first (see `compiler.expand`)."""
    labels = (f"{node.label}/{number}" for number in range(1, len(node.inputs)))
    piles = [factory.by_label[label] for label in labels if label in factory.by_label]
    return [*piles, factory.by_label[node.label]]


def _written(found: Named, operations: Sequence[Operation], node: Assembly) -> Iterator[Assembly]:
    """A statement with its relays, and pile by pile where one of them is relayed."""
    if not any(found.relays[pile.label] for pile in operations[:-1]):
        yield replace(node, inputs=tuple(map(found.delivered, node.inputs)))
        yield from _relays(found, node, node.label)
        return
    for operation in operations:
        template = operation.template
        declared = {name for name, _ in template.parameters}
        yield replace(
            node,
            label=found.made[operation.label],
            operation=template.name,
            inputs=tuple(map(found.delivered, _inputs(operation))),
            parameters=tuple(p for p in node.parameters if p.name in declared),
            input_positions=(),
        )
        yield from _relays(found, node, operation.label)


def _relays(found: Named, node: Assembly, label: str) -> Iterator[Assembly]:
    before = found.made[label]
    for relay in found.relays[label]:
        yield Assembly(relay, RELAY, (before,), (), node.position, node.operation_position)
        before = relay


def _inputs(operation: Operation) -> list[str]:
    """The labels that an operation takes, in the order of its template's variables."""
    taken = dict(zip(operation.template.before, operation.before, strict=True))
    return [taken[variable] for variable in sorted(operation.template.inputs, key=variable_number)]
