"""From drafts to a PAG: labels, and operations with the number of inputs that they take."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

from factory.importing.draft import MATE, DraftNode, ImportFaults, postorder
from factory.importing.labels import Labeller
from factory.lang.source import where
from factory.problem.pag import PAG, Assembly

Mates = Literal["many", "chain"]
"""How three or more inputs are mated: in one operation, or one after the other."""


def assemble(drafts: Sequence[DraftNode], faults: ImportFaults, mates: Mates = "many") -> PAG:
    """The PAG of drafts, of which the first is the product; sub-assemblies first, then parts.

    A mate of one input is replaced by that input. Raises InputError (DuplicateLabel) if two nodes
    have the same kept name.
    """
    order = postorder(drafts)
    made = [i for i in order if not (drafts[i].operation == MATE and len(drafts[i].inputs) == 1)]
    _refuse_twice(drafts, made, faults)
    labels = Labeller(drafts, made)
    label = {index: labels.of(drafts[index]) for index in made}
    for index in order:
        if index not in label:
            label[index] = label[drafts[index].inputs[0]]
    nodes: list[Assembly] = []
    for index in made:
        draft = drafts[index]
        inputs = [label[child] for child in draft.inputs]
        if mates == "chain" and draft.operation == MATE:
            nodes += _chain(label[index], inputs, labels)
        else:
            nodes.append(Assembly(label[index], draft.operation, tuple(inputs), draft.parameters))
    nodes.sort(key=lambda node: not node.inputs)
    return PAG(label[0], tuple(nodes), len(nodes))


def _refuse_twice(drafts: Sequence[DraftNode], made: Sequence[int], faults: ImportFaults) -> None:
    first: dict[str, DraftNode] = {}
    for draft in (drafts[index] for index in sorted(made) if drafts[index].kept):
        if draft.name in first:
            before = where(first[draft.name].position, draft.position)
            message = f"the name '{draft.name}' is used twice, first {before}"
            hint = "a part is in the product once: give each node a name of its own"
            faults.add("DuplicateLabel", message, draft.position, hint)
        first.setdefault(draft.name, draft)
    faults.raise_if_any()


def _chain(label: str, inputs: list[str], labels: Labeller) -> list[Assembly]:
    """Mates of two inputs each; the labels but the last one end in the number of inputs joined so
    far."""
    piles = [inputs[0], *(labels.within(label, n) for n in range(2, len(inputs))), label]
    steps = zip(pairwise(piles), inputs[1:], strict=True)
    return [Assembly(made, MATE, (pile, new)) for (pile, made), new in steps]
