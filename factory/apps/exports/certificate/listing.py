"""The net of a certificate, as a checker reads it. Imports nothing of this package."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from functools import cached_property
from typing import Any

Section = dict[str, Any]
Rows = list[list[int]]

SCHEMA = 2
CLAIMS = ("gear_net", "safe", "live", "reversible", "legal")
TRAIN = "gear_train"
"""The additional claim in the certificate of a gear train."""


def digest(document: Section) -> str:
    """SHA-256 of the document without its digest, as JSON with sorted keys and no spaces."""
    rest = {key: value for key, value in document.items() if key != "digest"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


def number(value: Any) -> int:
    """The value, an integer. Raises TypeError where it is none."""
    if type(value) is not int:
        raise TypeError(f"{value!r} is not a number")
    return value


class Net:
    """The listing: `left` and `right`, producers and consumers of places; tokens and slots."""

    def __init__(self, listing: Section, robots: list[Section]) -> None:
        places, transitions = listing["places"], listing["transitions"]
        self.events = [str(t["name"]) for t in transitions]
        self.names = [str(p["name"]) for p in places]
        self.left, self.right = _rows(places, "left"), _rows(places, "right")
        self.tokens = [number(p["tokens"]) for p in places]
        self.slots = _rows(places, "slots")
        self.sizes = [number(p.get("size", len(p["slots"]))) for p in places]
        self.moves = [t["moves"] for t in transitions]
        self.robots = [ListedRobot(robot) for robot in robots]
        if any(not 0 <= e < len(transitions) for row in self.left + self.right for e in row):
            raise ValueError("a place names a transition that is not there")
        if any(not 0 <= p < len(places) for robot in self.robots for p in robot.places):
            raise ValueError("a robot names a place that is not there")
        self.preset: Rows = [[] for _ in transitions]
        self.postset: Rows = [[] for _ in transitions]
        for p, (before, after) in enumerate(zip(self.left, self.right, strict=True)):
            for e in before:
                self.postset[e].append(p)
            for e in after:
                self.preset[e].append(p)

    def faults(self) -> Iterator[str]:
        """Faults of the listing itself."""
        if len(set(self.events)) < len(self.events) or len(set(self.names)) < len(self.names):
            yield "two places or two transitions have one name"
        if len({robot.name for robot in self.robots}) < len(self.robots):
            yield "two robots have one name"
        if min(self.tokens, default=0) < 0:
            yield "a place has fewer than no tokens"

    @cached_property
    def owners(self) -> Rows:
        """For each place the gears through it."""
        return _through(len(self.names), [robot.places for robot in self.robots])

    @cached_property
    def meeting(self) -> Rows:
        """For each transition the gears through it."""
        return _through(len(self.events), [robot.turns for robot in self.robots])

    def marked_graph(self) -> bool:
        """Whether each place has at most one producer and one consumer."""
        return all(len(row) <= 1 for row in self.left + self.right)

    def fits(self, place: int, robots: list[int]) -> bool:
        """Whether a place acts on these robots, which are sorted: each has one slot there."""
        return self.sizes[place] == len(robots) and sorted(self.slots[place]) == robots

    def marked_once(self, robot: ListedRobot) -> bool:
        """Whether a robot's gear carries one token, where the robot starts."""
        on = {p for p in robot.places if self.tokens[p]}
        return on == {robot.initial} and self.tokens[robot.initial] == 1

    def threaded(self) -> bool:
        """Whether f_m is a bijection, each robot being marked once: each marked place acts on the
        robots that start there."""
        starting: dict[int, list[int]] = {p: [] for p, tokens in enumerate(self.tokens) if tokens}
        for index, robot in enumerate(self.robots):
            starting[robot.initial].append(index)
        return all(robots and self.fits(p, robots) for p, robots in starting.items())

    def uncovered(self, claim: str) -> Iterator[str]:
        """Places and transitions in no gear, and places whose slots are not those of their
        gears."""
        if not all(self.owners) or not all(self.meeting):
            yield f"{claim}: some place or transition is in no gear"
        if not all(self.fits(p, owners) for p, owners in enumerate(self.owners)):
            yield f"{claim}: the slots of some place are not its gears'"

    def wrong_moves(self, claim: str) -> Iterator[str]:
        """Redistribution functions that are no bijection, or change a robot's slot."""
        for event, moves in enumerate(self.moves):
            if moves is None:
                continue
            pairs = [((number(p), number(i)), (number(q), number(j))) for p, i, q, j in moves]
            here = sorted((p, i) for p in self.preset[event] for i in range(len(self.slots[p])))
            there = sorted((q, j) for q in self.postset[event] for j in range(len(self.slots[q])))
            if sorted(x for x, _ in pairs) != here or sorted(y for _, y in pairs) != there:
                yield f"{claim}: the redistribution of {self.events[event]} is no bijection"
            elif any(self.slots[p][i] != self.slots[q][j] for (p, i), (q, j) in pairs):
                yield f"{claim}: {self.events[event]} moves a robot into another's slot"

    def edge(self, place: int) -> tuple[int, int] | None:
        """(a, b) of a place [a; b]; None for one of another form, or that is not there."""
        if not 0 <= number(place) < len(self.names):
            return None
        before, after = self.left[place], self.right[place]
        return (before[0], after[0]) if len(before) == len(after) == 1 else None

    def circuit(self, places: list[int]) -> bool:
        """Whether the places, in this order, form a circuit."""
        edges = [self.edge(p) for p in places]
        pairs = zip(edges, edges[1:] + edges[:1], strict=True)
        return bool(edges) and all(x and y and x[1] == y[0] for x, y in pairs)

    def closed(self, robot: ListedRobot) -> bool:
        """Whether a robot's gear is a cycle of two places or more (Definition 3.5)."""
        places, turns = robot.places, robot.turns
        return (
            len(places) == len(turns) == len(set(places)) == len(set(turns)) >= 2
            and self.circuit(places)
            and all(self.left[p] == [e] for p, e in zip(places, turns, strict=True))
        )


class ListedRobot:
    """A robot of the listing: its name, its gear's places and the transitions before them, and the
    place where it starts."""

    def __init__(self, robot: Section) -> None:
        self.name = str(robot["name"])
        self.places = [number(p) for p in robot["places"]]
        self.turns = [number(e) for e in robot["transitions"]]
        self.initial = robot["initial"]


def _rows(places: list[Section], key: str) -> Rows:
    return [[number(value) for value in place[key]] for place in places]


def _through(count: int, gears: list[list[int]]) -> Rows:
    """For each of so many nodes the gears through it, in their order."""
    through: Rows = [[] for _ in range(count)]
    for index, nodes in enumerate(gears):
        for node in nodes:
            through[node].append(index)
    return through
