"""Coordinated nets: a compiled net, with what else waits in a laid-out factory.

Beside the places of the compiled net there are *passes*, transitions that an axis fires in motion
as it goes past a point; *order places*, by which a machine waits for one of those of another; and
the gears of machines without a program, the magazines and the tray. All of them only restrict the
compiled net: without them every run of the coordinated net is one of the compiled net (refinement),
so what is proved of operations holds. It is a marked graph, so it is live, and its orders can never
deadlock, iff no circuit is free of tokens (Commoner et al. 1971).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from factory.theory.nets.gears import GearNet
from factory.theory.nets.marked import NONE, MarkedNet
from factory.theory.nets.petri import PetriNet, Place, Transition
from factory.theory.problem.ids import AxisId, PlaceId, RobotId, TransitionId, carriage_axis, is_end


@dataclass(frozen=True, slots=True)
class Past:
    """A pass: the moment in which an axis has come past a point.

    Attributes:
        after: the transition since whose firing it counts.
        axis: the axis.
        at: the point [m].
        direction: +1 where the axis comes to larger positions, -1 to smaller ones.
    """

    after: TransitionId
    axis: AxisId
    at: float
    direction: int = 1

    @classmethod
    def of_carriage(cls, after: TransitionId, robot: int, at: float, direction: int = 1) -> Past:
        """That of a robot (index) along its guidepath."""
        return cls(after, carriage_axis(RobotId(robot)), at, direction)

    def holds(self, x: float) -> bool:
        """Whether the axis at `x` [m] is past."""
        return (x - self.at) * self.direction >= 0.0


@dataclass(frozen=True, slots=True)
class Order:
    """An order place: an operation starts only after another transition, or after a pass.

    Attributes:
        before: the transition that comes first: it, or the pass that follows it.
        start: the transition that waits. It has fired at most `tokens` times more often.
        tokens: the tokens of the place.
        past: the pass, where one is waited for.
        end: the transition by which the pass has happened, that of its robot after it; NONE
            without a pass. It has fired at most `held` times more often than `before`.
        held: tokens of the robot's place between the two.
    """

    before: TransitionId
    start: TransitionId
    tokens: int
    past: Past | None = None
    end: TransitionId = NONE
    held: int = 0


@dataclass(frozen=True)
class CoordinatedNet:
    """A marked graph whose first places and transitions are those of the compiled net.

    Attributes:
        net: the net with its tokens.
        passes: for each pass the place that it ends, and the pass where that place begins; None
            where it begins with the transition that the pass follows.
        beside: places that have as many tokens as one of the compiled net, each with that one.
        orders: the order places that a supervisor keeps.
    """

    net: MarkedNet
    passes: Mapping[Past, tuple[PlaceId, Past | None]] = field(repr=False)
    beside: Mapping[PlaceId, PlaceId] = field(repr=False)
    orders: tuple[Order, ...] = field(repr=False)

    @property
    def deadlock(self) -> tuple[PlaceId, ...]:
        """The places of a circuit without token, () where the net is live. Linear."""
        stuck = self.net.token_free.stuck
        return tuple(map(PlaceId, self.net.stuck_circuit(stuck) if stuck else ()))

    def as_json(self) -> dict[str, object]:
        """The net as `check --json` tells of it: its size, whether it is live, and the order places
        with their tokens."""
        places = zip(self.net.net.places, self.net.tokens, strict=True)
        return {
            "places": len(self.net.tokens),
            "transitions": len(self.net.net.transitions),
            "passes": len(self.passes),
            "live": not self.deadlock,
            "orders": [{"place": p.name, "tokens": n} for p, n in places if p.mode == "order"],
        }


class Coordination:
    """Builds a coordinated net upon a compiled one."""

    def __init__(self, net: GearNet) -> None:
        compiled = MarkedNet.of(net)
        self.transitions, self.places = [*compiled.net.transitions], [*compiled.net.places]
        self.tokens, self._compiled = [*compiled.tokens], len(compiled.net.transitions)
        self.passes: dict[Past, tuple[PlaceId, Past | None]] = {}
        self.events: dict[Past, TransitionId] = {}
        self.beside: dict[PlaceId, PlaceId] = {}
        self._ends: dict[Past, tuple[TransitionId, int]] = {}
        self.orders: list[Order] = []

    def transition(self, name: str) -> TransitionId:
        """Add a transition; gives its index."""
        self.transitions.append(Transition(name))
        return TransitionId(len(self.transitions) - 1)

    def place(
        self,
        name: str,
        ends: tuple[TransitionId, TransitionId],
        tokens: int,
        mode: str,
        label: str,
    ) -> PlaceId:
        """Add a place [before; after], its `ends`; gives its index."""
        before, after = ends
        self.places.append(Place(name, (before,), (after,), mode, label, 0))
        self.tokens.append(tokens)
        return PlaceId(len(self.places) - 1)

    def chain(
        self, passes: Mapping[Past, str], kind: tuple[str, str], end: TransitionId, beside: PlaceId
    ) -> None:
        """Add a path of passes, with their names, from the transition that all of them follow to
        the transition `end`. It carries as many tokens as the place of the compiled net that it is
        `beside`; `kind`: mode and label of its places."""
        before: Past | None = None
        for past, name in passes.items():
            start = past.after if before is None else self.events[before]
            event = self.events[past] = self.transition(name)
            self.passes[past] = self.place(name, (start, event), 0, *kind), before
            self._ends[past] = end, self.tokens[beside]
            before = past
        if before is not None:
            name, ends = f"{passes[before]} on", (self.events[before], end)
            self.beside[self.place(name, ends, self.tokens[beside], *kind)] = beside

    def order(self, name: str, past: Past, start: TransitionId, tokens: int) -> None:
        """Add an order place from a pass to a transition of the compiled net."""
        self.place(name, (self.events[past], start), tokens, "order", name)
        self.orders.append(Order(past.after, start, tokens, past, *self._ends[past]))

    def precede(self, name: str, ends: tuple[str, str], tokens: int) -> None:
        """Add an order place between two transitions of the net, by their names. A supervisor keeps
        it where the first is of the compiled net or a pass, and the second the start of an
        operation."""
        before, start = (self._numbers[end] for end in ends)
        past = next((past for past, event in self.events.items() if event == before), None)
        if past is not None:
            self.order(name, past, start, tokens)
            return
        self.place(name, (before, start), tokens, "order", name)
        if before < self._compiled and start < self._compiled and not is_end(start):
            self.orders.append(Order(before, start, tokens))

    @cached_property
    def _numbers(self) -> dict[str, TransitionId]:
        """All transitions by name, of a net that gets no more of them."""
        return {event.name: TransitionId(n) for n, event in enumerate(self.transitions)}

    def built(self) -> CoordinatedNet:
        """The net."""
        net = PetriNet(tuple(self.transitions), tuple(self.places))
        marks = MarkedNet(net, tuple(self.tokens))
        return CoordinatedNet(marks, self.passes, self.beside, tuple(self.orders))
