"""What stays of factories in the next revision of a product, over random edits.

python -m benches.revisions FILE.pag ...                      # trees: robots, programs, contents
python -m benches.revisions --pin [--only add] FILE.pag ...   # layouts: place, module, cycle time
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from factory.apps.revise.matching import matching
from factory.apps.revise.pairing import Pairing
from factory.apps.revise.pins import StayingRobot
from factory.apps.revise.revision import revised
from factory.engine.timing.timed import pace
from factory.floor.robots.catalogue import load_catalogue
from factory.pipeline import read
from factory.support.errors import RunError
from factory.theory.compiler.compiler import compile_pag
from factory.theory.lang.pag_reader import load_pag
from factory.theory.lang.template_reader import all_templates
from factory.theory.problem.pag import PAG, Assembly, Parameter

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


def main(files: Sequence[str]) -> None:
    """Print the table: 20 random edits each of 1, 3 and 10, and with all labels renamed."""
    for file in files:
        pag, row = load_pag(file, all_templates()), []
        for count, renamed in ((1, False), (3, False), (10, False), (0, True), (1, True)):
            total = Counter[str]()
            for seed in range(20):
                rng = random.Random(seed * 31 + count)
                new = edited(pag, rng, count)
                total += kept_share(pag, shuffled(new, rng) if renamed else new)
            shares = (
                f"{100 * total[name] / total['old']:.0f}"
                for name in ("paired", "program", "contents")
            )
            row.append(f"{count} edits{', renamed' * renamed}: {', '.join(shares)} %")
        print(f"{pag.root}: {'; '.join(row)}", flush=True)


def pinned(files: Sequence[str], kinds: Sequence[str], count: int = 20) -> None:
    """Print what single edits leave of layouts: in place, of the same module, and the cycle time
    over that of a layout made afresh."""
    for file in files:
        old = read(file)
        height = round(float(old.product.high[2] - old.product.low[2]), 3)
        kept, ratios, less, seed = list[StayingRobot](), list[float](), 0, 700
        while len(ratios) < count and seed < 900:
            new = edited(old.pag, random.Random(seed), 1, kinds, height)
            seed += 1
            if new == old.pag:
                continue
            try:
                fresh = replace(old, pag=new).layout
            except RunError:
                continue
            found = revised(old, replace(old, pag=new))
            less += found.pinned != "all"
            kept += found.kept
            cycles = (pace(made, old.settings)[0].seconds for made in (found.new.layout, fresh))
            ratios.append(next(cycles) / next(cycles))
        place, module = (
            100 * sum(getattr(robot, grade) for robot in kept) / len(kept)
            for grade in ("place", "module")
        )
        print(
            f"{old.pag.root}, {len(ratios)} edits ({', '.join(kinds)}): in place {place:.1f} %,"
            f" module {module:.1f} %, cycle {sum(ratios) / len(ratios):.3f} of afresh, at most"
            f" {max(ratios):.3f}; {less} with less pinned",
            flush=True,
        )


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["--pin"]:
        only = words[2:3] if words[1:2] == ["--only"] else []
        pinned(words[3:] if only else words[1:], only or KINDS)
    else:
        main(words)
