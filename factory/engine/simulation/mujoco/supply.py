"""What feeders have to present: units that need parts, and withdrawn parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from factory.engine.mjcf.model import Model
from factory.engine.simulation.request import RunRequest
from factory.engine.timing.demand import Word


class Supply:
    """Which units need a part of each label: as many as are requested beside those that have been
    released to the outfeed, or were begun where the run starts, at most `wip` at once.

    Attributes:
        period: number of units in a period; the next unit that needs a label comes a period
            later.
        next: by label, the next unit that needs a part.
        word: which units are made.
        recovers: whether the run goes on after failures.
    """

    def __init__(self, model: Model, request: RunRequest, counts: Mapping[int, int]) -> None:
        factory, leaves = model.factory, model.factory.leaves
        self.period, before = factory.period, factory.units(counts)
        asked = request.demand, before + request.units, request.wip
        self.word = Word(factory.sequence, *asked, made=before)
        self.next = {o.label: factory.unit(o, counts.get(o.end, 0)) for o in leaves}
        self._begun = {o.label: factory.unit(o, counts.get(o.start, 0) - 1) + 1 for o in leaves}
        self.recovers = request.recovers

    def rounds(self) -> dict[str, int]:
        """Number of parts of each label taken."""
        return {label: unit // self.period for label, unit in self.next.items()}

    def wants(self, label: str) -> bool:
        """Whether a unit still needs its part."""
        if self.word.demand:
            return bool(self.word.makes(self.next[label]))
        return self.next[label] < max(self.word.most, self._begun[label])

    @property
    def skips_none(self) -> bool:
        """Whether every unit is made."""
        return not self.word.demand

    def skips(self, label: str) -> bool:
        """Whether the next unit is not made, so that the turn passes on."""
        skipped = self.word.makes(self.next[label]) is False
        self.next[label] += self.period * skipped
        return skipped

    def is_known(self, label: str) -> bool:
        """Whether the next unit is known."""
        return self.word.makes(self.next[label]) is not None


@dataclass(slots=True)
class TakenBack:
    """Parts that feeders withdraw, and what is known of those that they present.

    Attributes:
        numbers: feeders that withdraw a part.
        fresh: by label, units of parts that have begun to be presented.
        good: labels whose presented part passed the camera.
        awaited: labels of which none may come yet.
        late: feeders that had nothing to present on their turn, so that their robots may be
            home before the next part.
    """

    numbers: list[int] = field(default_factory=list)
    fresh: dict[str, int] = field(default_factory=dict)
    good: set[str] = field(default_factory=set)
    awaited: set[str] = field(default_factory=set)
    late: set[int] = field(default_factory=set)
