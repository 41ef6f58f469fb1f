"""The layout of a factory in which deputies can take over: that of all that they may have to do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from factory.compiler.standing_by import Pair
from factory.layout.layout import Layout
from factory.plant.factory import Factory
from factory.support.errors import FactoryError


@dataclass(frozen=True)
class Standby:
    """The `layout` in which robots and their deputies do the same tours in turn, by `pairs` of
    them (indices); `refused`: pairs for which there is no layout, and why."""

    layout: Layout = field(repr=False)
    pairs: tuple[Pair, ...] = ()
    refused: tuple[tuple[Pair, str], ...] = ()

    def deputy(self, robot: int) -> int:
        """The deputy of a robot (index), -1 for none."""
        return dict(self.pairs).get(robot, -1)

    def within(self, plain: Layout, factory: Factory, robots: Sequence[int]) -> Layout | None:
        """The layout of a factory with the same operations as that of the `plain` one, whose robots
        have those numbers there: a part of this one, so it is certified as this is. None where a
        robot has a tour that is not laid out."""
        whole, every = self.layout, self.layout.factory
        number = {robot: n for n, robot in enumerate(robots)}
        known = {
            (o.written, tuple(number.get(robot, -1) for robot in o.robots)): o.index
            for o in reversed(every.operations)
        }
        found = [known.get((o.label, o.robots), -1) for o in factory.operations]
        if -1 in found:
            return None
        made = factory.by_label
        return replace(
            plain,
            factory=factory,
            guidepaths=tuple(whole.guidepaths[robot] for robot in robots),
            stations=tuple(whole.stations[n] for n in found),
            payloads={label: box for label, box in whole.payloads.items() if label in made},
            hands=tuple(whole.hands[robot] for robot in robots) if whole.hands else (),
            shifts=tuple(
                tuple(
                    whole.shifts[robot][every.turns[found[tour[-1]], robot]]
                    for tour in factory.tours[n]
                )
                for n, robot in enumerate(robots)
            )
            if whole.shifts
            else (),
        )


def laid_out_for(
    pairs: Sequence[Pair], lay_out: Callable[[tuple[Pair, ...]], Layout]
) -> tuple[Layout, tuple[Pair, ...], tuple[tuple[Pair, str], ...]]:
    """The layout for as many of the pairs as there is one for, with those, and the others, each
    with the reason. Where all do not go together, each half is tried, and so on. Raises what
    `lay_out` raises for none."""
    kept, refused = tuple[Pair, ...](), list[tuple[Pair, str]]()
    layout, todo = None, [tuple(pairs)]
    while todo:
        more = todo.pop()
        try:
            layout, kept = lay_out((*kept, *more)), (*kept, *more)
        except FactoryError as error:
            if not more:
                raise
            if len(more) == 1:
                refused.append((more[0], error.diagnostics[0].message))
                continue
            half = len(more) // 2
            todo += [more[half:], more[:half]]
    return layout or lay_out(()), kept, tuple(refused)
