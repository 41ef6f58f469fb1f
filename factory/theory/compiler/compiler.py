"""Compile and CompileNode (paper, section 5): from a PAG to a factory F = (R, ~, N).

Guarantees: the net is composed of one gear per robot and is a gear net (Theorem 5.1);
`factory.theory.nets.verify` proves it again, independently. What would break that is refused here.
Linear in the PAG.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, InputError, Position, did_you_mean
from factory.theory.compiler.assigning import beside, gear_net
from factory.theory.compiler.domains import check_prepared
from factory.theory.compiler.expanding import Node
from factory.theory.compiler.turning import check_turned
from factory.theory.plant.approaches import Approach
from factory.theory.plant.factory import NO_PARENT, Factory
from factory.theory.plant.gripping import with_closing
from factory.theory.plant.operation import Operation
from factory.theory.plant.robot import Robot
from factory.theory.problem.ids import OperationId, RobotId
from factory.theory.problem.pag import NOPART, PAG
from factory.theory.problem.plan import AS_WRITTEN, Plan
from factory.theory.problem.robot_types import LIFT, Catalogue
from factory.theory.problem.template import Template

DROPOFF = "dropoff"


@collector_paused()
def compile_pag(
    pag: PAG,
    templates: Mapping[str, Template],
    catalogue: Catalogue,
    approaches: Mapping[str, Approach] = MappingProxyType({}),
    plan: Plan = AS_WRITTEN,
) -> Factory:
    """The factory that makes the product `pag` with the forms and hand-overs of a plan, and a robot
    for each tour. The products of a mix are compiled apart: each makes a unit in a period.

    `approaches`: how the inputs of operations (by label, see `Node.expand`) can come together;
    where one is to be lowered, a lift brings it.

    Raises InputError with every TypeMismatch and NotPrepared found. Robots and operations are
    numbered as in the specification of the net: the output robot is r1; an operation numbers all
    its new robots at once, the input with fewest operation instances first, tools last.
    """
    if pag.mix is not None:
        products = map(pag.product, pag.products)
        return beside(
            pag, [compile_pag(x, templates, catalogue, approaches, plan) for x in products]
        )
    made = _allocated(pag, Node.expand(pag, templates, plan), templates, catalogue, approaches)
    return _composed(pag, *made, plan)


@collector_paused()
def compile_nodes(
    pag: PAG,
    nodes: dict[str, Node],
    templates: Mapping[str, Template],
    catalogue: Catalogue,
    approaches: Mapping[str, Approach],
    plan: Plan,
) -> Factory:
    """The factory with these operations, which make the product `pag`. Raises InputError as
    `compile_pag` does."""
    return _composed(pag, *_allocated(pag, nodes, templates, catalogue, approaches), plan)


Allocated = tuple[tuple[Robot, ...], tuple[Operation, ...], tuple[OperationId, ...]]
"""Robots, operations and their parents."""


def _allocated(
    pag: PAG,
    nodes: dict[str, Node],
    templates: Mapping[str, Template],
    catalogue: Catalogue,
    approaches: Mapping[str, Approach],
) -> Allocated:
    """The robots of the operations that make a product. Raises InputError."""
    output = templates[DROPOFF]
    _check_types(nodes, output, catalogue)
    draft = _Draft(nodes, catalogue, approaches)
    draft.compile(pag, output)
    robots = draft.robots()
    operations = with_closing(draft.operations, robots)
    troubles = draft.troubles or [
        *check_prepared(robots, operations),
        *check_turned(pag, robots, operations),
    ]
    if troubles:
        raise InputError(troubles)
    return robots, operations, tuple(draft.parents)


def _composed(
    pag: PAG,
    robots: tuple[Robot, ...],
    operations: tuple[Operation, ...],
    parents: tuple[OperationId, ...],
    plan: Plan,
) -> Factory:
    """The factory of these robots: nothing else of their allocation is kept while its net, which
    takes most, is made."""
    net, made = gear_net(robots, operations), replace(plan, turns=(), lifts=None, names=())
    return Factory(pag, robots, operations, net, parents, made)


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


class _Draft:
    """The allocations of CompileNode so far: operations with their parents and, for each robot, its
    type, the source position that required it and its operations, the last of its cycle first."""

    def __init__(
        self,
        nodes: dict[str, Node],
        catalogue: Catalogue,
        approaches: Mapping[str, Approach],
    ) -> None:
        self.nodes, self.catalogue, self.approaches = nodes, catalogue, approaches
        self.types: list[str] = []
        self.births: list[Position | None] = []
        self.visits: list[list[OperationId]] = []
        self.operations: list[Operation] = []
        self.parents: list[OperationId] = []
        self.troubles: list[Diagnostic] = []

    def compile(self, pag: PAG, output: Template) -> None:
        """CompileNode(P, carrier) for every node in preorder, with a stack in place of recursion,
        and dropoff."""
        position, product = pag[pag.root].position, next(reversed(self.nodes))
        carrier = self._new_robot(output.robots[0], position)
        stack: list[tuple[str, RobotId, OperationId]] = [(product, carrier, NO_PARENT)]
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
        index = OperationId(len(self.operations))
        last = Operation(index, DROPOFF, output, (carrier,), (product,), (NOPART,), 0.0, position)
        self.operations.append(last)
        self.parents = [index, *self.parents[1:], NO_PARENT]
        self.visits[carrier].insert(0, index)

    def robots(self) -> tuple[Robot, ...]:
        """The robots allocated."""
        return tuple(
            Robot(
                RobotId(i),
                f"r{i + 1}",
                self.catalogue[self.types[i]],
                tuple(reversed(visits)),
                self.births[i],
            )
            for i, visits in enumerate(self.visits)
        )

    def _new_robot(self, robot_type: str, position: Position | None) -> RobotId:
        self.types.append(robot_type)
        self.births.append(position)
        self.visits.append([])
        return RobotId(len(self.types) - 1)

    def _operation(self, node: Node, carrier: RobotId) -> Operation:
        """The instance of a node's template, with its new robots."""
        template, approach = node.template, self.approaches.get(node.label)
        taken = dict(zip(template.inputs, node.inputs, strict=True))
        before = tuple([taken.get(variable, NOPART) for variable in template.before])
        self._claim_carrier(node, carrier)
        return Operation(
            OperationId(len(self.operations)),
            node.label,
            template,
            self._allocate(node, carrier, before, approach.lowered if approach else ""),
            before,
            tuple([NOPART if label == NOPART else node.label for label in template.after]),
            node.dwell,
            node.position,
            approach,
        )

    def _claim_carrier(self, node: Node, carrier: int) -> None:
        """The carrier takes the role T_j: its type becomes the more special of the two."""
        wanted, present = node.template.robots[node.template.carrier - 1], self.types[carrier]
        met = self.catalogue.meet(present, wanted)
        if met is None:
            message = (
                f"robot r{carrier + 1} carries '{node.label}' and must be a '{wanted}' for"
                f" {node.template.name}, but its next role asks for a '{present}'"
            )
            hint = f"use an operation whose carrier is a '{present}', or a type that extends both"
            self.troubles.append(Diagnostic("TypeMismatch", message, node.position, hint))
        else:
            self.types[carrier] = met

    def _allocate(
        self, node: Node, carrier: RobotId, before: tuple[str, ...], lowered: str
    ) -> tuple[RobotId, ...]:
        """r_1, ..., r_k: the carrier and the new robots, numbered smallest input first, tools last.
        The one that brings `lowered` is a lift."""
        template, holder = node.template, node.template.carrier - 1
        robots = [carrier] * len(template.robots)

        def order(slot: int) -> tuple[int, int, int]:
            label = before[slot]
            if label == NOPART:
                return 1, 0, slot
            return 0, self.nodes[label].size, node.inputs.index(label)

        new = [slot for slot in range(len(robots)) if slot != holder]
        for slot in sorted(new, key=order) if new[1:] else new:
            wanted = template.robots[slot]
            if lowered and before[slot] == lowered:
                wanted = self._lift(wanted, node)
            robots[slot] = self._new_robot(wanted, node.position)
        return tuple(robots)

    def _lift(self, wanted: str, node: Node) -> str:
        """The type of a robot that fills the role of a `wanted` and lowers what it brings."""
        if self.catalogue[wanted].lowers:
            return wanted
        met = self.catalogue.meet(LIFT, wanted) if LIFT in self.catalogue.types else None
        if met is not None and self.catalogue.fits(met, LIFT):
            return met
        message = f"what '{node.label}' takes must be lowered, and a '{wanted}' has no lift"
        hint = "let the template ask for a 'dot', or the type extend 'lift'"
        self.troubles.append(Diagnostic("TypeMismatch", message, node.position, hint))
        return wanted
