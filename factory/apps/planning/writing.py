"""From a planned tree to the files of a product: its PAG and its meshes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count
from math import ceil
from types import MappingProxyType
from typing import Any, Generic, TypeVar, Union

import numpy as np

from factory.api import PAG, Array, Assembly, Template, write_pag
from factory.apps.importing.draft import file_stem, label_of
from factory.apps.importing.part_maker import Placement
from factory.apps.planning.parts import InPlace
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.mating import matings
from factory.theory.compiler.expanding import expand
from factory.theory.problem.pag import AllowedOverlap, most_allowed

Unit = TypeVar("Unit", str, int)

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
    title = label_of(source.name) or "product"
    root = _free(chain([title], (f"{title}-{n}" for n in count(1))), taken)
    names = (f"sub{n}" for n in count(1))
    made, stack = list[Assembly](), [(root, tree)]
    while stack:
        label, below = stack.pop()
        if isinstance(below, Screwed):
            for screw in below.screws[::-1]:
                last = screw == below.screws[0] and isinstance(below.tree, str)
                pile = below.tree if last else _free(names, taken)
                made.append(Assembly(label, "screw", (str(pile), screw)))
                label = str(pile)
            below = below.tree
        if not isinstance(below, tuple):
            continue
        inputs = []
        for child in below:
            inputs.append(child if isinstance(child, str) else _free(names, taken))
            stack.append((inputs[-1], child))
        made.append(Assembly(label, "mate" if len(inputs) > 1 else "relay", tuple(inputs)))
    whole = [node for nodes in kept.values() for node in nodes if node.inputs]
    parts = [_turned(part.node, turn) for part in source.parts]
    nodes = (*made, *reversed(whole), *parts)
    pag = PAG(root, nodes, len(nodes), allowed=source.allowed)
    if allow or threaded:
        meant = _meant(source, pag, allow, templates, threaded)
        pag = replace(pag, allowed=(*source.allowed, *meant))
    name = file_stem(source.name)
    head = f"// {name}, planned{f' from {by}' if by else ''}\n"
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
    product = product_geometry(pag, source.files)
    units = {part.label: label for label, parts in source.units() for part in parts}
    pairs = [{*name.split(":")} for name in allow]
    deep: dict[tuple[str, str], float] = {}
    for pair in overlaps_of(product).pairs:
        is_thread = (pair.one in threaded) != (pair.other in threaded)
        needed = pair.depth > most_allowed(pag.allowed, pair.one, pair.other)
        if {units[pair.one], units[pair.other]} in pairs or (is_thread and needed):
            deep[pair.one, pair.other] = pair.depth
    judged = matings(expand(pag, templates), product).all if allow else ()
    for clash in (clash for mating in judged for clash in mating.clashes):
        both = {units[part] for part in clash.parts}
        if both in pairs or both & {*allow}:
            labels = next((p for p in deep if {*p} == {*clash.parts}), clash.parts)
            deep[labels] = max(clash.depth, deep.get(labels, 0.0))
    for labels, depth in deep.items():
        yield AllowedOverlap(ceil(1e5 * depth) / 1e5, labels)


def _free(names: Iterator[str], taken: set[str]) -> str:
    """The first of some names that no other node has; it is taken from now on."""
    label = next(name for name in names if name not in taken)
    taken.add(label)
    return label


def _turned(node: Assembly, turn: Array) -> Assembly:
    """A part after the product has been turned about the origin."""
    if np.array_equal(turn, np.eye(3)):
        return node
    values = {p.name: p.value for p in node.parameters}
    placed = Placement(turn, moved=True).parameters(values)
    others = [p for p in node.parameters if p.name not in PLACES]
    return replace(node, parameters=(*others[:1], *placed, *others[1:]))
