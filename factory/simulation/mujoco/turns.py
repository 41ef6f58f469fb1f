"""Turns: feeders whose parts one robot takes show them one after the other, as its program asks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from factory.control.mode import Truth


class Turns:
    """The turns of feeders (n,) with these `labels`. `now` (n,): whether it is the turn of each;
    that of a feeder which shares its robot with no other always is. `vacant` (n,): whether it has
    nothing to show on its turn. `lines`: the numbers of all that share its robot, by number, in the
    order of the robot's program; none where no robot takes anything."""

    def __init__(self, labels: Sequence[str]) -> None:
        self._labels = labels

    def serve(self, lines: Sequence[Sequence[int]], counts: Mapping[str, int]) -> None:
        """From now on robots take from these feeders (numbers), each from those of a line, and so
        many parts of each label have been taken. Those whose turn it is have nothing to show."""
        self.lines: list[Sequence[int]] = [() for _ in self._labels]
        self._line = np.arange(len(self._labels))
        for line in lines:
            for number in line:
                self.lines[number], self._line[number] = line, line[0]
        self.recount(counts)
        self.vacant = self.now.copy()

    def recount(self, counts: Mapping[str, int]) -> None:
        """So many parts of each label have been taken: it is the turn of the first that is
        behind."""
        self.now = np.zeros(len(self._labels), bool)
        for number, line in enumerate(self.lines):
            taken = [counts[self._labels[n]] for n in line]
            self.now[number] = bool(line) and number == line[taken.index(min(taken))]

    def taken(self, number: int) -> int:
        """The part of a feeder has been taken; gives the one whose turn it is then."""
        line = self.lines[number]
        then = line[(line.index(number) + 1) % len(line)]
        self.now[number] = False
        self.now[then] = True
        return then

    def any_of(self, chosen: Truth) -> Truth:
        """Whether one of those that share its robot is chosen, for each (n,)."""
        marked = np.zeros(len(self.now), bool)
        marked[self._line[chosen]] = True
        return np.asarray(marked[self._line])
