"""Material: what made something that was joined is undone with it, since nothing is taken apart."""

from __future__ import annotations

from factory.nets.undo import Joins
from factory.plant.factory import Factory


def joins_of(factory: Factory) -> Joins:
    """For the end of each operation its start, and the ends of those that made its inputs; for a
    start nothing: an operation that is only begun can be begun again."""
    return {
        operation.end: (
            operation.start,
            *(factory.by_label[label].end for label in operation.inputs),
        )
        for operation in factory.operations
    }
