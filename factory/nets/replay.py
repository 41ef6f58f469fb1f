"""An independent replay of a record of events against a net: does the run refine it?

Tokens are counted and robots followed from place to place, without `PetriNet.follower`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from factory.nets.gears import GearNet
from factory.nets.petri import Marking


@dataclass(frozen=True, slots=True)
class ReplayVerdict:
    """Whether every event could fire in its turn and every marking was legal.

    `index` and `reason`: the first fault, counted from 0 (-1: the initial marking itself); None and
    "" where there is none. `marking`: the last marking before it; `events`: how many fired.
    """

    refines: bool
    index: int | None
    reason: str
    marking: Marking
    events: int


class _Game:
    """The tokens on places and the place of each robot."""

    def __init__(self, net: GearNet, initial: Marking) -> None:
        self.net = net
        self.number = {t.name: i for i, t in enumerate(net.threaded.transitions)}
        self.tokens = [0] * len(net.threaded.places)
        self.at = [-1] * len(net.gears)
        self.needs, self.gives = net.threaded.net.preset, net.threaded.net.postset
        self.fault = self._set_up(initial)

    def _set_up(self, initial: Marking) -> str:
        for place in sorted(initial):
            if not 0 <= place < len(self.tokens):
                return f"the initial marking names place {place}, which is not there"
            self.tokens[place] += 1
            for robot in self.net.slots[place]:
                if self.at[robot] >= 0:
                    return f"the initial marking has {self.net.gears[robot].robot} twice"
                self.at[robot] = place
        if -1 in self.at:
            missing = self.net.gears[self.at.index(-1)].robot
            return f"the initial marking leaves out {missing}"
        return ""

    def fire(self, name: str) -> str:
        """Fire an event; why it could not, "" where it could."""
        event = self.number.get(name)
        if event is None:
            return f"the net has no transition '{name}'"
        fault = self._enabled(event)
        if fault:
            return f"{name} is not enabled: {fault}"
        moves = self.net.threaded.redistribution[event]
        there: dict[int, int] = {}
        for (p, i), (q, j) in moves:
            robot = self.net.slots[p][i]
            if self.at[robot] != p:
                return f"{name} moves {self.net.gears[robot].robot}, which is not at its place"
            if self.net.slots[q][j] != robot:
                return f"{name} moves {self.net.gears[robot].robot} into another robot's slot"
            there[robot] = q
        for robot, place in there.items():
            self.at[robot] = place
        for place in self.needs[event]:
            self.tokens[place] -= 1
        for place in self.gives[event]:
            self.tokens[place] += 1
        return self._legal(name, event)

    def _enabled(self, event: int) -> str:
        names = self.net.threaded.places
        for place in self.needs[event]:
            if self.tokens[place] < 1:
                return f"{names[place].name} is not marked"
        for place in self.gives[event]:
            if self.tokens[place]:
                return f"{names[place].name} is marked already"
        return ""

    def _legal(self, name: str, event: int) -> str:
        """Whether the places around the event hold exactly the robots that are there."""
        for place in self.needs[event] + self.gives[event]:
            here = [robot for robot in self.net.slots[place] if self.at[robot] == place]
            wanted = len(self.net.slots[place]) * self.tokens[place]
            if len(here) != wanted or not 0 <= self.tokens[place] <= 1:
                place_name = self.net.threaded.places[place].name
                return f"after {name} the marking is not legal at {place_name}"
        return ""

    @property
    def marking(self) -> Marking:
        """The marked places."""
        return frozenset(place for place, count in enumerate(self.tokens) if count)


def replay(net: GearNet, events: Iterable[str], initial: Marking | None = None) -> ReplayVerdict:
    """Fire the events, by name and one by one, from `initial` (m_0 where None).

    Linear: each event costs time in its own places only. The events of a detached set that fired
    in one tick may come in any order.
    """
    game = _Game(net, net.initial_marking if initial is None else initial)
    if game.fault:
        return ReplayVerdict(False, -1, game.fault, game.marking, 0)
    count = 0
    for name in events:
        if not isinstance(name, str):
            break
        fault = game.fire(name)
        if fault:
            return ReplayVerdict(False, count, fault, game.marking, count)
        count += 1
    return ReplayVerdict(True, None, "", game.marking, count)
