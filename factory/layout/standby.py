"""The layout of a factory in which deputies can take over: a part of one in which robots and their
deputies do the same tours in turn (`compiler.deputies`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from factory.compiler.deputies import Pair
from factory.layout.layout import Layout
from factory.plant.factory import Factory
from factory.support.errors import FactoryError


def deputies_in(layout: Layout) -> Mapping[int, int]:
    """The robots of a layout for which a deputy can take over, and that (indices)."""
    factory, successor = layout.factory, dict[int, int]()
    for o in layout.whole.factory.operations:
        label = o.within(factory.period)
        pairs = zip(layout.whole.factory.by_label[label].robots, o.robots, strict=True)
        successor |= {
            robot: other for robot, other in pairs if robot != other and label in factory.by_label
        }
    return successor


def part_of(layout: Layout, factory: Factory) -> Layout | None:
    """The layout of a factory that has the operations of a `layout` with deputies, and its robots:
    a part of the same whole, which has its certificate. None where a robot has a tour that is not
    laid out."""
    whole = layout.whole
    numbers = {
        (o.within(factory.period), o.robots): o.index for o in reversed(whole.factory.operations)
    }
    operations = [numbers.get((o.label, o.robots), -1) for o in factory.operations]
    if -1 in operations:
        return None
    return replace(
        layout,
        factory=factory,
        visits={
            (o.index, robot): whole.visits[number, robot]
            for o, number in zip(factory.operations, operations, strict=True)
            for robot in o.robots
        },
        payloads={x: box for x, box in whole.payloads.items() if x in factory.by_label},
    )


def laid_out_for(pairs: Sequence[Pair], lay_out: Callable[[tuple[Pair, ...]], Layout]) -> Layout:
    """The layout for as many of the pairs as there is one for: where all do not go together, each
    half is tried, and so on. Raises what `lay_out` raises for none."""
    layout, kept, todo = None, tuple[Pair, ...](), [tuple(pairs)]
    while todo:
        more = todo.pop()
        try:
            layout, kept = lay_out((*kept, *more)), (*kept, *more)
        except FactoryError:
            half = len(more) // 2
            todo += [part for part in (more[half:], more[:half]) if len(more) > 1]
    return layout or lay_out(())
