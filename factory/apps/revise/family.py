"""A family: two products as one text, in which what is equal is written once.

Equal are sub-trees of equal digest, whatever they are called, up to one translation of the second
product. A label that both have with different content gets `.b` in the second.
"""

from __future__ import annotations

import os
from collections import defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path

from factory.api import PAG, Assembly, Diagnostic, InputError
from factory.apps.revise.matching import Matching, below, matching, shifted

Renamed = dict[str, str]
"""What the labels of a product are called in the family."""


@dataclass(frozen=True)
class Family:
    """The text of two products as a `pag` with a mix; `names`: what the labels of the second are
    called in it; `common`: those that both have; `matching`: of the two as they were."""

    pag: PAG
    names: Renamed = field(repr=False)
    common: tuple[str, ...]
    matching: Matching = field(repr=False)

    @property
    def renamed(self) -> Renamed:
        """The common labels that have another name in the second product."""
        return {old: new for old, new in self.names.items() if old != new and new in self.common}


def family(one: PAG, other: PAG, counts: tuple[int, int], folder: Path) -> Family:
    """The family of two products, of which so many are made in a period, for a file in a folder.
    Raises InputError: BadMix for a product that is a mix, or part of the other."""
    for pag in (one, other):
        pag.check_alone("factory mix")
    matched = matching(one, other)
    x, y, z = matched.shift
    moved = shifted(other, (-x, -y, -z))
    labels = _common(matched)
    names = _names(one, moved, labels)
    common = tuple(names[label] for label in (n.label for n in moved.nodes) if label in labels)
    for pag, root in ((one, one.root), (moved, names[moved.root])):
        if root in common:
            message = f"'{pag.root}' is a sub-assembly of the other product, or is equal to it"
            raise InputError(Diagnostic("BadMix", message, pag[pag.root].position))
    nodes = [_relocated(node, one.folder, folder) for node in one.nodes]
    nodes += [
        replace(
            _relocated(node, other.folder, folder),
            label=names[node.label],
            inputs=tuple(names[label] for label in node.inputs),
        )
        for node in moved.nodes
        if node.label not in labels
    ]
    renamed = (replace(a, parts=tuple(names[part] for part in a.parts)) for a in other.allowed)
    allowed = (*one.allowed, *renamed)
    file = str(folder / "family.pag")
    every = PAG(one.root, tuple(nodes), None, str(folder), file, tuple(dict.fromkeys(allowed)))
    made = every.mixed(((one.root, counts[0]), (names[other.root], counts[1])))
    return Family(made, names, common, matched)


def _common(matched: Matching) -> Renamed:
    """The labels of the second product that are equal to one of the first, from the root on: first
    as the products are matched, then wherever there is an equal one."""
    old, new, (before, after) = matched.old, matched.new, matched.digests
    mapped = {y: x for x, y in matched.labels.items() if matched.is_equal(x)}
    pool, taken, common = defaultdict[str, list[str]](list), set[str](), Renamed()
    for node in old.nodes:
        pool[before[node.label]].append(node.label)
    for is_mapped in (True, False):
        stack = [new.root]
        while stack:
            label = stack.pop()
            if label in common:
                continue
            tried = [mapped[label]] if is_mapped and label in mapped else []
            tried = tried if is_mapped else pool[after[label]]
            twin = next((x for x in tried if taken.isdisjoint(below(old, x))), None)
            if twin is None:
                stack += new[label].inputs
                continue
            taken |= {*below(old, twin)}
            common |= dict(zip(below(new, label), below(old, twin), strict=True))
    return common


def _names(one: PAG, other: PAG, labels: Renamed) -> Renamed:
    names, taken = {**labels}, {*one.by_label}
    for node in other.nodes:
        if node.label not in labels:
            name = node.label
            while name in taken:
                name += ".b"
            names[node.label] = name
            taken.add(name)
    return names


def _relocated(node: Assembly, old: str, new: Path) -> Assembly:
    """A node whose mesh, if it has one, is found from another folder."""
    parameters = tuple(
        replace(p, value=Path(os.path.relpath(Path(old) / str(p.value), new)).as_posix())
        if p.name == "mesh"
        else p
        for p in node.parameters
    )
    return replace(node, parameters=parameters)
