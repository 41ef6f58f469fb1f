"""Demand: the order in which the products of a mix are made, as an input of a run.

The *word* of a run is its sequence of products (Theorem 10): the same for all robots, fixed letter
by letter, each before anything is done for its unit. The net has the units of a mix's sequence, of
which every word is a subsequence: a unit of the net whose product is not the next letter is
*skipped*. Its operations start and end at once, and move nothing.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace


@dataclass(frozen=True, slots=True)
class Demand:
    """The units that are asked for: either orders, or standing changes.

    Attributes:
        orders: products, each with the time at which it is ordered [s].
        changes: products, each with the number of units made before it is the one asked for.
    """

    orders: tuple[tuple[str, float], ...] = ()
    changes: tuple[tuple[str, int], ...] = ()

    def __post_init__(self) -> None:
        if bool(self.orders) == bool(self.changes) or (self.changes and self.changes[0][1]):
            raise ValueError("a demand has orders, or changes of which the first is at 0")

    def allows(self, number: int, product: str) -> bool:
        """Whether an order, counted from 0, can have been for a product."""
        if self.changes:
            return any(product == each and since <= number for each, since in self.changes)
        return self.orders[number : number + 1] != () and self.orders[number][0] == product

    def word(
        self,
        sequence: Sequence[str],
        most: int,
        wip: int | None = None,
        units: Sequence[int] = (),
        fixed: int = 0,
    ) -> Word:
        """The word of a run for it: up to `most` units, of a net with the products of a period,
        with the units that are known to be made as far as that is `fixed`."""
        return Word(sequence, self, most, wip, [*units], fixed)

    @property
    def products(self) -> tuple[str, ...]:
        """All that is asked for, each product once."""
        return tuple(dict.fromkeys(product for product, _ in (*self.orders, *self.changes)))

    def letter(self, number: int, made: int, now: float) -> str | None:
        """The product of an order, counted from 0, when so many units have been made; None while
        it has not been placed."""
        if self.changes:
            return [product for product, since in self.changes if since <= made][-1]
        placed = (product for product, t in self.orders[number : number + 1] if t <= now)
        return next(placed, None)


@dataclass
class Word:
    """The order in which units are made, as far as it is fixed: the word of a run, whose letters
    are products. Without a demand every unit is made.

    Attributes:
        sequence: the products of a period.
        demand: what is asked for; None where the sequence repeats.
        most: number of units after which the run ends.
        wip: the most letters that are fixed and not dropped off yet; None for no bound.
        units: the units of the net that are made, in order.
        fixed: number of units of the net of which it is known whether they are made.
        made: number of units dropped off so far.
        now: the time [s].
    """

    sequence: Sequence[str]
    demand: Demand | None = None
    most: int = 0
    wip: int | None = None
    units: list[int] = field(default_factory=list)
    fixed: int = 0
    made: int = 0
    now: float = 0.0

    @property
    def is_late(self) -> bool:
        """Whether the next letter is awaited that has not been placed yet."""
        return self.demand is not None and self._admits and self._letter() is None

    @property
    def late_order(self) -> str:
        """The order that is awaited, in words, where one is late; else ""."""
        if self.demand is None or not self.is_late:
            return ""
        number = len(self.units)
        product, placed = self.demand.orders[number]
        return f"order {number + 1}, {product}, is placed at {placed:g} s only"

    @property
    def _admits(self) -> bool:
        number = len(self.units)
        return number < self.most and (self.wip is None or number < self.made + self.wip)

    def _letter(self) -> str | None:
        assert self.demand is not None
        return self.demand.letter(len(self.units), self.made, self.now)

    def lets_in(self, unit: int) -> bool:
        """Whether there is room for a unit of the net; on demand, for each that is made."""
        return self.demand is not None or self.wip is None or unit < self.made + self.wip

    def are_made(self, made: int, since: float) -> bool:
        """Whether all units are made that were ordered by a time [s], if so many are; never where
        changes stand, by which there is always another one asked for."""
        orders = self.demand.orders if self.demand else ()
        return bool(orders) and all(t > since for _, t in orders[made:])

    def placed(self, number: int) -> float:
        """When an order, counted from 0, is placed [s]."""
        orders = self.demand.orders if self.demand else ()
        return orders[number][1] if number < len(orders) else 0.0

    def makes(self, unit: int) -> bool | None:
        """Whether a unit of the net is made, which is fixed now if it can be; None if it cannot."""
        if self.demand is None:
            return True
        while self.fixed <= unit:
            if not self._admits or (letter := self._letter()) is None:
                return None
            if letter == self.sequence[self.fixed % len(self.sequence)]:
                self.units.append(self.fixed)
            self.fixed += 1
        return self.is_made(unit)

    def is_made(self, unit: int) -> bool:
        """Whether a unit of the net is among those that are made, as far as that is fixed."""
        at = bisect_left(self.units, unit)
        return self.demand is None or (at < len(self.units) and self.units[at] == unit)

    def upcoming(self, unit: int) -> int:
        """The first unit from this one on, in the same turn of a period, that is not known to be
        skipped."""
        while unit < self.fixed and not self.is_made(unit):
            unit += len(self.sequence)
        return unit

    def number(self, unit: int) -> int:
        """How many units are made before a unit of the net."""
        return unit if self.demand is None else bisect_left(self.units, unit)

    def later(self, periods: int) -> Word:
        """The same word, seen from so many periods later on."""
        gone = periods * len(self.sequence)
        units = [unit - gone for unit in self.units if unit >= gone]
        return replace(self, units=units, fixed=self.fixed - gone)

    def nth(self, turn: int, count: int) -> int:
        """In which period, from 0, the unit in a turn of it is made that so many were before."""
        if self.demand is None:
            return count
        made = self._periods(turn)
        return made[count] if count < len(made) else self.fixed // len(self.sequence) + 1 + count

    def before(self, turn: int, periods: int) -> int:
        """How often the unit in a turn of a period is made in so many periods."""
        return periods if self.demand is None else bisect_left(self._periods(turn), periods)

    def _periods(self, turn: int) -> list[int]:
        period = len(self.sequence)
        return [unit // period for unit in self.units if unit % period == turn]

    def products(self, begin: int, end: int) -> list[str]:
        """The products of the units that are made, by number."""
        numbers = range(begin, end) if self.demand is None else self.units[begin:end]
        return [self.sequence[unit % len(self.sequence)] for unit in numbers]

    def counts(self, begin: int, end: int) -> Mapping[str, int]:
        """How many of each product the units from `begin` to `end` are."""
        counts = Counter(self.products(begin, end))
        return {product: counts[product] for product in dict.fromkeys(self.sequence)}
