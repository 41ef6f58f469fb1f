"""Which operations made what another one joins: the material rule of `factory.nets.undo`."""

from __future__ import annotations

from types import MappingProxyType

from factory.nets.undone import Joins
from factory.plant.factory import Factory


def joins_of(factory: Factory) -> Joins:
    """For the end of each operation its start and the ends of the operations that made its inputs:
    the transitions that are undone as often as the end, since nothing is taken apart."""
    made = factory.by_label
    return MappingProxyType(
        {o.end: (o.start, *(made[label].end for label in o.inputs)) for o in factory.operations}
    )
