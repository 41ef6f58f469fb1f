"""Labels and file names from the names in a file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from factory.importing.draft import DraftNode
from factory.lang.words import is_label
from factory.problem.pag import RESERVED

_FOREIGN = re.compile(r"[^\w.\-]+")
_LONGEST = 80


def label_of(name: str) -> str:
    """The label that resembles a name most: other characters become `-`; "" if nothing remains.

    >>> label_of("Left wing (2x4).ldr")
    'Left-wing-2x4-.ldr'
    """
    if is_label(name) and name not in RESERVED and not _FOREIGN.search(name):
        return name[:_LONGEST]
    label = _FOREIGN.sub("-", name)[:_LONGEST].strip("-.")
    return f"{label}-" if label in RESERVED else label


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
