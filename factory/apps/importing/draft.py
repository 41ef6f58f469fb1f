"""A product as its file describes it, before it is a PAG: nodes with the indices of their inputs;
and the PAG of them: labels, and operations with the number of inputs that they take."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Literal

from factory.api import (
    PAG,
    AllowedOverlap,
    Assembly,
    Diagnostic,
    DrawnSolids,
    InputError,
    Parameter,
    Product,
)
from factory.support.errors import Position
from factory.support.texts import where

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


_FOREIGN = re.compile(r"[^\w.\-]+")
_LONGEST = 80


def label_of(name: str) -> str:
    """The label that resembles a name most: other characters become `-`; "" if nothing remains.

    >>> label_of("Left wing (2x4).ldr")
    'Left-wing-2x4-.ldr'
    """
    if PAG.is_label(name) and name not in PAG.RESERVED and not _FOREIGN.search(name):
        return name[:_LONGEST]
    label = _FOREIGN.sub("-", name)[:_LONGEST].strip("-.")
    return f"{label}-" if label in PAG.RESERVED else label


def file_stem(name: str) -> str:
    """A file name that is valid on every system: ASCII letters, digits, `_`, `-` and `.`.

    >>> file_stem("../../s\\\\3001 b")
    's-3001-b'
    """
    return re.sub(r"[^A-Za-z0-9_.\-]+", "-", name)[:_LONGEST].strip("-.") or "mesh"


class Labeller:
    """Assigns a unique label to every node: kept names are unchanged, names of several nodes are
    numbered, nodes without a name become `part1`, `sub1`."""

    def __init__(self, drafts: Sequence[DraftNode], order: Iterable[int]) -> None:
        self.drafts = drafts
        self.taken = {drafts[index].name for index in order if drafts[index].kept}
        named = (label_of(drafts[index].name) for index in order if not drafts[index].kept)
        self.shared = Counter(named)
        self.numbers: dict[str, Iterator[int]] = {}

    def of(self, draft: DraftNode) -> str:
        """The label of a node; to be called once for each."""
        if draft.kept:
            return draft.name
        stem = label_of(draft.name)
        if not stem:
            return self._numbered("part" if draft.is_part else "sub")
        if self.shared[stem] > 1 or stem in self.taken:
            return self._numbered(f"{stem}-")
        self.taken.add(stem)
        return stem

    def _numbered(self, stem: str) -> str:
        numbers = self.numbers.setdefault(stem, iter(range(1, 10**9)))
        label = next(name for n in numbers if (name := f"{stem}{n}") not in self.taken)
        self.taken.add(label)
        return label

    def within(self, label: str, number: int) -> str:
        """The label of the first `number` inputs of `label` when they are mated."""
        name = f"{label}.{number}"
        if name in self.taken:
            return self._numbered(f"{name}-")
        self.taken.add(name)
        return name


PART, MATE = "atomic", "mate"

MOST_NODES = 100_000
"""The most parts and sub-assemblies of a product; a larger file is a mistake, or an attack."""

SHOWN = 20
"""The most errors of one product that are reported."""


@dataclass(slots=True)
class DraftNode:
    """A part or sub-assembly. `inputs`: indices in the list of drafts, of which the first is the
    product; empty for a part. `name`: that in the file, "" for none; a `kept` name is a label
    chosen by the user, which no other node may have."""

    name: str
    position: Position
    operation: str = MATE
    inputs: list[int] = field(default_factory=list)
    parameters: tuple[Parameter, ...] = ()
    kept: bool = False

    @property
    def is_part(self) -> bool:
        return self.operation == PART


@dataclass(slots=True)
class ImportFaults:
    """The errors and warnings of one product's files."""

    diagnostics: list[Diagnostic] = field(default_factory=list)
    warnings: list[Diagnostic] = field(default_factory=list)

    def add(self, code: str, message: str, position: Position, hint: str) -> None:
        """Note an error: what was found, where, and what would have been valid."""
        self.diagnostics.append(Diagnostic(code, message, position, hint))

    def warn(self, code: str, message: str, position: Position, hint: str, many: str) -> None:
        """Note a warning; `many`: the text for several of its kind."""
        self.warnings.append(Diagnostic(code, message, position, hint, many))

    def check_used_once(self, what: str, places: Iterable[Position]) -> None:
        """Note every place but the first that puts the same part in the same place (UsedTwice)."""
        first, *others = sorted(places, key=_key)
        for position in others:
            where = f"line {first.line}" if first.line != position.line else "this line"
            message = f"{what} is where {where} already places it"
            hint = "give each copy its own place, or remove one"
            self.add("UsedTwice", message, position, hint)

    def raise_if_any(self) -> None:
        """Raise one InputError with the first errors, if there are any. Errors that differ only in
        their positions are merged."""
        groups: dict[tuple[str, str], list[Diagnostic]] = {}
        for diagnostic in sorted(self.diagnostics, key=lambda d: _key(d.position)):
            groups.setdefault((diagnostic.code, diagnostic.message), []).append(diagnostic)
        errors = [_once(alike) for alike in groups.values()]
        if len(errors) > SHOWN:
            message = f"and {len(errors) - SHOWN} more errors"
            errors = [*errors[:SHOWN], Diagnostic(errors[-1].code, message)]
        if errors:
            raise InputError(errors)


def _once(alike: list[Diagnostic]) -> Diagnostic:
    """The first of several equal diagnostics, with the number of others."""
    places = len({d.position for d in alike}) - 1
    more = f" (and in {places} more place{'s' * (places > 1)})" if places else ""
    return replace(alike[0], message=alike[0].message + more)


def _key(at: Position | None) -> tuple[str, int, int]:
    """The sort key of a position: file, line and column."""
    return (at.file, at.line, at.column) if at else ("", 0, 0)


def postorder(drafts: Sequence[DraftNode]) -> list[int]:
    """The indices of all nodes below the first, each after its inputs."""
    order, stack = [], [(0, False)]
    while stack:
        index, expanded = stack.pop()
        if expanded or not drafts[index].inputs:
            order.append(index)
        else:
            stack.append((index, True))
            stack.extend((child, False) for child in reversed(drafts[index].inputs))
    return order


def too_many(position: Position) -> InputError:
    """The error of a product that is too large."""
    message = f"the product has more than {MOST_NODES} parts and sub-assemblies"
    hint = "import its sub-assemblies one by one"
    return InputError(Diagnostic("TooLarge", message, position, hint))


EVERYWHERE = 5e-4
"""The depth of overlaps in a drawing without fits [m]."""


def everywhere(product: Product) -> tuple[AllowedOverlap, ...]:
    """The allowance for a drawing without fits, such as an LDraw model: any two parts may overlap
    by up to 0.5 mm. Empty if no overlap needs it."""
    needed = any(pair.depth <= EVERYWHERE for pair in DrawnSolids.overlaps(product).pairs)
    return (AllowedOverlap(EVERYWHERE),) if needed else ()
