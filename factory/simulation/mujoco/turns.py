"""Turns: feeders whose parts one robot takes show them one after the other, as its program asks."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from factory.control.mode import Truth
from factory.layout.layout import Layout
from factory.simulation.keeping import Keeper


class Turns:
    """The turns of feeders (n,), in the order of their labels, when so many parts of each label
    have been taken (`counts`). `now` (n,): whether it is the turn of each; that of a feeder which
    shares its robot with no other always is. `vacant` (n,): whether it has nothing to show on its
    turn. `lines`: the numbers of all that share its robot, by number, in the order of the robot's
    program."""

    def __init__(self, layout: Layout, counts: Mapping[str, int]) -> None:
        leaves = layout.factory.leaves
        numbers = {leaf.label: n for n, leaf in enumerate(leaves)}
        shown = [layout.magazine(leaf.carrier) for leaf in leaves]
        self.lines = [[numbers[label] for label in line] for line in shown]
        self._labels = [leaf.label for leaf in leaves]
        self._line = np.array([line[0] for line in self.lines], np.intp)
        self.recount(counts)
        self.vacant = self.now.copy()

    def recount(self, counts: Mapping[str, int]) -> None:
        """So many parts of each label have been taken: it is the turn of the first that is
        behind."""
        self.now = np.zeros(len(self._labels), bool)
        for number, line in enumerate(self.lines):
            taken = [counts[self._labels[n]] for n in line]
            self.now[number] = number == line[taken.index(min(taken))]

    def taken(self, number: int) -> int:
        """The part of a feeder has been taken; gives the one whose turn it is then."""
        line = self.lines[number]
        then = line[(line.index(number) + 1) % len(line)]
        self.now[number] = False
        self.now[then] = True
        return then

    def keep(self, keeper: Keeper) -> None:
        """Whose turn it is."""
        keeper.array("turns.now", self.now, 0, 1)
        keeper.array("turns.vacant", self.vacant, 0, 1)

    def any_of(self, chosen: Truth) -> Truth:
        """Whether one of those that share its robot is chosen, for each (n,)."""
        marked = np.zeros(len(self.now), bool)
        marked[self._line[chosen]] = True
        return np.asarray(marked[self._line])
