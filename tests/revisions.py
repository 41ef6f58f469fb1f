"""Random edits of products, and what stays of their factories."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from factory.apps.revise.inheriting import Inheritance
from factory.apps.revise.matching import matching
from factory.apps.revise.pairing import Pairing
from factory.floor.layout.exclusions import coordinated
from factory.floor.layout.layout import Layout
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


def refuted(mine: Inheritance, old: Layout, new: Layout, pairing: Pairing) -> Iterator[str]:
    """What is wrong with an inheritance: an entry that is not in the old certificate, is of other
    machines, or whose circuit does not keep them apart in the new net. Uses nothing of how it was
    found."""
    assert old.certificate is not None and new.certificate is not None
    if not old.certificate.holds:
        yield "the old certificate does not hold"
    before, after = old.certificate.apart.excluded, new.certificate.apart.excluded
    net, words = coordinated(new).net, dict[str, str]()
    for a, b in pairing.operations.items():
        words[pairing.old.operations[a].label] = pairing.new.operations[b].label
    for a, b in pairing.robots.items():
        words[pairing.old.robots[a].name] = pairing.new.robots[b].name

    def named(name: str) -> str:
        parts = (" ".join(words.get(w, w) for w in part.split(" ")) for part in name.split(":"))
        return ":".join(parts)

    place = {one.name: n for n, one in enumerate(net.net.places)}
    for number, other in mine.entries.items():
        if not (0 <= number < len(after) and 0 <= other < len(before)):
            yield f"entry {number}: there is no such entry"
            continue
        one, its = after[number], before[other]
        name = f"entry {number}, of {' and '.join(one.machines)}"
        sides = sorted(zip(map(named, its.machines), map(named, its.places), strict=True))
        if sides != sorted(zip(one.machines, one.places, strict=True)):
            yield f"{name}: it is of other machines, or places"
        circuit = [place.get(named(each), -1) for each in its.circuit]
        onward = (*circuit[1:], circuit[0])
        follow = all(net.right[p] == net.left[q] for p, q in zip(circuit, onward, strict=True))
        if -1 in circuit or not follow or sum(net.tokens[p] for p in circuit) != 1:
            yield f"{name}: its circuit is none of the new net"
    if mine.pairs != len(after):
        yield "the pairs are miscounted"
