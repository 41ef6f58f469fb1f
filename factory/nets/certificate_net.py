"""The listing of a net in a certificate, as a checker reads it. Imports nothing of this package."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from typing import Any

Section = dict[str, Any]


def digest(document: dict[str, Any]) -> str:
    """SHA-256 of the document without its digest, as JSON with sorted keys and no spaces."""
    rest = {key: value for key, value in document.items() if key != "digest"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(text.encode()).hexdigest()


class Net:
    """The listing: producers and consumers of places, tokens, and the robots' gears."""

    def __init__(self, listing: dict[str, Any], robots: list[dict[str, Any]]) -> None:
        self.events = [str(t["name"]) for t in listing["transitions"]]
        self.names = [str(p["name"]) for p in listing["places"]]
        self.left = [[number(e) for e in p["left"]] for p in listing["places"]]
        self.right = [[number(e) for e in p["right"]] for p in listing["places"]]
        self.tokens = [number(p["tokens"]) for p in listing["places"]]
        self.slots = [[number(r) for r in p["slots"]] for p in listing["places"]]
        self.sizes = [number(p.get("size", len(p["slots"]))) for p in listing["places"]]
        self.robots = [str(r["name"]) for r in robots]
        self.gears = [[number(p) for p in r["places"]] for r in robots]
        self.turns = [[number(e) for e in r["transitions"]] for r in robots]
        self.initial = [r["initial"] for r in robots]
        self.moves = [t["moves"] for t in listing["transitions"]]
        self.preset: list[list[int]] = [[] for _ in self.events]
        self.postset: list[list[int]] = [[] for _ in self.events]
        self.ranges = list(self._ranges())
        if not self.ranges:
            for p, (before, after) in enumerate(zip(self.left, self.right, strict=True)):
                for e in before:
                    self.postset[e].append(p)
                for e in after:
                    self.preset[e].append(p)

    def _ranges(self) -> Iterator[str]:
        events, places = len(self.events), len(self.names)
        if any(not 0 <= e < events for row in self.left + self.right for e in row):
            yield "a place names a transition that is not there"
        if any(not 0 <= p < places for row in self.gears for p in row):
            yield "a robot names a place that is not there"

    def faults(self) -> Iterator[str]:
        """What makes the listing no listing of a net."""
        yield from self.ranges
        if len(set(self.events)) < len(self.events) or len(set(self.names)) < len(self.names):
            yield "two places or two transitions have one name"
        if len(set(self.robots)) < len(self.robots):
            yield "two robots have one name"
        if min(self.tokens, default=0) < 0:
            yield "a place has fewer than no tokens"

    def marked_graph(self) -> bool:
        """Whether each place has at most one producer and one consumer."""
        return all(len(row) <= 1 for row in self.left + self.right)

    def fits(self, place: int, robots: list[int]) -> bool:
        """Whether a place acts on these robots, which are sorted: each has one slot there."""
        return self.sizes[place] == len(robots) and sorted(self.slots[place]) == robots

    def marked_once(self, robot: int) -> bool:
        """Whether a robot's gear carries one token, where the robot starts."""
        on = {p for p in self.gears[robot] if self.tokens[p]}
        return on == {self.initial[robot]} and self.tokens[self.initial[robot]] == 1

    def threaded(self) -> bool:
        """Whether f_m is a bijection, each robot being marked once: each marked place acts on the
        robots that start there."""
        starting: dict[int, list[int]] = {p: [] for p, tokens in enumerate(self.tokens) if tokens}
        for robot, place in enumerate(self.initial):
            starting[place].append(robot)
        return all(robots and self.fits(p, robots) for p, robots in starting.items())

    def edge(self, place: int) -> tuple[int, int] | None:
        """(a, b) of a place [a; b]."""
        before, after = self.left[place], self.right[place]
        return (before[0], after[0]) if len(before) == len(after) == 1 else None

    def circuit(self, places: list[int]) -> bool:
        """Whether the places, in this order, form a circuit."""
        edges = [self.edge(p) if 0 <= number(p) < len(self.names) else None for p in places]
        pairs = zip(edges, edges[1:] + edges[:1], strict=True)
        return bool(edges) and all(x and y and x[1] == y[0] for x, y in pairs)

    def closed(self, robot: int) -> bool:
        """Whether a robot's gear is a cycle of two places or more (Definition 3.5)."""
        places, turns = self.gears[robot], self.turns[robot]
        return (
            len(places) == len(turns) >= 2
            and len(set(places)) == len(places)
            and len(set(turns)) == len(turns)
            and all(
                self.edge(p) == (turns[i], turns[(i + 1) % len(turns)])
                for i, p in enumerate(places)
            )
        )


def number(value: Any) -> int:
    """The value, an integer. Raises TypeError where it is none."""
    if type(value) is not int:
        raise TypeError(f"{value!r} is not a number")
    return value
