"""A revision while the factory runs: on a floor that has the lines of both products, units are old
ones until the change is ordered, and then new ones. It is a word of their mix (Theorem 13)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from factory.api import Demand, Project, Timing, write_pag
from factory.apps.revise.family import family
from factory.engine.timing.on_demand import cycle_of
from factory.floor.layout.resting import on_demand

UNITS = 24
"""Number of units of one product from which its cycle time is taken."""

FAMILY_NAME, ORDERS_NAME = "family.pag", "live.csv"
"""Files of a change: the mix of both products, and orders for it."""


@dataclass(frozen=True)
class LiveChange:
    """The mix of an `old` and a `new` product, by label, on one floor: `both`."""

    both: Project = field(repr=False)
    old: str
    new: str

    @classmethod
    def of(cls, old: Project, new: Project, folder: Path) -> LiveChange:
        """The change from one project to another, with its files in a folder. Raises InputError
        where the two cannot be one family, or a machine at rest is in the way."""
        made = family(old.pag, new.pag, (1, 1), folder)
        both = replace(old.with_pag(made.pag), laid=None)
        on_demand(both.layout)
        return cls(both, *made.pag.products)

    @cached_property
    def idle(self) -> list[str]:
        """The robots that have nothing to do any more when the last old unit has left."""
        factory = self.both.layout.factory
        turn = factory.sequence.index(self.new)
        busy = {robot for o in factory.operations if o.turn == turn for robot in o.robots}
        return [robot.name for robot in factory.robots if robot.index not in busy]

    @cached_property
    def cycles(self) -> dict[str, float]:
        """The cycle time on this floor while units of each product alone are made [s]."""
        timing = Timing(on_demand(self.both.layout), self.both.settings)
        sequence, cycles = timing.factory.sequence, dict[str, float]()
        for product in (self.old, self.new):
            word = Demand(changes=((product, 0),)).word(sequence, UNITS)
            cycles[product] = cycle_of(timing, word).seconds
        return cycles

    @property
    def files(self) -> dict[str, str]:
        """The texts of the family, and of the orders of a change and one back, by their names."""
        changes = (self.old, 0), (self.new, 6), (self.old, 12)
        rows = "".join(f"{product},{made}\n" for product, made in changes)
        return {FAMILY_NAME: write_pag(self.both.pag), ORDERS_NAME: f"product,made\n{rows}"}

    def as_json(self) -> dict[str, Any]:
        """The key `live` of `revise --json`."""
        robots = len(self.both.layout.factory.robots)
        made = {"products": [self.old, self.new], "cycle_time_s": self.cycles}
        return {"robots": robots, **made, "idle": self.idle}

    def words(self) -> Iterator[str]:
        """The same for people."""
        robots, idle = len(self.both.layout.factory.robots), ", ".join(self.idle) or "none"
        yield (
            f"live: {robots} robots make both; with --wip W at most W - 1 more units of"
            f" {self.old} are made after the order, and then these are idle: {idle}"
        )
        each = " and ".join(f"{seconds:.3f} s for {name}" for name, seconds in self.cycles.items())
        yield f"live: on the floor for both the cycle is {each}"
