"""An independent replay of a record of events against a net: does the run refine it?

Tokens are counted and robots followed from place to place, without `PetriNet.follower`. What was
undone is taken back firing by firing, without `factory.apps.recovery.undo`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

from factory.engine.record.history import firings
from factory.theory.nets.gears import GearNet
from factory.theory.nets.petri import Marking
from factory.theory.nets.undone import Entry, Joins, Undone


@dataclass(frozen=True, slots=True)
class ReplayVerdict:
    """Whether every event of a record could fire in its turn, and every marking was legal.

    Attributes:
        refines: whether that is so.
        index: the first event that could not, counted from 0; -1 where the initial marking is
            not legal, None where there is no fault.
        reason: why not, "" where there is no fault.
        marking: the last marking before the fault.
        events: number of events that fired.
    """

    refines: bool
    index: int | None
    reason: str
    marking: Marking
    events: int


class _Game:
    """The tokens on places, the place of each robot, and how often each transition has fired."""

    def __init__(self, net: GearNet, initial: Marking) -> None:
        self.number = {t.name: i for i, t in enumerate(net.threaded.transitions)}
        self.fired = [0] * len(self.number)
        self.start: Marking | None = initial
        self.net = net
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
        """Fire an event. Returns the reason for which it could not fire, "" where it could."""
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
        for moved, place in there.items():
            self.at[moved] = place
        for place in self.needs[event]:
            self.tokens[place] -= 1
        for place in self.gives[event]:
            self.tokens[place] += 1
        self.fired[event] += 1
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

    def take_back(self, entry: Undone, joins: Joins) -> str:
        """Undo the transitions of an entry. Returns the reason for which they are not the least
        that had to be undone, "" where they are."""
        unknown = next(
            (x for x in (*entry.asked, *entry.transitions) if x not in self.number), None
        )
        if unknown is not None:
            return f"the net has no transition '{unknown}'"
        fault = self._count_from_the_first() or self._asked_too_much(entry)
        if fault:
            return fault
        taken = self._taken_back(Counter(self.number[name] for name in entry.asked), joins)
        names = [t.name for t in self.net.threaded.transitions]
        least = Counter({names[event]: times for event, times in taken.items()})
        if least != Counter(entry.transitions):
            return _differs(entry, least)
        return self._find_robots(taken)

    def _count_from_the_first(self) -> str:
        """Count what had fired when the run began, if that has not been done."""
        if self.start is not None:
            try:
                before = firings(self.net, self.start)
            except ValueError as error:
                return f"nothing can be undone: {error}"
            self.fired = [times + before[event] for event, times in enumerate(self.fired)]
            self.start = None
        return ""

    def _asked_too_much(self, entry: Undone) -> str:
        if not entry.asked:
            return f"the undo of {entry.operation} asks for nothing"
        for name, times in Counter(entry.asked).items():
            if times > self.fired[self.number[name]]:
                return f"{name} is to be undone, and has not fired so often"
        return ""

    def _taken_back(self, asked: Counter[int], joins: Joins) -> Counter[int]:
        """Fire transitions backwards, one by one, that must be undone: those that are asked for,
        whose token is missing, or whose result is used by one that is undone oftener."""
        back = Counter[int]()
        made_into = _turned(joins)
        todo = list(asked)
        while todo:
            event = todo.pop()
            due = (
                back[event] < asked[event]
                or any(self.tokens[place] < 0 for place in self.needs[event])
                or any(back[event] < back[end] for end in made_into.get(event, ()))
            )
            if not due:
                continue
            back[event] += 1
            self.fired[event] -= 1
            for place in self.needs[event]:
                self.tokens[place] += 1
            for place in self.gives[event]:
                self.tokens[place] -= 1
                todo += self.net.threaded.places[place].right
            todo += (event, *joins.get(event, ()))
        return back

    def _find_robots(self, events: Iterable[int]) -> str:
        """Locate the robots that the events move. Returns the first contradiction, or ""."""
        sides = (self.needs, self.gives)
        places = {p for event in events for side in sides for p in side[event]}
        for robot in sorted({robot for place in places for robot in self.net.slots[place]}):
            gear = self.net.gears[robot]
            here = [place for place in gear.places for _ in range(self.tokens[place])]
            if len(here) != 1:
                return f"{gear.robot} is at {len(here)} places after what was undone"
            self.at[robot] = here[0]
        return ""

    @property
    def marking(self) -> Marking:
        """The marked places."""
        return frozenset(place for place, count in enumerate(self.tokens) if count)


def _turned(joins: Joins) -> dict[int, list[int]]:
    """For each transition the ends that are undone no oftener than it is."""
    ends: dict[int, list[int]] = {}
    for end, others in joins.items():
        for other in others:
            ends.setdefault(other, []).append(end)
    return ends


def _differs(entry: Undone, least: Counter[str]) -> str:
    """The first transition that was undone more or less often than necessary, in words."""
    said = Counter(entry.transitions)
    name = next(name for name in sorted(said | least) if said[name] != least[name])
    times = f"{said[name]} times, where {least[name]} is the least"
    return f"the undo of {entry.operation} takes back {name} {times}"


def replay(
    net: GearNet,
    events: Iterable[Entry],
    initial: Marking | None = None,
    joins: Joins | None = None,
) -> ReplayVerdict:
    """Fire the events, by name and one by one, from `initial` (m_0 where None).

    Linear: each event costs time in its own places only. The events of a detached set that fired
    in one tick may come in any order. What is undone must be exactly the least that had to be, by
    `joins`, the material rule; without that nothing may be.
    """
    game = _Game(net, net.initial_marking if initial is None else initial)
    if game.fault:
        return ReplayVerdict(False, -1, game.fault, game.marking, 0)
    count = 0
    for entry in events:
        if isinstance(entry, str):
            fault, marking = game.fire(entry), None
        else:
            marking = game.marking
            fault = _take_back(game, entry, joins)
        if fault:
            return ReplayVerdict(False, count, fault, marking or game.marking, count)
        count += 1
    return ReplayVerdict(True, None, "", game.marking, count)


def _take_back(game: _Game, entry: Undone, joins: Joins | None) -> str:
    """Undo an entry. Returns the reason for which that is impossible, "" where it is not."""
    if joins is None:
        return f"the undo of {entry.operation} cannot be judged: no material is known"
    return game.take_back(entry, joins)
