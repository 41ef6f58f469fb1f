"""From a product to the factory of a cell: a carrier that brings the first part along, and an arm
that places all others on it.

Every join becomes a `place`, whose second input an arm lowers. The robots that bring those are one
arm, whose tours follow each other in the order of the joins, so the net is live (Theorem 18).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from factory.api import PAG, Assembly, Catalogue, Diagnostic, Factory, InputError, Plan, Project
from factory.apps.arms.body import STEM_MASS, mass_of
from factory.apps.arms.model import ArmModel
from factory.theory.lang.template_reader import read_template
from factory.theory.problem.robot_bodies import CARRIAGE, WAY, RobotAxis, RobotBody
from factory.theory.problem.robot_types import RobotType

RAILS = "leave out --arm: rails make it"

PLACE = """
place = (R, j, ~, <a; b>, F) where
  R = < dot, {kind} >;
  j = 1;
  ~ = {{ S1 = A2 }};
  <a; b> = < LAB1, LAB2; LAB3, nopart >;
  F = navigation on W to ( S1 + 2r, A2 + 2r ) within eps;
  further = place;
  failure = {{ residual > 5e-4 : stop }};
"""
"""The operation in which an arm of a kind lowers what it has fetched onto what a carrier brings."""


def robot_type(model: ArmModel) -> RobotType:
    """The robot type of an arm: a dot whose axis moves all joints of its chain."""
    moves = tuple((joint, joint) for joint in model.chain.joints)
    axis = RobotAxis(WAY, float(model.chain.inertia.mass.sum()) + STEM_MASS, moves=moves)
    return RobotType(model.kind, model.file, RobotBody(CARRIAGE, mass_of(model), (axis,)), "dot")


def armed(project: Project, model: ArmModel, arms: int = 1) -> Project:
    """The project in which some arms of a kind place all parts but the first, by turns. Raises
    InputError (NoCell) where two sub-assemblies are joined."""
    if project.pag.mix is not None:
        message = f"a cell makes one product, not a mix: {project.pag.title}"
        raise InputError(Diagnostic("NoCell", message, None, RAILS))
    kind, catalogue, pag = model.kind, project.catalogue, _placing(project.pag)
    types = {**catalogue.types, kind: robot_type(model)}
    templates = {**project.templates, "place": read_template(PLACE.format(kind=kind), f"{kind}.op")}
    lowered = {node.label: node.inputs[-1] for node in pag.nodes if len(node.inputs) > 1}
    made = replace(
        project, pag=pag, templates=templates, catalogue=Catalogue(types), lowered=lowered
    )
    return made.with_plan(Plan(turns=(tuple(_crew(made.compiled, kind, arms)),), lifts=frozenset()))


def _crew(factory: Factory, kind: str, arms: int) -> Iterator[int]:
    """The robot (index) that does the tour of each robot of a factory: the carrier its own, arms by
    turns what is placed."""
    others = [robot.index for robot in factory.robots if robot.type != kind]
    placing = [robot for robot in factory.robots if robot.type == kind]
    order = sorted(placing, key=lambda robot: factory.postorder[robot.operations[-1]])
    turn = {robot.index: number % arms for number, robot in enumerate(order)}
    for robot in factory.robots:
        if robot.index in turn:
            yield len(others) + turn[robot.index]
        else:
            yield others.index(robot.index)


def _placing(pag: PAG) -> PAG:
    """The tree with a place for each join, the sub-assembly first."""
    return replace(pag, nodes=tuple(_nodes(pag)))


def _nodes(pag: PAG) -> Iterator[Assembly]:
    """The nodes with two inputs at most: `x = mate ( a, b, c )` is placed one by one."""
    for node in pag.nodes:
        if len(node.inputs) < 2:
            yield node
            continue
        piles = [label for label in node.inputs if pag[label].inputs]
        if len(piles) > 1:
            message = f"'{node.label}' joins the sub-assemblies {', '.join(map(repr, piles))}"
            message = f"{message}; a cell adds part by part"
            raise InputError(Diagnostic("NoCell", message, node.position, RAILS))
        pile, *parts = (*piles, *(label for label in node.inputs if label not in piles))
        for number, part in enumerate(parts, start=2):
            last = number == len(node.inputs)
            label = node.label if last else f"{node.label}/{number}"
            yield replace(
                node, label=label, operation="place", inputs=(pile, part), input_positions=()
            )
            pile = label
