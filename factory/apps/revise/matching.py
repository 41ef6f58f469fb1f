"""Matching of two assembly trees: which labels of a product are which of its next revision.

A mapping is one to one and keeps ancestors. Equal is what has an equal *digest*: of a label that of
its operation, its parameters and the digests of its inputs, whatever they are called; of a part
that of its shape and its place, up to one translation of the whole product.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from factory.api import PAG, Assembly, Parameter, Value
from factory.support.cache import digest
from factory.support.files import MESH, read_bytes

Shift = tuple[float, float, float]
"""A translation (x, y, z) [m]."""

NOWHERE: Shift = (0.0, 0.0, 0.0)

DIGITS = 9
"""Places of parts are compared to so many decimals of a metre."""


@dataclass(frozen=True)
class Matching:
    """The labels of `old` with those of `new` that they are (`labels`); `shift`: by how much the
    common parts of `new` lie elsewhere than in `old` [m]."""

    old: PAG
    new: PAG
    shift: Shift
    labels: Mapping[str, str] = field(repr=False)
    digests: tuple[Mapping[str, str], Mapping[str, str]] = field(repr=False)

    def is_equal(self, label: str) -> bool:
        """Whether a label of the old product is one of the new, of an equal digest."""
        new = self.labels.get(label)
        return new is not None and self.digests[0][label] == self.digests[1][new]

    @cached_property
    def gone(self) -> list[str]:
        """The labels of the old product that are none of the new one."""
        return [node.label for node in self.old.nodes if node.label not in self.labels]

    @cached_property
    def added(self) -> list[str]:
        """The labels of the new product that are none of the old one."""
        kept = {*self.labels.values()}
        return [node.label for node in self.new.nodes if node.label not in kept]

    @cached_property
    def renamed(self) -> dict[str, str]:
        """The labels of the old product that are called otherwise in the new one."""
        return {old: new for old, new in self.labels.items() if old != new}

    @cached_property
    def changed(self) -> dict[str, str]:
        """The parts that have another shape or place, and the labels that are made by another
        operation or with other parameters."""
        return {old: new for old, new in self.labels.items() if self._is_changed(old, new)}

    @cached_property
    def reordered(self) -> dict[str, str]:
        """The labels whose inputs that stay are joined in another order."""
        labels, reordered = self.labels, dict[str, str]()
        for old, new in labels.items():
            before = [labels.get(x, "") for x in self.old[old].inputs]
            stay = [y for y in self.new[new].inputs if y in before]
            if stay != [y for y in before if y in stay]:
                reordered[old] = new
        return reordered

    def _is_changed(self, old: str, new: str) -> bool:
        if self.is_equal(old):
            return False
        one, other = self.old[old], self.new[new]
        if not (one.inputs and other.inputs):
            return True
        values = [{p.name: p.value for p in node.parameters} for node in (one, other)]
        return one.operation != other.operation or values[0] != values[1]


def matching(old: PAG, new: PAG) -> Matching:
    """The matching of two products, of inputs of mapped labels among each other from the root on:
    first those of equal digest and name, then of equal digest, of equal name and operation, of the
    largest overlap. What has no partner while one of its inputs has one is stepped over. Near
    linear, but for the overlaps of deep trees."""
    shift = common_shift(old, new)
    digests = label_digests(old), label_digests(new, shift)
    labels = _Matcher(old, new, digests).labels()
    return Matching(old, new, shift, labels, digests)


def label_digests(pag: PAG, shift: Shift = NOWHERE) -> dict[str, str]:
    """The digest of each label of a product whose parts lie elsewhere by a `shift` [m]."""
    meshes, digests = dict[Value, str](), dict[str, str]()
    for node in pag.postorder():
        values = sorted((p.name, _content(pag, p, meshes, shift)) for p in node.parameters)
        if not node.inputs and not any(name == "pos" for name, _ in values):
            values.append(("pos", _less(NOWHERE, shift)))
        digests[node.label] = digest(node.operation, values, [digests[x] for x in node.inputs])
    return digests


def common_shift(old: PAG, new: PAG) -> Shift:
    """The translation from the old product to the new that most parts of equal shape agree on; none
    where none is better [m]."""
    shapes = [_by_shape(pag) for pag in (old, new)]
    votes = Counter(
        _less(place, before)
        for shape, places in shapes[0].items()
        for before, place in zip(places, shapes[1].get(shape, ()), strict=False)
    )
    best = max(votes, key=votes.__getitem__, default=NOWHERE)
    return best if votes[best] > votes[NOWHERE] else NOWHERE


def shifted(pag: PAG, shift: Shift) -> PAG:
    """The product with its parts elsewhere by a shift [m]."""
    if not any(shift):
        return pag
    nodes = tuple(node if node.inputs else _moved(node, shift) for node in pag.nodes)
    return replace(pag, nodes=nodes)


def _moved(node: Assembly, shift: Shift) -> Assembly:
    place = _less(_place(node), _less(NOWHERE, shift))
    others = tuple(p for p in node.parameters if p.name != "pos")
    return replace(node, parameters=(*others, Parameter("pos", place))) if others else node


def _by_shape(pag: PAG) -> dict[str, list[Shift]]:
    """The places of parts that have a shape, by the digest of that."""
    meshes, places = dict[Value, str](), defaultdict[str, list[Shift]](list)
    for part in pag.parts():
        shaped = [p for p in part.parameters if p.name != "pos"]
        values = sorted((p.name, _content(pag, p, meshes, NOWHERE)) for p in shaped)
        if values:
            places[digest(values)].append(_place(part))
    return places


def _content(pag: PAG, parameter: Parameter, meshes: dict[Value, str], shift: Shift) -> object:
    """What a parameter says: of a mesh the digest of its file, of a place that without the
    shift."""
    value = parameter.value
    if parameter.name == "pos" and isinstance(value, tuple):
        return _less(value, shift)
    if parameter.name != "mesh":
        return value
    if value not in meshes:
        try:
            meshes[value] = digest(read_bytes(Path(pag.folder) / str(value), MESH))
        except OSError:
            meshes[value] = str(value)
    return meshes[value]


def _place(node: Assembly) -> Shift:
    place = node.parameter("pos", NOWHERE)
    assert isinstance(place, tuple)
    return place[0], place[1], place[2]


def _less(one: Sequence[float], other: Sequence[float]) -> Shift:
    x, y, z = (round(a - b, DIGITS) + 0.0 for a, b in zip(one, other, strict=True))
    return x, y, z


Test = Callable[[str, str], bool]


class _Matcher:
    """Looks for the labels of one product among those of another."""

    def __init__(
        self, old: PAG, new: PAG, digests: tuple[Mapping[str, str], Mapping[str, str]]
    ) -> None:
        self.old, self.new, (self.before, self.after) = old, new, digests
        self.bags: tuple[dict[str, Counter[str]], ...] = ({}, {})
        self.tests: tuple[Test, ...] = (
            lambda x, y: x == y and self.before[x] == self.after[y],
            lambda x, y: self.before[x] == self.after[y],
            lambda x, y: x == y and old[x].operation == new[y].operation,
        )

    def labels(self) -> dict[str, str]:
        """The mapping."""
        mapping = dict[str, str]()
        stack = [([self.old.root], [self.new.root])]
        while stack:
            for x, y in self._pairs(*stack.pop()):
                mapping[x] = y
                if self.old[x].inputs or self.new[y].inputs:
                    stack.append(([*self.old[x].inputs], [*self.new[y].inputs]))
        return mapping

    def _pairs(self, left: list[str], right: list[str]) -> Iterator[tuple[str, str]]:
        """The pairs of labels of two lists, or of what is below those that are stepped over."""
        yield from self._alike(left, right)
        while left and right:
            best, x, y = max(
                ((self._overlap(x, y), x, y) for x in left for y in right), key=lambda way: way[0]
            )
            if best <= 0:
                break
            below_y = max((self._overlap(x, z) for z in self.new[y].inputs), default=0)
            below_x = max((self._overlap(z, y) for z in self.old[x].inputs), default=0)
            one, other = self.old[x], self.new[y]
            is_nested = (below_x == best) != (below_y == best)
            if one.operation == other.operation and not is_nested:
                yield x, y
                left.remove(x)
                right.remove(y)
            elif below_y >= below_x:
                right.remove(y)
                right += other.inputs
            else:
                left.remove(x)
                left += one.inputs
            yield from self._alike(left, right)
        parts = [[x for x in left if not self.old[x].inputs]]
        parts.append([y for y in right if not self.new[y].inputs])
        yield from zip(*parts, strict=False)

    def _alike(self, left: list[str], right: list[str]) -> Iterator[tuple[str, str]]:
        """The pairs that pass a test, the strictest first; both are taken from the lists."""
        for test in self.tests:
            for x in [*left]:
                y = next((y for y in right if test(x, y)), None)
                if y is not None:
                    yield x, y
                    left.remove(x)
                    right.remove(y)

    def _overlap(self, x: str, y: str) -> int:
        """How many labels below two are of equal digest."""
        one, other = self._bag(0, x), self._bag(1, y)
        if len(one) > len(other):
            one, other = other, one
        return sum(min(count, other[key]) for key, count in one.items() if key in other)

    def _bag(self, which: int, label: str) -> Counter[str]:
        """The digests of all labels below one, itself included."""
        if label not in self.bags[which]:
            pag, digests = ((self.old, self.before), (self.new, self.after))[which]
            self.bags[which][label] = Counter(digests[x] for x in below(pag, label))
        return self.bags[which][label]


def below(pag: PAG, label: str) -> list[str]:
    """A label and all below it; of equal sub-trees in the same order."""
    labels = [label]
    for one in labels:
        labels += pag[one].inputs
    return labels
