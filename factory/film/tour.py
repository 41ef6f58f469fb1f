"""A tour: the camera of a film that cuts between the whole factory, two hand-overs from near by,
and at the end the last product as it is delivered.

It cuts at events: to a hand-over when its operation has started and the robot that takes the part
is there, back a moment after it has ended or when that robot goes on, and to the delivery when the
last unit is whole. It knows what has fired and nothing of what comes.
"""

from __future__ import annotations

from collections.abc import Iterator

from factory.engine.mjcf.replica import Replica
from factory.film.action import Snapshot
from factory.film.following import Viewpoint
from factory.film.history import TIE, History, OperationProgress
from factory.film.junction import Handover, handover_of
from factory.support.arrays import Array
from factory.support.pictures.sight import Framing, View
from factory.theory.plant.operation import Operation

OPENING, BETWEEN = 1.5, 1.5
"""Shortest time for which a tour shows the whole factory at first, and after a hand-over [s]."""

STAYS, LONGEST = 0.8, 6.0
"""How long it stays at a hand-over that is done, and at most at one [s]."""

LATE, LATEST = 3, 0.7
"""One of so many last operations is shown from near by, and before it one that starts in this share
of the time until then."""

TRIED = 5
"""Number of operations that are tried for the other."""


class Tour:
    """The viewpoint of a tour.

    Args:
        replica: the model that is drawn, at its start.
        framing: the usable area of the picture.
        history: of the run.
        units: number of units that the run makes.
    """

    def __init__(self, replica: Replica, framing: Framing, history: History, units: int) -> None:
        self.replica, self.framing, self.history = replica, framing, history
        self.overview = Viewpoint(replica, "overview", framing, history.subject)
        factory = history.factory
        self.stops = {int(taking.start): (taking, near) for taking, near in self._chosen(units)}
        ends = ((int(factory.by_label[product].end), product) for product in factory.products)
        self.wholes = dict(ends)
        self.near: Handover | None = None
        self.coming: Handover | None = None
        self.awaited, self.last = -1, ""
        self.seen, self.left = 0, units
        self.until, self.free = 0.0, OPENING

    @property
    def watched(self) -> Array:
        """Boxes (n, 8, 3) around the subject of the last view, by their corners [m]."""
        return self.near.watched if self.near else self.overview.watched

    @property
    def concerned(self) -> frozenset[str] | None:
        """The names of the robots that the last view concerns; None for all robots."""
        return self.near.robots if self.near else None

    def view(self, shown: Snapshot, elapsed: float, time: float) -> View:
        """The view at a time [s], which is none before the last."""
        times, events = self.history.times, self.history.events
        while self.seen < len(times) and times[self.seen] < time - TIE:
            self._see(times[self.seen], events[self.seen])
            self.seen += 1
        self._come_and_go(shown, time)
        if time >= self.until:
            self.near = self._handover(self.last) if self.last else None
            self.until = float("inf") if self.last else self.until
        return self.near.view if self.near else self.overview.view(shown, elapsed, time)

    def _see(self, time: float, event: int) -> None:
        """Note a firing."""
        if event in self.stops and time >= self.free and not self.last:
            taking, self.coming = self.stops.pop(event)
            self.awaited, self.free = taking.end, float("inf")
        elif event == self.awaited:
            self.awaited, self.coming = -1, None
            self._stay(min(self.until, time + STAYS) if self.near else time)
        if event in self.wholes:
            self.left -= 1
            self.last = self.wholes[event] if self.left == 0 else self.last

    def _come_and_go(self, shown: Snapshot, time: float) -> None:
        """Be at a hand-over while the robot that takes the part is there, until it goes on."""
        m, qpos = self.replica.m, shown.qpos
        if self.coming is not None and self.coming.is_there(m, qpos):
            self.near, self.coming = self.coming, None
            self._stay(time + LONGEST)
        elif self.near and self.awaited < 0 and not self.near.is_there(m, qpos) and not self.last:
            self._stay(min(self.until, time))

    def _stay(self, until: float) -> None:
        """Stay at a hand-over until a time."""
        self.until, self.free = until, until + BETWEEN

    def _handover(self, label: str) -> Handover:
        return handover_of(self.replica, self.history.subject, label, self.framing)

    def _chosen(self, units: int) -> Iterator[tuple[Operation, Handover]]:
        """Of operations that a tour may show from near by those that are seen best."""
        for operations in stops_of(self.history, units):
            near = [(taking, self._handover(taking.inputs[-1])) for taking in operations]
            if near:
                yield max(near, key=lambda pair: pair[1].merit)


def stops_of(history: History, units: int) -> tuple[list[Operation], list[Operation]]:
    """The operations of which a tour shows one from near by, and those of which it shows another:
    some that start when the whole factory has been seen, and the last of a product that join parts.
    Of several units it may show the one of one unit and the other of the next."""
    starts, expected = _starts(history), OperationProgress(history.subject).expected
    joining = [o for o in history.factory.making if len(o.inputs) > 1]
    joining.sort(key=lambda o: (starts[o.index], -o.index))
    early, late = joining[:-LATE], joining[-LATE:]
    if not early:
        early, late = joining[:-1], joining[-1:]
    latest = LATEST * starts[late[0].index] if late else 0.0
    if units == 1:
        latest -= STAYS + BETWEEN
    timely = [o for o in early if OPENING <= starts[o.index] <= latest - expected(o)] or early
    middle = max(0, (len(timely) - TRIED) // 2)
    return timely[middle : middle + TRIED], late


def _starts(history: History) -> list[float]:
    """When each operation starts in an empty factory, in which all parts are at hand [s]."""
    factory, expected = history.factory, OperationProgress(history.subject).expected
    starts = [0.0] * len(factory.operations)
    for operation in reversed(factory.making):
        made = [factory.by_label[label] for label in operation.inputs]
        ends = [starts[o.index] + (expected(o) if o.inputs else 0.0) for o in made]
        starts[operation.index] = max(ends, default=0.0)
    return starts
