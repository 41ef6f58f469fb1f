"""The layout of a factory in which deputies can take over: a part of one in which robots and their
deputies do the same tours in turn (`compiler.standing_by`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from factory.compiler.standing_by import Pair
from factory.layout.layout import Layout
from factory.plant.factory import Factory
from factory.support.errors import FactoryError


def deputies_in(layout: Layout) -> Mapping[int, int]:
    """The robots of a layout for which a deputy can take over, and that (indices)."""
    if layout.standby is None:
        return {}
    first, found = layout.factory.by_label, dict[int, int]()
    for o in layout.standby.factory.operations:
        pairs = zip(layout.standby.factory.by_label[o.written].robots, o.robots, strict=True)
        found |= {robot: other for robot, other in pairs if robot != other and o.written in first}
    return found


def part_of(layout: Layout, factory: Factory, robots: Sequence[int]) -> Layout | None:
    """The layout of a factory that has the operations of a `layout` with deputies, and whose robots
    have these numbers there: a part of the same whole, which has its certificate. None where a
    robot has a tour that is not laid out."""
    whole = layout.standby
    if whole is None:
        return None
    number, every = {robot: n for n, robot in enumerate(robots)}, whole.factory
    known = {
        (o.written, tuple(number.get(robot, -1) for robot in o.robots)): o.index
        for o in reversed(every.operations)
    }
    found = [known.get((o.label, o.robots), -1) for o in factory.operations]
    if -1 in found:
        return None
    shifts = (
        tuple(whole.shifts[r][every.turns[found[tour[-1]], r]] for tour in factory.tours[n])
        for n, r in enumerate(robots if whole.shifts else ())
    )
    return replace(
        layout,
        factory=factory,
        guidepaths=tuple(whole.guidepaths[robot] for robot in robots),
        stations=tuple(whole.stations[n] for n in found),
        payloads={x: box for x, box in whole.payloads.items() if x in factory.by_label},
        hands=tuple(whole.hands[robot] for robot in robots) if whole.hands else (),
        shifts=tuple(shifts),
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
