"""The product assembly graph (PAG): a tree of labelled sub-assemblies (paper, section 4.1)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar

from factory.support.errors import Diagnostic, InputError, Position
from factory.support.settings import MOST_UNITS
from factory.support.showing import Pictured

NOPART = "nopart"
"""The label of a robot that carries nothing."""

RESERVED = frozenset({NOPART, "root", "mix", "parts", "dropoff"})

SHAPES = ("mesh", "box", "cylinder", "sphere")
"""Parameters that give a part a shape."""

MESHES = (".obj", ".stl", ".ply", ".glb")
"""Endings of the mesh files that a part may name."""

LABEL_HINT = "a label has letters, digits, '_', '-' and '.'"

_LABEL = re.compile(r"[^\s+;,()=<>{}~\"/]+")

Value = float | str | tuple[float, ...]
"""The value of a parameter: a number, a word or a vector."""


def is_label(word: str) -> bool:
    """Whether a word may be a label."""
    return _LABEL.fullmatch(word) is not None


@dataclass(frozen=True, slots=True)
class Parameter:
    """A keyword argument of an operation.

    Attributes:
        name: its name.
        value: its value.
        position: the place of its value in the text.
    """

    name: str
    value: Value
    position: Position | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True)
class Assembly:
    """A node of a PAG: `label = operation(inputs, parameters)`. A part has no inputs.

    Attributes:
        label: its name.
        operation: name of its template.
        inputs: labels that it joins.
        parameters: names and values.
        position: place of the label in the text; not compared.
        input_positions: places of the inputs; not compared.
    """

    label: str
    operation: str
    inputs: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    position: Position | None = field(default=None, compare=False)
    input_positions: tuple[Position, ...] = field(default=(), compare=False)

    def parameter(self, name: str, default: Value | None = None) -> Value | None:
        """The value of the keyword argument `name`, or `default`."""
        return next((p.value for p in self.parameters if p.name == name), default)


ANY_DEPTH = 1000.0
"""A depth that no overlap has [m]."""

ROUNDING = 1e-9
"""A depth is allowed that is larger by no more than this [m]."""


@dataclass(frozen=True, slots=True)
class AllowedOverlap:
    """An overlap that is meant, in the finished product, such as a press fit, or on the way of a
    part to its place, such as a snap fit.

    Attributes:
        depth: the most that is meant [m].
        parts: the two parts; nothing for any two.
        position: where it is written; an option has none. It does not count in comparisons.
    """

    depth: float
    parts: tuple[str, ...] = ()
    position: Position | None = field(default=None, compare=False)

    def covers(self, one: str, other: str) -> bool:
        """Whether it is about these two parts."""
        return not self.parts or {one, other} == {*self.parts}


def most_allowed(allowed: Iterable[AllowedOverlap], one: str, other: str) -> float:
    """The depth that two parts may overlap by [m], 0 where nothing is allowed of them."""
    return max((a.depth for a in allowed if a.covers(one, other)), default=0.0)


@dataclass(frozen=True, slots=True)
class Mix:
    """Several products of one floor: the `counts` of each that are made in a period, and their
    `sequence` in it, empty where it is to be chosen."""

    counts: tuple[tuple[str, int], ...]
    sequence: tuple[str, ...] = ()


@dataclass(frozen=True)
class PAG(Pictured):
    """A product assembly graph (section 4.1): one tree over its labels, in the order of the text.
    With a mix, a tree for each product; trees may share labels.

    Attributes:
        root: label of the product; of the first product of a mix.
        nodes: all nodes.
        count: the number in `N parts`; None without it.
        folder: where paths of meshes start.
        file: name of its file.
        allowed: overlaps that are meant.
        mix: the products and their sequence; None for one product.

    `factory.theory.lang.read_pag` checks that it is a tree.
    """

    RESERVED: ClassVar[frozenset[str]] = RESERVED
    SHAPES: ClassVar[tuple[str, ...]] = SHAPES
    MESHES: ClassVar[tuple[str, ...]] = MESHES
    is_label = staticmethod(is_label)

    root: str
    nodes: tuple[Assembly, ...]
    count: int | None = None
    folder: str = field(default=".", compare=False)
    file: str = field(default="<text>", compare=False)
    allowed: tuple[AllowedOverlap, ...] = ()
    mix: Mix | None = None

    def __repr__(self) -> str:
        parts = sum(1 for _ in self.parts())
        return f"<PAG {self.title}: {parts} parts, {len(self) - parts} operations, {self.file}>"

    def mixed(self, counts: tuple[tuple[str, int], ...]) -> PAG:
        """The graph of several products, so many of each in a period."""
        return replace(self, mix=Mix(counts))

    @cached_property
    def by_label(self) -> Mapping[str, Assembly]:
        """The nodes by label."""
        return MappingProxyType({node.label: node for node in self.nodes})

    def __getitem__(self, label: str) -> Assembly:
        return self.by_label[label]

    def __len__(self) -> int:
        return len(self.nodes)

    @property
    def products(self) -> tuple[str, ...]:
        """The labels of the products, one unless there is a mix."""
        return (self.root,) if self.mix is None else tuple(label for label, _ in self.mix.counts)

    def in_order(self, sequence: Sequence[str]) -> PAG:
        """The same with another sequence of its mix. Raises InputError (BadMix)."""
        faults = [f"'{word}' is no product" for word in sequence if word not in self.products]
        faults += [
            f"'{product}' is not in it" for product in self.products if product not in sequence
        ]
        if self.mix is None:
            faults = [f"'{self.root}' is the only product"]
        elif len(sequence) > MOST_UNITS:
            faults.append(f"a period of {len(sequence)} units; {MOST_UNITS} are the most")
        if faults:
            message = f"the sequence {', '.join(sequence)}: {faults[0]}"
            hint = f"--order takes the products {', '.join(self.products)}, each at least once"
            raise InputError(Diagnostic("BadMix", message, None, hint))
        counts = tuple((product, sequence.count(product)) for product in self.products)
        return replace(self, mix=Mix(counts, tuple(sequence)))

    @property
    def files(self) -> tuple[Path, ...]:
        """The file of its text, and those of its meshes."""
        named = (node.parameter("mesh") for node in self.parts())
        meshes = dict.fromkeys(str(mesh) for mesh in named if mesh)
        return Path(self.file), *(Path(self.folder) / mesh for mesh in meshes)

    @property
    def title(self) -> str:
        """The product in words: "truck", or "3 truck, 1 van" of a mix."""
        counts = self.mix.counts if self.mix else ()
        return ", ".join(f"{count} {label}" for label, count in counts) or self.root

    def parts(self) -> Iterator[Assembly]:
        """The leaves, in the order of the text."""
        return (node for node in self.nodes if not node.inputs)

    def postorder(self) -> Iterator[Assembly]:
        """Every node after its inputs, inputs in argument order, each product after its nodes that
        no earlier product has; without recursion."""
        seen: set[str] = set()
        stack = [(label, False) for label in reversed(self.products)]
        while stack:
            label, expanded = stack.pop()
            node = self.by_label[label]
            if expanded:
                yield node
            elif label not in seen:
                seen.add(label)
                stack.append((label, True))
                stack.extend((child, False) for child in reversed(node.inputs))

    @cached_property
    def is_shaped(self) -> bool:
        """Whether some part has a shape or a place of its own. The default boxes of a product in
        which none has can always slide: each sub-assembly is an interval of a path to and fro in a
        lattice, so the next interval goes on ahead of it along x and along y."""
        return any(p.name in (*SHAPES, "pos") for node in self.parts() for p in node.parameters)

    @cached_property
    def is_plain(self) -> bool:
        """Whether no part says more of its geometry than its colour: nothing can be wrong with
        it."""
        return all(p.name == "rgba" for node in self.parts() for p in node.parameters)

    @cached_property
    def insides(self) -> tuple[frozenset[str], ...]:
        """The labels of the parts of each product."""
        each = (self.product(label).parts() for label in self.products)
        return tuple(frozenset(part.label for part in parts) for parts in each)

    def most_allowed(self, one: str, other: str) -> float:
        """The depth that two parts may overlap by [m], 0 where nothing is allowed of them."""
        return most_allowed(self.allowed, one, other)

    def check_alone(self, option: str) -> None:
        """Raises InputError (BadMix) for a mix: an option is for one product."""
        if self.mix is not None:
            message = f"{option} is for one product, and there is a mix of {len(self.products)}"
            raise InputError(Diagnostic("BadMix", message, self[self.root].position))

    def product(self, label: str) -> PAG:
        """The PAG of one product of a mix."""
        alone = PAG(label, self.nodes, None, self.folder, self.file, self.allowed)
        return replace(alone, nodes=tuple(alone.postorder()))
