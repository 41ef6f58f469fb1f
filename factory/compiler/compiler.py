"""Compile and CompileNode (paper, section 5): from a PAG to a factory F = (R, ~, N).

Guarantees: the net is composed of one gear per robot and is a gear net (Theorem 5.1);
`factory.nets.verify` proves it again, independently. What would break that is refused here. Linear
in the PAG.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

from factory.compiler.domains import check_prepared
from factory.nets.gears import Gear, GearNet
from factory.nets.petri import PetriNet, Place, Transition
from factory.nets.threaded import Redistribution, ThreadedNet
from factory.plant.approaches import Approach
from factory.plant.factory import Factory, Operation, Robot
from factory.problem.pag import NOPART, PAG, Assembly
from factory.problem.robot_types import Catalogue
from factory.problem.template import Template, variable_number
from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, InputError, Position, did_you_mean

DROPOFF = "dropoff"

LIFT = "lift"
"""The type of a robot that lowers what it brings."""


@dataclass(frozen=True, slots=True)
class Node:
    """An operation to compile: a node of the PAG, or one pile of a node with many inputs.

    `size` counts the operation instances of its subtree, itself included.
    """

    label: str
    template: Template
    inputs: tuple[str, ...]
    dwell: float
    size: int
    position: Position | None


@collector_paused()
def compile_pag(
    pag: PAG,
    templates: Mapping[str, Template],
    catalogue: Catalogue,
    approaches: Mapping[str, Approach] = MappingProxyType({}),
) -> Factory:
    """The factory that makes the product `pag`.

    `approaches`: how the inputs of operations (by label, see `expand`) can come together; where one
    is to be lowered, a lift brings it.

    Raises InputError with every TypeMismatch and NotPrepared found. Robots and operations are
    numbered as in the specification of the net: the output robot is r1; an operation numbers all
    its new robots at once, the input with fewest operation instances first, tools last.
    """
    nodes = expand(pag, templates)
    output = templates[DROPOFF]
    _check_types(nodes, output, catalogue)
    draft = _Draft(nodes, catalogue, approaches)
    draft.compile(pag, output)
    robots, operations = draft.robots(), tuple(draft.operations)
    troubles = draft.troubles or [*check_prepared(robots, operations)]
    if troubles:
        raise InputError(troubles)
    return Factory(pag, robots, operations, gear_net(robots, operations), tuple(draft.parents))


def _check_types(nodes: Mapping[str, Node], output: Template, catalogue: Catalogue) -> None:
    """Raises InputError (TypeMismatch) where a template asks for a type of robot that is not in the
    catalogue: once for each place in a template."""
    users = {node.template.name: (node.template, node.position) for node in nodes.values()}
    troubles = [
        Diagnostic(
            "TypeMismatch",
            f"{template.name} asks for a robot of unknown type '{wanted}'",
            template.robot_position(slot) or position,
            did_you_mean(wanted, list(catalogue.types), "robot types"),
        )
        for template, position in ((output, None), *users.values())
        for slot, wanted in enumerate(template.robots)
        if wanted not in catalogue.types
    ]
    if troubles:
        raise InputError(troubles)


def expand(pag: PAG, templates: Mapping[str, Template]) -> dict[str, Node]:
    """The operation instances by label, with the inputs of each beyond those of its template
    inserted one by one: `mate(a, b, c)` becomes `x/2 = mate(a, b)`, `x = insert(x/2, c)`."""
    nodes: dict[str, Node] = {}
    for assembly in pag.postorder():
        template = templates[assembly.operation]
        taken = len(template.inputs)
        inputs, spare = assembly.inputs[:taken], assembly.inputs[taken:]
        label = f"{assembly.label}/{taken}" if spare else assembly.label
        _add_node(nodes, label, template, inputs, assembly)
        for number, further in enumerate(spare, start=taken + 1):
            pile, label = label, f"{assembly.label}/{number}"
            if number == len(assembly.inputs):
                label = assembly.label
            _add_node(nodes, label, templates[template.further], (pile, further), assembly)
    return nodes


def _add_node(
    nodes: dict[str, Node],
    label: str,
    template: Template,
    inputs: tuple[str, ...],
    assembly: Assembly,
) -> None:
    size = 1 + sum(nodes[i].size for i in inputs)
    dwell = _dwell(template, assembly)
    nodes[label] = Node(label, template, inputs, dwell, size, assembly.position)


def _dwell(template: Template, assembly: Assembly) -> float:
    wanted = template.law.dwell
    if isinstance(wanted, str):
        wanted = assembly.parameter(wanted, dict(template.parameters).get(wanted))  # type: ignore[assignment]
    return float(wanted) if isinstance(wanted, int | float) else 0.0


class _Draft:
    """What CompileNode has allocated so far: operations with their parents and, per robot, its
    type, the position that made it necessary and its operations from the last of its cycle to the
    first."""

    def __init__(
        self,
        nodes: Mapping[str, Node],
        catalogue: Catalogue,
        approaches: Mapping[str, Approach],
    ) -> None:
        self.nodes, self.catalogue, self.approaches = nodes, catalogue, approaches
        self.types: list[str] = []
        self.births: list[Position | None] = []
        self.visits: list[list[int]] = []
        self.operations: list[Operation] = []
        self.parents: list[int] = []
        self.troubles: list[Diagnostic] = []

    def compile(self, pag: PAG, output: Template) -> None:
        """CompileNode(P, carrier) for every node in preorder, with a stack in place of recursion,
        and dropoff."""
        position = pag[pag.root].position
        carrier = self._new_robot(output.robots[0], position)
        stack: list[tuple[str, int, int]] = [(pag.root, carrier, -1)]
        while stack:
            label, robot, parent = stack.pop()
            operation = self._operation(self.nodes[label], robot)
            self.operations.append(operation)
            self.parents.append(parent)
            for robot in operation.robots:
                self.visits[robot].append(operation.index)
            brought = zip(operation.robots, operation.before, strict=True)
            inputs = sorted((r, x) for r, x in brought if x != NOPART)
            stack.extend((x, robot, operation.index) for robot, x in reversed(inputs))
        index = len(self.operations)
        last = Operation(index, DROPOFF, output, (carrier,), (pag.root,), (NOPART,), 0.0, position)
        self.operations.append(last)
        self.parents = [index, *self.parents[1:], -1]
        self.visits[carrier].insert(0, index)

    def robots(self) -> tuple[Robot, ...]:
        """The robots allocated."""
        return tuple(
            Robot(i, f"r{i + 1}", self.types[i], tuple(reversed(visits)), self.births[i])
            for i, visits in enumerate(self.visits)
        )

    def _new_robot(self, robot_type: str, position: Position | None) -> int:
        self.types.append(robot_type)
        self.births.append(position)
        self.visits.append([])
        return len(self.types) - 1

    def _operation(self, node: Node, carrier: int) -> Operation:
        """The instance of a node's template, with its new robots."""
        template, approach = node.template, self.approaches.get(node.label)
        before = tuple(NOPART if i < 0 else node.inputs[i] for i in _arguments(template.before))
        self._claim_carrier(node, carrier)
        return Operation(
            len(self.operations),
            node.label,
            template,
            self._allocate(node, carrier, before, approach.lowered if approach else ""),
            before,
            tuple(NOPART if label == NOPART else node.label for label in template.after),
            node.dwell,
            node.position,
            approach,
        )

    def _claim_carrier(self, node: Node, carrier: int) -> None:
        """The carrier takes the role T_j: its type becomes the more special of the two."""
        wanted, given = node.template.robots[node.template.carrier - 1], self.types[carrier]
        met = self.catalogue.meet(given, wanted)
        if met is None:
            message = (
                f"robot r{carrier + 1} carries '{node.label}' and must be a '{wanted}' for"
                f" {node.template.name}, but its next role asks for a '{given}'"
            )
            hint = f"use an operation whose carrier is a '{given}', or a type that extends both"
            self.troubles.append(Diagnostic("TypeMismatch", message, node.position, hint))
        else:
            self.types[carrier] = met

    def _allocate(
        self, node: Node, carrier: int, before: tuple[str, ...], lowered: str
    ) -> tuple[int, ...]:
        """r_1, ..., r_k: the carrier and the new robots, numbered smallest input first, tools last.
        The one that brings `lowered` is a lift."""
        template = node.template
        robots = {template.carrier - 1: carrier}

        def order(slot: int) -> tuple[int, int, int]:
            label = before[slot]
            if label == NOPART:
                return 1, 0, slot
            return 0, self.nodes[label].size, node.inputs.index(label)

        for slot in sorted({*range(len(template.robots))} - {*robots}, key=order):
            wanted = template.robots[slot]
            if lowered and before[slot] == lowered:
                wanted = self._lift(wanted, node)
            robots[slot] = self._new_robot(wanted, node.position)
        return tuple(robots[slot] for slot in range(len(template.robots)))

    def _lift(self, wanted: str, node: Node) -> str:
        """The type of a robot that takes the role of a `wanted` and can lower what it brings."""
        met = self.catalogue.meet(LIFT, wanted) if LIFT in self.catalogue.types else None
        if met is not None and self.catalogue.fits(met, LIFT):
            return met
        message = f"what '{node.label}' takes must be lowered, and a '{wanted}' has no lift"
        hint = "let the template ask for a 'dot', or the type extend 'lift'"
        self.troubles.append(Diagnostic("TypeMismatch", message, node.position, hint))
        return wanted


@cache
def _arguments(before: tuple[str, ...]) -> tuple[int, ...]:
    """For each label of a template's a the number of the input that it stands for, -1 for none."""
    variables = sorted({*before} - {NOPART}, key=variable_number)
    return tuple(-1 if label == NOPART else variables.index(label) for label in before)


def gear_net(robots: tuple[Robot, ...], operations: tuple[Operation, ...]) -> GearNet:
    """N: for each operation a start, an end and a place; for each robot a gear through them.

    Operation i has transitions 2i and 2i + 1 and place i; the wait places follow, robot by robot. A
    robot that is gone has no operations, and a gear without places.
    """
    transitions = tuple(
        Transition(f"{o.label}_{end}", o.position) for o in operations for end in ("s", "e")
    )
    places = [
        Place(
            o.label,
            (o.start,),
            (o.end,),
            o.template.name,
            "" if o.after[o.template.carrier - 1] == NOPART else o.label,
            len(o.robots),
            o.position,
        )
        for o in operations
    ]
    slots = [o.robots for o in operations]
    slot_of = [{robot: i for i, robot in enumerate(o.robots)} for o in operations]
    pairs: list[list[tuple[tuple[int, int], tuple[int, int]]]] = [[] for _ in transitions]
    gears = []
    for robot in robots:
        gear_places, gear_events = [], []
        several = (
            sum(operations[n].before[slot_of[n][robot.index]] == NOPART for n in robot.operations)
            > 1
        )
        for step, number in enumerate(robot.operations):
            before, operation = operations[robot.operations[step - 1]], operations[number]
            done, begun = before.end, operation.start
            slot = slot_of[number][robot.index]
            label = operation.before[slot]
            stays = label != NOPART and operation.after[slot] != NOPART
            wait = len(places)
            places.append(
                Place(
                    _wait_name(robot, label, operation, several),
                    (done,),
                    (begun,),
                    "hold" if stays else "wait",
                    label,
                    1,
                    operation.position,
                )
            )
            slots.append((robot.index,))
            pairs[begun].append(((wait, 0), (number, slot)))
            pairs[done].append(((before.place, slot_of[before.index][robot.index]), (wait, 0)))
            gear_places += [wait, number]
            gear_events += [done, begun]
        gears.append(Gear(robot.name, robot.type, tuple(gear_places), tuple(gear_events)))
    redistribution: tuple[Redistribution, ...] = tuple(tuple(sorted(p)) for p in pairs)
    net = ThreadedNet(PetriNet(transitions, tuple(places)), redistribution)
    return GearNet(net, tuple(gears), tuple(g.places[0] for g in gears if g.places), tuple(slots))


def _wait_name(robot: Robot, label: str, onward: Operation, several: bool) -> str:
    """What the place is called where a robot waits for an operation `onward`: `r2:part1`. One that
    comes home several times in its gear waits with nothing for each tour, `r2:nopart/part3`."""
    if label == NOPART and several:
        return f"{robot.name}:{label}/{onward.label}"
    return f"{robot.name}:{label}"
