"""Random families of products as values, for tests: a tree, and trees that were made of it by
edits of parts and sub-assemblies."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import count

from factory.theory.compiler.assigning import shared
from factory.theory.compiler.compiler import compile_pag
from factory.theory.compiler.mixing import lines_of_mix, turns_of
from factory.theory.lang.pag_reader import read_pag
from factory.theory.plant.factory import Factory
from factory.theory.problem.pag import PAG
from tests.pag_values import TEMPLATES, catalogue

LITTLE = """mix = 2 a, 1 b;
a = mate ( base, x, y ); b = mate ( base, z );
base = atomic(); x = atomic(); y = atomic(); z = atomic()"""
"""Two products of default boxes, which have a part in common."""


@dataclass(frozen=True)
class Tree:
    """A part, or an operation on trees."""

    label: str
    operation: str = "atomic"
    inputs: tuple[Tree, ...] = field(default=())

    def statements(self) -> Iterator[str]:
        """The statements of all its labels."""
        names = ", ".join(tree.label for tree in self.inputs)
        yield f"{self.label} = {self.operation} ( {names} )"
        for tree in self.inputs:
            yield from tree.statements()


def random_tree(rng: random.Random, parts: int, numbers: Iterator[int]) -> Tree:
    """A tree of so many parts, some of whose sub-assemblies are welded."""
    trees = [Tree(f"p{next(numbers)}") for _ in range(parts)]
    while len(trees) > 1:
        size = min(len(trees), rng.choice([2, 2, 3]))
        at = rng.randrange(len(trees) - size + 1)
        operation = rng.choice(["mate", "insert", "insert"]) if size == 2 else "mate"
        made = Tree(f"s{next(numbers)}", operation, tuple(trees[at : at + size]))
        if rng.random() < 0.25:
            made = Tree(f"w{next(numbers)}", "weld", (made,))
        trees[at : at + size] = [made]
    return trees[0]


def edited(rng: random.Random, tree: Tree, numbers: Iterator[int]) -> Tree:
    """A tree with parts replaced, left out or added; labels above an edit are new."""
    if not tree.inputs:
        return tree if rng.random() > 0.3 else Tree(f"v{next(numbers)}")
    inputs = [edited(rng, below, numbers) for below in tree.inputs]
    if len(inputs) > 2 and rng.random() < 0.4:
        inputs.pop()
    if tree.operation == "mate" and rng.random() < 0.25:
        inputs.append(Tree(f"v{next(numbers)}"))
    if tuple(inputs) == tree.inputs:
        return tree
    return Tree(f"{tree.label}v{next(numbers)}", tree.operation, tuple(inputs))


def family_of(trees: Sequence[Tree], sequence: Sequence[str]) -> PAG:
    """The PAG of a mix of trees."""
    statements = dict.fromkeys(x for tree in trees for x in tree.statements())
    text = ";\n".join([f"mix = {', '.join(sequence)}", *statements])
    return read_pag(text, TEMPLATES, "family.pag")


def random_family(seed: int, products: int = 2, parts: int = 5) -> PAG | None:
    """A family of products and a sequence of two to four units; None for one product."""
    rng, numbers = random.Random(seed), count()
    trees = [random_tree(rng, rng.randint(2, parts), numbers)]
    trees += [edited(rng, trees[0], numbers) for _ in range(products - 1)]
    labels = [tree.label for tree in trees]
    if len({*labels}) < products or not all(tree.inputs for tree in trees):
        return None
    sequence = labels + [rng.choice(labels) for _ in range(rng.randint(0, 4 - products))]
    rng.shuffle(sequence)
    return family_of(trees, sequence)


def mixed_factory(pag: PAG, sequence: Sequence[str] = ()) -> Factory:
    """The factory of a mix, without geometry; in another sequence than written if one is given."""
    assert pag.mix is not None
    forest = compile_pag(pag, TEMPLATES, catalogue())
    turns = turns_of(forest, lines_of_mix(forest, catalogue()), sequence or pag.mix.sequence)
    return shared(forest, forest.plan.then(turns), catalogue())
