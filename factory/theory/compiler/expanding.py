"""The operations of a product: a statement with many inputs becomes one operation for each further
input, in the forms of a plan, and each hand-over of a plan becomes an operation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from factory.support.errors import Position
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import NOPART, PAG, Assembly
from factory.theory.problem.plan import AS_WRITTEN, Plan
from factory.theory.problem.template import Template

RELAY = "relay"
"""The template of a hand-over."""

Join = tuple[str, Template, tuple[str, ...], Position | None]
"""An operation by its label, its template, its inputs in the order of the template, and where the
last of them is written."""


@dataclass(frozen=True, slots=True)
class Node:
    """An operation to compile: a node of the PAG, or one pile of a node with many inputs.

    Attributes:
        label: what it makes.
        template: its template.
        inputs: the labels of its inputs.
        dwell: how long it takes at its goals [s].
        size: number of operation instances of its subtree, itself included.
        position: where it is written.
        last: where its last input is written.
    """

    RELAY: ClassVar[str] = RELAY

    label: str
    template: Template
    inputs: tuple[str, ...]
    dwell: float
    size: int
    position: Position | None
    last: Position | None = None

    @classmethod
    def expand(
        cls, pag: PAG, templates: Mapping[str, Template], plan: Plan = AS_WRITTEN
    ) -> dict[str, Node]:
        """The operation instances of a product by label, each after its inputs, the product last;
        joins have the forms of a plan, and what it hands over is relayed. Inputs beyond those of a
        template are inserted one by one: `x = mate(a, b, c)` becomes `x/2 = mate(a, b)`,
        `x = insert(x/2, c)`."""
        nodes: dict[str, Node] = {}
        for assembly in pag.postorder():
            for label, template, inputs, last in _operations(assembly, templates, plan.forms):
                if template.brought:
                    inputs = tuple(_brought(nodes, template, inputs, templates))
                size, dwell = 1 + sum([nodes[x].size for x in inputs]), _dwell(template, assembly)
                nodes[label] = cls(label, template, inputs, dwell, size, assembly.position, last)
        nodes = _in_postorder(nodes, pag.root) if plan.forms else nodes
        return handed_over(nodes, plan.relays, templates)

    @classmethod
    def of_factory(cls, factory: Factory) -> dict[str, Node]:
        """The operation instances of a factory, for the first unit of a period."""
        nodes: dict[str, Node] = {}
        for number in sorted(range(len(factory.making)), key=factory.postorder.__getitem__):
            o = factory.operations[number]
            if o.turn == 0:
                size = 1 + sum(nodes[x].size for x in o.inputs)
                nodes[o.label] = cls(o.label, o.template, o.taken, o.dwell, size, o.position)
        return _in_postorder(nodes, factory.products[0])

    @staticmethod
    def relay_label(label: str, number: int) -> str:
        """Label after a hand-over, counted from 0."""
        return f"{label}/{RELAY}{number + 1}"

    @property
    def held(self) -> int:
        """The number of the input that the carrier holds before the operation, -1 for none."""
        held = self.template.held
        return -1 if held == NOPART else self.template.inputs.index(held)


def _brought(
    nodes: dict[str, Node], of: Template, inputs: tuple[str, ...], templates: Mapping[str, Template]
) -> Iterator[str]:
    """The inputs of an operation, those that are not its carrier's after their hand-over by the
    template that it asks for (`x/pick` for x), which is added to the nodes unless it is written."""
    for variable, label in zip(of.inputs, inputs, strict=False):
        node, by = nodes[label], templates.get(of.brought)
        if by is None or node.template is by or variable == of.held:
            yield label
            continue
        name = f"{label}/{by.name}"
        dwell = _dwell(by, Assembly(name, by.name, (label,)))
        nodes[name] = Node(name, by, (label,), dwell, node.size + 1, node.position)
        yield name


def handed_over(
    nodes: dict[str, Node], numbers: Mapping[str, int], templates: Mapping[str, Template]
) -> dict[str, Node]:
    """The operations with those of hand-overs, `numbers` of each label: `x/relay1`, `x/relay2`, and
    so on for x."""
    if not numbers:
        return nodes
    made, come = dict[str, Node](), dict[str, str]()
    for label, node in nodes.items():
        inputs = tuple(come[x] for x in node.inputs)
        size = 1 + sum(made[x].size for x in inputs)
        made[label] = replace(node, inputs=inputs, size=size)
        come[label] = label
        for number in range(numbers.get(label, 0)):
            name, before, size = Node.relay_label(label, number), (come[label],), size + 1
            relay = templates[RELAY]
            dwell = _dwell(relay, Assembly(name, RELAY, before))
            made[name] = Node(name, relay, before, dwell, size, node.position)
            come[label] = name
    return made


def delivered(label: str, plan: Plan) -> str:
    """Label with which the next operation takes it, after all its hand-overs."""
    number = plan.relays.get(label, 0)
    return Node.relay_label(label, number - 1) if number else label


def _in_postorder(nodes: Mapping[str, Node], root: str) -> dict[str, Node]:
    """The operations in the order of the tree: its leaves from the left, the root last."""
    order: list[str] = []
    stack = [root]
    while stack:  # backwards: an operation, then its last input
        order.append(stack.pop())
        stack += nodes[order[-1]].inputs
    return {label: nodes[label] for label in reversed(order)}


def _operations(
    assembly: Assembly, templates: Mapping[str, Template], forms: Mapping[str, int]
) -> Iterator[Join]:
    """The operations of a statement. If its template has a variant with a robot fewer (`instead`),
    each join has a form; as written, a third robot takes the first two inputs, and the rest are
    inserted."""
    template = of = templates[assembly.operation]
    taken, count = len(template.inputs), len(assembly.inputs)
    at = assembly.input_positions if len(assembly.input_positions) == count else ()
    pile = ""
    for number in range(taken, count + 1):
        label = assembly.label if number == count else f"{assembly.label}/{number}"
        inputs = assembly.inputs[:taken] if number == taken else (pile, assembly.inputs[number - 1])
        form = Plan.THIRD if number == taken else 0
        if template.instead and count > 1:
            form = forms.get(label, form)
        if form == Plan.THIRD:
            of = chosen = template
        elif number > taken and form == 0 and of.further:
            chosen = templates[of.further]
        else:
            of = chosen = templates[template.instead]
        last = at[number - 1] if at else assembly.position
        yield label, chosen, inputs[::-1] if form == 1 else inputs, last
        pile = label


def _dwell(template: Template, assembly: Assembly) -> float:
    wanted = template.law.dwell
    if isinstance(wanted, str):
        wanted = assembly.parameter(wanted, dict(template.parameters).get(wanted))  # type: ignore[assignment]
    return float(wanted) if isinstance(wanted, int | float) else 0.0
