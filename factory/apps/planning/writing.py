"""From a planned tree to the files of a product: its PAG and its meshes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from types import MappingProxyType
from typing import Any, Generic, TypeVar, Union

import numpy as np

from factory.api import (
    PAG,
    AllowedOverlap,
    Assembly,
    DrawnSolids,
    Node,
    Template,
    product_geometry,
    write_pag,
)
from factory.apps.importing.draft import file_stem, label_of
from factory.apps.importing.part_maker import Placement
from factory.apps.planning.parts import InPlace
from factory.apps.planning.titles import Titles
from factory.floor.mating.mating import matings
from factory.support.arrays import Array

Unit = TypeVar("Unit", bound=str | int)

Tree = Union[str, tuple["Tree", ...], "Screwed[str]"]
"""The label of a part or of a sub-tree that is kept, or what is mated: two trees or more, of which
the first two are mated and each further one is inserted; a single tree is handed over to another
robot; or what screws are driven into."""


@dataclass(frozen=True, slots=True)
class Screwed(Generic[Unit]):
    """A tree, and the screws that are driven into it, one after the other: labels, or numbers of
    units."""

    tree: Any
    screws: tuple[Unit, ...]


PLACES = ("pos", "quat")


def screws_in(tree: Tree) -> tuple[str, ...]:
    """The labels of the screws of a tree."""
    if isinstance(tree, str):
        return ()
    inside = (tree.tree,) if isinstance(tree, Screwed) else tree
    mine = tree.screws if isinstance(tree, Screwed) else ()
    return (*(screw for below in inside for screw in screws_in(below)), *mine)


def screw_lines(tree: Tree, kinds: Mapping[str, str]) -> tuple[tuple[str, ...], ...]:
    """The equal screws of a tree that come to one sub-assembly one after the other: one robot
    brings those of a line, and one driver turns them; `kinds`: those of parts."""
    if isinstance(tree, str):
        return ()
    inside = (tree.tree,) if isinstance(tree, Screwed) else tree
    lines = [line for below in inside for line in screw_lines(below, kinds)]
    alike: dict[str, list[str]] = {}
    for screw in tree.screws if isinstance(tree, Screwed) else ():
        alike.setdefault(kinds.get(screw, screw), []).append(screw)
    return (*lines, *(tuple(line) for line in alike.values() if len(line) > 1))


@dataclass(frozen=True, slots=True)
class PlannedProduct:
    """A product as `plan` writes it: its PAG, the contents of its files by path in the output
    folder, the PAG's first, and the inputs of each node of the tree by label."""

    pag: PAG
    files: Mapping[str, bytes] = field(repr=False)


def planned_product(
    source: InPlace,
    tree: Tree,
    orientation: Array | None = None,
    by: str = "",
    allow: Sequence[str] = (),
    templates: Mapping[str, Template] = MappingProxyType({}),
    threaded: Collection[str] = (),
) -> PlannedProduct:
    """The product that a tree makes of a source's parts, turned by a rotation (3, 3) about the
    origin. `by` is said in the first line of the PAG. Of units, or pairs `a:b`, that `allow`
    has, what they pass through is allowed as deep as it is; so are the threads that `threaded`
    parts, which are screws, have in common with parts that are none. Only those of the
    `templates` that the package ships are used: `mate`, with its further inputs inserted,
    `screw` and `relay`, besides what kept sub-trees name."""
    turn = np.eye(3) if orientation is None else orientation
    kept = {keep.label: keep.nodes for keep in source.kept}
    taken = {part.label for part in source.parts}
    taken |= {node.label for nodes in kept.values() for node in nodes}
    titles = Titles(source, taken)
    root = titles.free(label_of(source.name) or "product")
    made, stack = list[Assembly](), [(root, tree)]
    while stack:
        label, below = stack.pop()
        if isinstance(below, Screwed):
            inside = leaves(below.tree)
            for number, screw in reversed([*enumerate(below.screws)]):
                earlier = (*inside, *below.screws[: number - 1])
                if number:
                    pile = titles.joined(earlier, below.screws[number - 1 : number])
                else:
                    pile = _title(titles, below.tree)
                made.append(Assembly(label, "screw", (pile, screw)))
                label = pile
            below = below.tree
        if not isinstance(below, tuple):
            continue
        inputs = []
        for child in below:
            inputs.append(_title(titles, child))
            stack.append((inputs[-1], child))
        made.append(Assembly(label, "mate" if len(inputs) > 1 else "relay", tuple(inputs)))
    whole = [node for nodes in kept.values() for node in nodes if node.inputs]
    parts = _in_rows([_turned(part.node, turn) for part in source.parts])
    nodes = (*made, *reversed(whole), *parts)
    pag = PAG(root, nodes, allowed=source.allowed)
    if allow or threaded:
        meant = _meant(source, pag, allow, templates, threaded)
        pag = replace(pag, allowed=(*source.allowed, *meant))
    name = file_stem(source.name)
    head = f"// {name}: {len(parts)} parts, planned{f' from {by}' if by else ''}\n"
    text = (head + write_pag(pag)).encode()
    return PlannedProduct(pag, {f"{name}.pag": text, **source.files})


def _meant(
    source: InPlace,
    pag: PAG,
    allow: Sequence[str],
    templates: Mapping[str, Template],
    threaded: Collection[str],
) -> Iterator[AllowedOverlap]:
    """How deep units that may pass through others do so on their ways, and pairs `a:b`, and
    `threaded` parts with others, also when finished, up to a hundredth of a millimetre more."""
    product = product_geometry(pag, source.files, decomposed=bool(allow))
    units = {part.label: label for label, parts in source.units() for part in parts}
    pairs = [{*name.split(":")} for name in allow]
    deep: dict[tuple[str, str], float] = {}
    for pair in DrawnSolids.overlaps(product).pairs:
        is_thread = (pair.one in threaded) != (pair.other in threaded)
        needed = pair.depth > pag.most_allowed(pair.one, pair.other)
        if {units[pair.one], units[pair.other]} in pairs or (is_thread and needed):
            deep[pair.one, pair.other] = pair.depth
    judged = matings(Node.expand(pag, templates), product).all if allow else ()
    for clash in (clash for mating in judged for clash in mating.clashes):
        both = {units[part] for part in clash.parts}
        if both in pairs or both & {*allow}:
            labels = next((p for p in deep if {*p} == {*clash.parts}), clash.parts)
            deep[labels] = max(clash.depth, deep.get(labels, 0.0))
    for labels, depth in deep.items():
        yield AllowedOverlap(ceil(1e5 * depth) / 1e5, labels)


def leaves(tree: Unit | tuple[Any, ...] | Screwed[Unit]) -> tuple[Unit, ...]:
    """The units of a tree: its base first, then in the order in which they come."""
    if isinstance(tree, str | int):
        return (tree,)
    if isinstance(tree, tuple):
        return tuple(unit for below in tree for unit in leaves(below))
    return (*leaves(tree.tree), *tree.screws)


def _title(titles: Titles, tree: Tree) -> str:
    """The label of a sub-tree."""
    if isinstance(tree, str):
        return tree
    if isinstance(tree, Screwed):
        *before, last = tree.screws
        return titles.joined((*leaves(tree.tree), *before), (last,))
    if len(tree) == 1:
        return titles.passed(leaves(tree))
    *piled, came = tree
    return titles.joined(leaves(tuple(piled)), leaves(came))


def _in_rows(parts: Sequence[Assembly]) -> list[Assembly]:
    """The parts, of which those that are copies of each other have their places last, so that a
    text has them in one statement."""
    alike = Counter(_but_for_place(part) for part in parts)
    return [
        replace(part, parameters=(*rest, place))
        if place is not None and alike[_but_for_place(part)] > 1
        else part
        for part in parts
        for rest in [tuple(p for p in part.parameters if p.name != "pos")]
        for place in [next((p for p in part.parameters if p.name == "pos"), None)]
    ]


def _but_for_place(part: Assembly) -> tuple[object, ...]:
    return tuple(p for p in part.parameters if p.name != "pos")


def _turned(node: Assembly, turn: Array) -> Assembly:
    """A part after the product has been turned about the origin."""
    if np.array_equal(turn, np.eye(3)):
        return node
    values = {p.name: p.value for p in node.parameters}
    placed = Placement(turn, moved=True).parameters(values)
    others = [p for p in node.parameters if p.name not in PLACES]
    return replace(node, parameters=(*others[:1], *placed, *others[1:]))
