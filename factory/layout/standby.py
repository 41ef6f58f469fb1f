"""The layout of a factory in which deputies can take over: a part of one in which robots and their
deputies do the same tours in turn (`compiler.deputies`)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from factory.compiler.deputies import Pair
from factory.layout.layout import Layout
from factory.plant.factory import Factory
from factory.support.errors import FactoryError


@dataclass(frozen=True, eq=False, slots=True)
class Repertoire:
    """All tours that the robots of a factory may do, with those that they take over as deputies: a
    `layout` of all of them, in which robots have the numbers that they have in the factory, and
    what its labels are called there (`names`)."""

    layout: Layout
    names: Mapping[str, str]

    @classmethod
    def of(cls, layout: Layout) -> Repertoire:
        """That of a layout; nothing more where deputies cannot take over."""
        if (whole := _whole(layout)) is None:
            return cls(layout, {label: label for label in layout.factory.by_label})
        period = layout.factory.period
        return cls(whole, {o.label: o.within(period) for o in whole.factory.making})

    def delivered(self, robot: int) -> list[str]:
        """What a robot (index) may ever deliver, as it is called in the factory."""
        return [self.names[label] for label in self.layout.factory.deliveries(robot)]


def deputies_in(layout: Layout) -> Mapping[int, int]:
    """The robots of a layout for which a deputy can take over, and that (indices)."""
    if (whole := _whole(layout)) is None:
        return {}
    first, found = layout.factory.by_label, dict[int, int]()
    for o in whole.factory.operations:
        label = o.within(layout.factory.period)
        pairs = zip(whole.factory.by_label[label].robots, o.robots, strict=True)
        found |= {robot: other for robot, other in pairs if robot != other and label in first}
    return found


def _whole(layout: Layout) -> Layout | None:
    """The layout of all that robots and their deputies may do, None where there is none, or some of
    its robots are gone."""
    whole, count = layout.standby, len(layout.factory.robots)
    return whole if whole and len(whole.factory.robots) == count else None


def part_of(layout: Layout, factory: Factory, robots: Sequence[int]) -> Layout | None:
    """The layout of a factory that has the operations of a `layout` with deputies, and whose robots
    have these numbers there: a part of the same whole, which has its certificate. None where a
    robot has a tour that is not laid out."""
    whole = layout.standby
    if whole is None:
        return None
    number, every = {robot: n for n, robot in enumerate(robots)}, whole.factory
    known = {
        (o.within(factory.period), tuple(number.get(robot, -1) for robot in o.robots)): o.index
        for o in reversed(every.operations)
    }
    found = [known.get((o.label, o.robots), -1) for o in factory.operations]
    if -1 in found:
        return None
    turns = [[every.turns[found[t[-1]], r] for t in factory.tours[n]] for n, r in enumerate(robots)]
    tours = [*zip(robots, turns, strict=True)]
    return replace(
        layout,
        factory=factory,
        guidepaths=tuple(whole.guidepaths[robot] for robot in robots),
        stations=tuple(whole.stations[n] for n in found),
        payloads={x: box for x, box in whole.payloads.items() if x in factory.by_label},
        hands=tuple(whole.hands[robot] for robot in robots) if whole.hands else (),
        shifts=tuple(tuple(whole.shifts[r][n] for n in own) for r, own in tours if whole.shifts),
        given=tuple(tuple(whole.levels[r][n] for n in own) for r, own in tours),
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
