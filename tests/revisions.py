"""Random edits of products, and what stays of their factories."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from factory.apps.revise.inheriting import Inheritance, pairs_of
from factory.apps.revise.matching import matching
from factory.apps.revise.pairing import Pairing
from factory.apps.revise.pins import SAME
from factory.floor.layout.certificate import ALWAYS, Certificate
from factory.pipeline import all_templates
from factory.theory.compiler.compiler import compile_pag
from factory.theory.problem.pag import PAG, Assembly, Parameter
from factory.theory.problem.robot_types import load_catalogue

KINDS = ("change", "add", "drop", "swap", "tool", "rename")


def edited(
    pag: PAG, rng: random.Random, count: int, kinds: Sequence[str] = KINDS, height: float = 0.0
) -> PAG:
    """A product after so many random edits; itself where none of those drawn is possible. A part
    that is added is like another, and higher by `height` [m]."""
    nodes = {node.label: node for node in pag.nodes}
    for number in range(1, count + 1):
        _edit(nodes, pag.root, rng, rng.choice(kinds), number, height)
    return replace(pag, nodes=tuple(nodes.values()), count=None)


def _edit(
    nodes: dict[str, Assembly],
    root: str,
    rng: random.Random,
    kind: str,
    number: int,
    height: float,
) -> None:
    above = {label: node.label for node in nodes.values() for label in node.inputs}
    joins = [n.label for n in nodes.values() if n.operation == "mate" and len(n.inputs) > 1]
    match kind:
        case "change":
            label = rng.choice([n.label for n in nodes.values() if not n.inputs])
            others = [p for p in nodes[label].parameters if p.name not in ("density", "mass")]
            density = Parameter("density", 123.0 + number)
            nodes[label] = replace(nodes[label], parameters=(*others, density))
        case "add":
            label, new = rng.choice(joins), f"added{number}"
            like = nodes[rng.choice([n.label for n in nodes.values() if not n.inputs])]
            nodes[new] = replace(like, label=new, parameters=raised(like.parameters, height))
            nodes[label] = replace(nodes[label], inputs=(*nodes[label].inputs, new))
        case "drop" if any(len(nodes[label].inputs) > 2 for label in joins):
            label = rng.choice([label for label in joins if len(nodes[label].inputs) > 2])
            gone = [rng.choice(nodes[label].inputs[1:])]
            rest = tuple(x for x in nodes[label].inputs if x != gone[0])
            nodes[label] = replace(nodes[label], inputs=rest)
            while gone:
                gone += nodes.pop(gone.pop()).inputs
        case "swap" if joins:
            label = rng.choice(joins)
            inputs = [*nodes[label].inputs]
            if len(inputs) > 3:
                at = rng.randrange(2, len(inputs) - 1)
                inputs[at : at + 2] = inputs[at + 1], inputs[at]
                nodes[label] = replace(nodes[label], inputs=tuple(inputs))
        case "tool" if any(nodes[x].inputs for x in above):
            label, new = rng.choice([x for x in above if nodes[x].inputs]), f"pressed{number}"
            nodes[new] = Assembly(new, "press", (label,))
            _rewire(nodes, above[label], label, new)
        case "rename":
            label = rng.choice([x for x in nodes if x != root])
            new = f"{label}.new{number}"
            nodes[new] = replace(nodes.pop(label), label=new)
            _rewire(nodes, above[label], label, new)


def raised(parameters: Sequence[Parameter], height: float) -> tuple[Parameter, ...]:
    """The parameters of a part that is higher [m]; of one without a shape its own."""
    place = next((p.value for p in parameters if p.name == "pos"), (0.0, 0.0, 0.0))
    assert isinstance(place, tuple)
    x, y, z = place
    others = tuple(p for p in parameters if p.name != "pos")
    return (*others, Parameter("pos", (x, y, z + height))) if others else ()


def _rewire(nodes: dict[str, Assembly], label: str, old: str, new: str) -> None:
    inputs = tuple(new if x == old else x for x in nodes[label].inputs)
    nodes[label] = replace(nodes[label], inputs=inputs)


def shuffled(pag: PAG, rng: random.Random) -> PAG:
    """A product with all labels renamed and its statements in another order."""
    drawn = rng.sample(pag.nodes, len(pag.nodes))
    names = {node.label: f"x{number}" for number, node in enumerate(drawn)}
    nodes = tuple(
        replace(node, label=names[node.label], inputs=tuple(names[x] for x in node.inputs))
        for node in drawn
    )
    return replace(pag, root=names[pag.root], nodes=nodes)


def kept_share(pag: PAG, new: PAG) -> Counter[str]:
    """Of the robots of a product's factory how many there are (`old`), how many stay (`paired`),
    and of these how many keep their `program`, and their `contents` too."""
    templates, catalogue = all_templates(), load_catalogue()
    factories = (compile_pag(made, templates, catalogue) for made in (pag, new))
    pairing = Pairing(matching(pag, new), *factories)
    same = [robot for robot in pairing.robots if pairing.keeps_program(robot)]
    contents = sum(map(pairing.keeps_contents, same))
    names = ("old", "paired", "program", "contents")
    counts = (len(pairing.old.robots), len(pairing.robots), len(same), contents)
    return Counter(dict(zip(names, counts, strict=True)))


def refuted(
    mine: Inheritance, old: Certificate, new: Certificate, pairing: Pairing
) -> Iterator[str]:
    """What is wrong with an inheritance: an entry that is not in the old certificate, or is of
    something else. Uses nothing of how it was found."""
    if not old.holds:
        yield "the old certificate does not hold"
    for number, other in mine.regions.items():
        if not (0 <= number < len(new.regions) and 0 <= other < len(old.regions)):
            yield f"entry {number}: there is no such region"
            continue
        one, before = new.regions[number], old.regions[other]
        name = f"entry {number}, {one.label or 'a body'} of {new.robots[one.robot]}"
        away = np.array(one.box) - before.box - np.repeat(mine.shift, 2)
        if np.abs(away).max() > SAME or one.z != before.z:
            yield f"{name}: it is elsewhere than in the old certificate"
        if (one.layer, one.kind) != (before.layer, before.kind):
            yield f"{name}: it is of another kind"
        mode = pairing.operations.get(before.mode, ALWAYS) if before.mode >= 0 else ALWAYS
        if pairing.robots.get(before.robot) != one.robot or mode != one.mode:
            yield f"{name}: it is of another robot, or in another mode"
    kept = [r for n, r in enumerate(new.regions) if n in mine.regions]
    if (mine.pairs, mine.inherited) != (pairs_of([*new.regions]), pairs_of(kept)):
        yield "the pairs are miscounted"
