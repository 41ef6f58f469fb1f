"""What of a tree's sub-assemblies stays together by itself, and what needs a hand or glue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from factory.apps.planning.blocking import Blocking
from factory.apps.planning.cannot import Units
from factory.apps.planning.exact import Tree
from factory.apps.planning.writing import Screwed, leaves


def sub_assemblies(tree: Tree) -> Iterator[tuple[Units, Units, bool]]:
    """The operations of a tree, inputs first: the units of the pile, those that come, and whether
    the pile stays with its robot."""
    if isinstance(tree, int):
        return
    screwed = isinstance(tree, Screwed)
    pile: Units = ()
    for number, one in enumerate((tree.tree, *tree.screws) if screwed else tree):
        yield from sub_assemblies(one)
        come: Units = leaves(one)
        if number:
            yield pile, come, number > 1 and not screwed
        pile += come


def held_by(graphs: Blocking, screws: Sequence[int]) -> Blocking:
    """The same graphs, with all that is near a screw held by it."""
    if not len(graphs.rests):
        return graphs
    rests = graphs.rests.copy()
    rests[list(screws)] |= graphs.near[list(screws)]
    rests[:, list(screws)] |= graphs.near[:, list(screws)]
    return replace(graphs, rests=rests)


def senseless(graphs: Blocking, tree: Tree) -> tuple[int, int]:
    """The number of sub-assemblies of which something would fall, the product aside, and of
    operations that put a part under a pile."""
    falls = under = 0
    for pile, come, stays in sub_assemblies(tree):
        members = (*pile, *come)
        falls += len(members) < len(graphs) and not graphs.stands(members)
        under += stays and graphs.puts_under(pile, come)
    return falls, under
