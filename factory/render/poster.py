"""Which moment of a film makes its poster: that which shows most."""

from __future__ import annotations

from pathlib import Path

from factory.render.camerawork import Moment, Take, save
from factory.render.history import History


class Poster:
    """Chooses among the moments at which a product has just become whole, that is the last
    operation before the dropoff has ended: the one with the most parts in the factory, the latest
    of these; where there is none, the last moment. It is kept, and saved when the film is over."""

    def __init__(self, take: Take, history: History, path: Path) -> None:
        self.take, self.history, self.path = take, history, path
        self.moment: Moment | None = None
        factory, m = history.factory, take.m
        root = factory.by_label[factory.dropoff.inputs[0]]
        self.end, self.seen, self.whole, self.most = root.end, 0, False, -1
        self.parked = {e for e in range(m.neq) if m.equality(e).name.startswith("park/")}

    def see(self, moment: Moment) -> None:
        """A moment of the film; the history is as far."""
        if self._better(moment.shown.active.tolist()):
            self.moment = moment

    def save(self) -> None:
        """Write the poster."""
        if self.moment is not None:
            save(self.take, self.moment, self.path, self.history)

    def _better(self, active: list[int]) -> bool:
        """Whether the moment now, with these active constraints, is better than those before."""
        fired = self.history.events[self.seen :]
        self.seen = len(self.history.events)
        if self.end not in fired:
            return not self.whole
        shown = len(self.parked) - len(self.parked.intersection(active))
        best = shown >= self.most
        self.whole, self.most = True, max(self.most, shown)
        return best
