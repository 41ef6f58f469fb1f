"""The proof that a net is a gear net, live, safe, reversible and legally marked, in linear time.

Definitions 3.5 and 3.6 are checked gear by gear (`composition`); safety follows from the cover by
gears of one token, liveness from an order of the places free of token-free circuits, reversibility
from liveness and the gears (`behaviour`). Theorems 3.1 and 3.2 are not used, but tested.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice

from factory.foreign_nets.explore import LIMIT
from factory.nets.behaviour import behaviour
from factory.nets.composition import MOST, Composition, compose, named
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet, marked
from factory.nets.verdict import Fault, Verdict, Witness, listing, testify
from factory.support.collector import collector_paused
from factory.support.errors import Diagnostic, Position, RunError

__all__ = ["Verdict", "Witness", "verify"]


def proved(net: GearNet) -> Verdict:
    """The verdict on a net all of whose properties hold. Raises RunError (NotProved) with a witness
    for each that does not."""
    verdict = verify(net)
    if not verdict.holds:
        raise RunError(
            Diagnostic("NotProved", str(witness), None, "see factory check")
            for witness in verdict.witness
        )
    return verdict


@collector_paused()
def verify(
    net: GearNet | MarkedNet,
    sources: Mapping[str, Position] | None = None,
    limit: int = LIMIT,
) -> Verdict:
    """Check the claim that `net` is composed of its gears, and everything that follows.

    Linear in the net; only a net with choice is explored, up to `limit` markings. `sources` gives
    source positions of robots by name, for the witnesses.
    """
    subject = marked(net)
    composition = compose(subject)
    found = behaviour(subject, composition.closed, limit)
    redistributed = tuple(islice(_redistribution(net), MOST)) if isinstance(net, GearNet) else ()
    illegal = tuple(islice(_illegal(net, subject, composition), MOST))
    faults = (*composition.faults, *redistributed, *found.faults, *illegal)
    return Verdict(
        not composition.faults and not redistributed,
        found.live,
        found.safe,
        found.reversible,
        not illegal,
        testify(subject, subject.gears, faults, sources),
        subject.gears,
        found.method,
    )


def _redistribution(net: GearNet) -> Iterator[Fault]:
    """Events that move a robot into another robot's slot."""
    slots = net.slots
    for event, pairs in enumerate(net.threaded.redistribution):
        for (p, i), (q, j) in pairs:
            if i >= len(slots[p]) or j >= len(slots[q]) or slots[p][i] != slots[q][j]:
                names = net.threaded.places
                text = (
                    f"{net.threaded.transitions[event].name} moves slot {i + 1} of {names[p].name}"
                    f" to slot {j + 1} of {names[q].name}, which belongs to another robot"
                )
                yield Fault("gear_net", "slots", text, (), (p, q), (event,))


def _illegal(
    net: GearNet | MarkedNet, subject: MarkedNet, composition: Composition
) -> Iterator[Fault]:
    """Gears that are not marked exactly once, and what keeps f_m from being a bijection."""
    miscounted = tuple(_miscounted(subject, composition))
    yield from miscounted
    if isinstance(net, GearNet) and len(net.initial) != len(net.gears):
        text = f"{len(net.initial)} initial places are given for {len(net.gears)} robots"
        kind = "lost token" if len(net.initial) < len(net.gears) else "doubled token"
        yield Fault("legal", kind, text)
    elif subject.slots and not miscounted:
        yield from _unthreaded(subject, _initial(net))


def _miscounted(subject: MarkedNet, composition: Composition) -> Iterator[Fault]:
    """Gears that are not marked exactly once, and marked places in none."""
    tokens, names = subject.tokens, subject.net.places
    for number, gear in enumerate(subject.gears):
        on = [p for p in dict.fromkeys(gear.places) if tokens[p]]
        count = sum(tokens[p] for p in on)
        if count == 0:
            text = f"the gear of {gear.robot} carries no token: it lies still for ever"
            yield Fault("legal", "lost token", text, (number,), gear.places[:1])
        elif count > 1:
            where = listing(names[p].name for p in on)
            text = f"the gear of {gear.robot} carries {count} tokens, at {where}"
            yield Fault("legal", "doubled token", text, (number,), tuple(on))
    for place, own in enumerate(composition.owners):
        if tokens[place] and not own:
            text = f"place {names[place].name} is marked and in no gear"
            yield Fault("legal", "place in no gear", text, (), (place,))


def _initial(net: GearNet | MarkedNet) -> tuple[int, ...]:
    """The place where each robot starts, in a net with each gear marked once."""
    if isinstance(net, GearNet):
        return net.initial
    return tuple(next(p for p in gear.places if net.tokens[p]) for gear in net.gears)


def _unthreaded(net: MarkedNet, initial: tuple[int, ...]) -> Iterator[Fault]:
    """Marked places whose slots are not those of the robots that start there."""
    starting: dict[int, list[int]] = {}
    for robot, place in enumerate(initial):
        starting.setdefault(place, []).append(robot)
    for place, robots in sorted(starting.items()):
        slots, at = net.slots[place], net.net.places[place]
        if at.size != len(robots) or sorted(slots) != robots:
            text = (
                f"place {at.name} acts on {at.size} robots with slots for"
                f" {named(net, slots)}, but who starts there is {named(net, robots)}"
            )
            yield Fault("legal", "slots", text, tuple(robots), (place,))
