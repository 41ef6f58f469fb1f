"""Failures as transitions of the net: those that are undone in the same way in every marking.

An operation that is done again gives its robots back to where they waited for it. A part that is
scrapped, before anything was joined to it, gives its robot back to where it waits for the next.
Each takes one token and needs nothing else, so it fits a net with arcs of weight 1. What is undone
where a pile is lost is not the same in every marking: all that its branch has begun since may be,
or not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from factory.plant.factory import Factory, Operation
from factory.problem.pag import NOPART


@dataclass(frozen=True, slots=True)
class FailingTransition:
    """A failure of an `operation`: the undo of the transitions `asked`, which takes a token from a
    place and gives some back."""

    name: str
    operation: Operation
    asked: tuple[int, ...]
    takes: int
    gives: tuple[int, ...]


def failing_transitions(factory: Factory) -> Iterator[FailingTransition]:
    """Those of a factory, in the order of its operations."""
    before = factory.net.threaded.net.preset
    for operation in factory.operations:
        if not operation.inputs:
            yield from _of_part(factory, operation)
            continue
        again = any(r.kind == "again" for f in operation.template.failures for r in f.responses)
        if again:
            gives = tuple(before[operation.start])
            name = f"{operation.label}:again"
            yield FailingTransition(name, operation, (operation.start,), operation.place, gives)


def _of_part(factory: Factory, leaf: Operation) -> Iterator[FailingTransition]:
    """A part is refused in its feeder; it is scrapped in its robot's hand, or in the operation for
    which that brings it."""
    net = factory.net.threaded.net
    (empty,) = net.preset[leaf.start]
    (held,) = net.postset[leaf.end]
    yield FailingTransition(f"{leaf.label}:refused", leaf, (leaf.start,), leaf.place, (empty,))
    yield FailingTransition(f"{leaf.label}:scrap", leaf, (leaf.end,), held, (empty,))
    onward = factory.operations[net.places[held].right[0] // 2]
    if onward.before[onward.robots.index(leaf.carrier)] == NOPART:
        return
    others = tuple(place for place in net.preset[onward.start] if place != held)
    name = f"{leaf.label}:scrap/{onward.label}"
    yield FailingTransition(name, leaf, (leaf.end,), onward.place, (*others, empty))
