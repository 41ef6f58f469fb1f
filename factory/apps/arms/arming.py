"""From a product to the factory of a cell: carriers that bring first parts along, and arms that
place all others on them.

Every join becomes a `place`, whose second input an arm lowers. A sub-assembly is built on a carrier
of its own, from which an arm takes it (`pick`). The robots that bring what is placed are one arm or
two, whose tours follow each other in the order of the joins, so the net is live (Theorem 18).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from factory.api import PAG, Assembly, Diagnostic, Factory, InputError, Plan, Project, read_template
from factory.apps.arms.body import STEM_MASS, mass_of
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.crew import RAILS, dealt
from factory.apps.arms.model import ArmModel

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

PICK = """
pick = (R, j, ~, <a; b>, F) where
  R = < dot, {kind} >;
  j = 2;
  ~ = {{}};
  <a; b> = < LAB1, nopart; nopart, LAB2 >;
  F = navigation on W to ( A1 + 2r, B2 ) within eps;
"""
"""The operation in which it takes a sub-assembly from a carrier, which stands by then."""

SHOW = """
show = (R, j, ~, <a; b>, F) where
  R = < dot >;
  j = 1;
  ~ = {{}};
  <a; b> = < LAB1; LAB2 >;
  F = navigation on W to ( A1 + 2r ) within eps;
"""
"""The operation in which a carrier brings a sub-assembly from a tool to where an arm takes it."""

TAKEN, SHOWN = "taken", "shown"
"""What is added to the label of a sub-assembly."""

ACROSS = 0
"""The axis x of a product, along which its carrier goes."""

TRIES = 12
"""How many other orders of the inputs of joins are tried."""


def armed(project: Project, model: ArmModel, arms: Sequence[CellArm] = (CellArm(),)) -> Project:
    """The project in which some arms of a kind place all parts but the first. Raises InputError
    (NoCell) for a mix, and where an arm would have nothing to do."""
    if project.pag.mix is not None:
        message = f"a cell makes one product, not a mix: {project.pag.title}"
        raise InputError(Diagnostic("NoCell", message, None, RAILS))
    made = _lowering(project, model)
    crew = tuple(dealt(made.compiled, model.kind, arms))
    return made.with_plan(Plan(turns=(crew,), lifts=frozenset()))


def _lowering(project: Project, model: ArmModel) -> Project:
    """The project with a place for each join, its inputs in an order in which as many as possible
    can be lowered: sub-assemblies first, else as they are written, and what is stuck earlier."""
    orders = dict[str, Sequence[str]]()
    made, tries = _placing(project, model, orders), TRIES
    stuck, better = _not_lowered(made), True
    while stuck and better and tries:
        better = False
        for node, order in _others(project.pag, orders, stuck):
            other = _placing(project, model, {**orders, node: order})
            tries -= 1
            if len(left := _not_lowered(other)) < len(stuck):
                made, stuck, better = other, left, True
                orders[node] = order
                break
            if not tries:
                break
    return _from_sides(made)


def _from_sides(project: Project) -> Project:
    """The project in which what is not lowered comes along x where it cannot as well along y."""
    if project.matings is None:
        return project
    waits = {label for label, approach in project.approaches.items() if approach.kind != "lower"}
    other = replace(project, axes=dict.fromkeys(waits, ACROSS)).matings
    assert other is not None
    better = {
        one.label: ACROSS
        for one, same in zip(other.all, project.matings.all, strict=True)
        if one.label in waits and one.slide > same.slide
    }
    return replace(project, axes=better) if better else project


def from_one_side(factory: Factory) -> Factory:
    """A factory to whose joins what is not lowered comes from one side: ahead of a carrier, or on
    the arm's own side of its line, if that is admissible."""
    operations = tuple(
        replace(o, approach=o.approach.on(max(o.approach.sides)))
        if o.approach is not None and o.lowered < 0
        else o
        for o in factory.operations
    )
    return replace(factory, operations=operations)


def _others(
    pag: PAG, orders: Mapping[str, Sequence[str]], stuck: Sequence[tuple[str, str]]
) -> Iterator[tuple[str, Sequence[str]]]:
    """Other orders of the inputs of nodes, one of which is stuck in the one of `orders`."""
    for node, part in stuck:
        inputs = orders.get(node, _piles_first(pag, node))
        if inputs != pag[node].inputs:
            yield node, pag[node].inputs
        rest = [label for label in inputs if label != part]
        for place in range(inputs.index(part) - 1, 0, -1):
            yield node, (*rest[:place], part, *rest[place:])


def piles_of(pag: PAG) -> list[str]:
    """The sub-assemblies that arms take, as they stand there."""
    return [node.inputs[0] for node in pag.nodes if node.operation == "pick"]


def on_rails(project: Project, pag: PAG, pile: str) -> Project:
    """The project that makes a sub-assembly of a cell's PAG, or all of it, on rails, with an
    `insert` for each `place`, and parts presented as they are placed."""
    sources = {node.label: node.inputs[0] for node in pag.nodes if node.operation in MOVES}
    nodes = dict[str, Assembly]()
    for node in pag.nodes:
        if node.label not in sources:
            inputs = tuple(_source(sources, label) for label in node.inputs)
            operation = "insert" if node.operation == "place" else node.operation
            kept = tuple(one for one in node.parameters if one.name != "fed")
            nodes[node.label] = replace(
                node, operation=operation, inputs=inputs, input_positions=(), parameters=kept
            )
    within, stack = set[str](), [_source(sources, pile)]
    while stack:
        within.add(label := stack.pop())
        stack += nodes[label].inputs
    chosen = tuple(node for node in nodes.values() if node.label in within)
    return project.with_pag(replace(pag, root=_source(sources, pile), nodes=chosen, count=None))


MOVES = "pick", "show"
"""Operations that a cell adds to a PAG."""


def _source(sources: Mapping[str, str], label: str) -> str:
    """What a label is of that is only moved."""
    while label in sources:
        label = sources[label]
    return label


def _placing(project: Project, model: ArmModel, orders: Mapping[str, Sequence[str]]) -> Project:
    """The project with a place for each join; `orders` of inputs other than the usual one."""
    kind, catalogue = model.kind, project.catalogue
    pag = replace(project.pag, nodes=tuple(_nodes(project.pag, orders)))
    moved = float(model.chain.inertia.mass.sum()) + STEM_MASS
    masses, joints = (mass_of(model), moved), model.chain.joints
    texts = {"place": PLACE, "pick": PICK, "show": SHOW}
    added = {
        name: read_template(text.format(kind=kind), f"{kind}.op") for name, text in texts.items()
    }
    lowered = {node.label: node.inputs[-1] for node in pag.nodes if len(node.inputs) > 1}
    return replace(
        project,
        pag=pag,
        templates={**project.templates, **added},
        catalogue=catalogue.with_chain(kind, model.file, "dot", masses, joints),
        lowered=lowered,
    )


def _not_lowered(project: Project) -> list[tuple[str, str]]:
    """The joins whose last input cannot be lowered: the node of the PAG and its input."""
    approaches, stuck = project.approaches, list[tuple[str, str]]()
    for node in project.pag.nodes:
        approach = approaches.get(node.label)
        if len(node.inputs) > 1 and approach and approach.lowered != node.inputs[-1]:
            stuck.append((node.label.partition("/")[0], node.inputs[-1].partition("/")[0]))
    return stuck


def _piles_first(pag: PAG, label: str) -> tuple[str, ...]:
    """The inputs of a node, sub-assemblies first."""
    inputs = pag[label].inputs
    return tuple(sorted(inputs, key=lambda one: not pag[one].inputs))


def _nodes(pag: PAG, orders: Mapping[str, Sequence[str]]) -> Iterator[Assembly]:
    """The nodes with two inputs at most: `x = mate ( a, b, c )` is placed one by one."""
    for node in pag.nodes:
        if len(node.inputs) < 2:
            yield node
            continue
        pile, *parts = orders.get(node.label, _piles_first(pag, node.label))
        for number, part in enumerate(parts, start=2):
            last = number == len(node.inputs)
            label = node.label if last else f"{node.label}/{number}"
            if pag[part].inputs:
                steps = [(f"{part}/{TAKEN}", "pick")]
                if len(pag[part].inputs) == 1:
                    steps.insert(0, (f"{part}/{SHOWN}", "show"))
                for step, operation in steps:
                    yield replace(
                        node,
                        label=step,
                        operation=operation,
                        inputs=(part,),
                        input_positions=(),
                        parameters=(),
                    )
                    part = step
            yield replace(
                node, label=label, operation="place", inputs=(pile, part), input_positions=()
            )
            pile = label
