"""Nets for tests: brute-force exploration, random marked nets, legal markings, planted faults."""

from __future__ import annotations

import random
from dataclasses import replace
from itertools import product

from factory.theory.nets.gears import Gear, GearNet
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.petri import Marking, PetriNet, Place, Transition
from factory.theory.nets.threaded import ThreadedNet
from tests.token_game import enabled, follower


def net_from(edges: list[tuple[str, str, int]]) -> MarkedNet:
    """A net from places written as (producers, consumers, tokens), names separated by spaces."""
    names = sorted({e for a, b, _ in edges for e in (a + " " + b).split()})
    number = {name: i for i, name in enumerate(names)}
    places = tuple(
        Place(
            f"p{i}",
            tuple(number[e] for e in before.split()),
            tuple(number[e] for e in after.split()),
        )
        for i, (before, after, _) in enumerate(edges)
    )
    net = PetriNet(tuple(Transition(name) for name in names), places)
    return MarkedNet(net, tuple(tokens for _, _, tokens in edges))


PHILOSOPHERS = [
    ("putA putB", "takeA1 takeB2", 1),
    ("putA putB", "takeA2 takeB1", 1),
    ("putA", "takeA1", 1),
    ("putB", "takeB1", 1),
    ("takeA1", "takeA2", 0),
    ("takeB1", "takeB2", 0),
    ("takeA2", "putA", 0),
    ("takeB2", "putB", 0),
]
"""Two philosophers and two forks: each takes one fork and then the other."""


def legal_markings(net: GearNet) -> set[Marking]:
    """Every marking with each gear marked exactly once, by brute force."""
    found = set()
    for choice in product(*(gear.places for gear in net.gears)):
        at = frozenset(choice)
        if all(choice[g] == p for p in at for g in net.slots[p]):
            found.add(at)
    return found


def random_legal_marking(net: GearNet, rng: random.Random) -> Marking:
    """Operation places first, each with all its robots where they are free; then waits."""
    at: dict[int, int] = {}
    places = list(range(len(net.threaded.places)))
    rng.shuffle(places)
    for place in places:
        free = all(robot not in at for robot in net.slots[place])
        if free and (len(net.slots[place]) == 1 or rng.random() < 0.5):
            at.update((robot, place) for robot in net.slots[place])
    for number, gear in enumerate(net.gears):
        waits = [p for p in gear.places if net.slots[p] == (number,)]
        at.setdefault(number, rng.choice(waits))
    return frozenset(at.values())


def fair_run(net: GearNet, marking: Marking, steps: int, rng: random.Random) -> list[int]:
    """Events fired one by one, each time one of those that fired least often."""
    petri = net.threaded.net
    fired = [0] * len(petri.transitions)
    record = []
    for _ in range(steps):
        ready = enabled(petri, marking)
        if not ready:
            break
        least = min(fired[e] for e in ready)
        event = rng.choice([e for e in ready if fired[e] == least] + [rng.choice(ready)])
        marking = follower(petri, marking, (event,))
        fired[event] += 1
        record.append(event)
    return record


def random_marked_net(rng: random.Random) -> MarkedNet:
    """A small marked graph of any shape: circuits, chords, open ends, loops, any tokens."""
    events = rng.randint(1, 5)
    names = [f"t{i}" for i in range(events)]
    edges = []
    if rng.random() < 0.7:
        for a, b in zip(names, names[1:] + names[:1], strict=True):
            edges.append((a, b, rng.choice((0, 0, 1))))
    for _ in range(rng.randint(0, 4)):
        a, b = rng.choice(names), rng.choice(names)
        a = "" if rng.random() < 0.07 else a
        b = "" if rng.random() < 0.04 else b
        edges.append((a, b, rng.choice((0, 0, 1, 1, 2))))
    edges += [(name, name, 1) for name in names if not any(name in e[:2] for e in edges)]
    return net_from(edges)


def rebuilt(net: GearNet, places: tuple[Place, ...], tokens: tuple[int, ...]) -> MarkedNet:
    """The claim that the gears are those of a net whose places have changed."""
    return MarkedNet(PetriNet(net.threaded.transitions, places), tokens, net.gears, net.slots)


def lost_token(net: GearNet, robot: int) -> MarkedNet:
    """Without the token of one robot."""
    subject = MarkedNet.of(net)
    gone = net.initial[robot]
    tokens = tuple(0 if p == gone else t for p, t in enumerate(subject.tokens))
    return replace(subject, tokens=tokens)


def doubled_token(net: GearNet, robot: int) -> MarkedNet:
    """With a second token in one robot's gear, on another place of it alone if there is one."""
    subject = MarkedNet.of(net)
    other = next(
        (p for p in net.gears[robot].places[1:] if net.slots[p] == (robot,)), net.initial[robot]
    )
    tokens = tuple(t + (p == other) for p, t in enumerate(subject.tokens))
    return replace(subject, tokens=tokens)


def missing_producer(net: GearNet, place: int) -> MarkedNet:
    """With nothing that marks one place."""
    places = list(net.threaded.places)
    places[place] = replace(places[place], left=())
    return rebuilt(net, tuple(places), MarkedNet.of(net).tokens)


def unclosed_gear(net: GearNet, robot: int, step: int, event: int) -> MarkedNet:
    """With one place of a robot leading to another transition than the next of its gear."""
    places = list(net.threaded.places)
    place = net.gears[robot].places[step]
    places[place] = replace(places[place], right=(event,))
    return rebuilt(net, tuple(places), MarkedNet.of(net).tokens)


def crossed_twice(net: GearNet, one: int, other: int) -> MarkedNet | None:
    """With two robots that meet sharing a second place: an operation that one does alone becomes
    one of both, spliced into the other's gear. None where there is no such operation."""
    subject = MarkedNet.of(net)
    alone = [p for p in net.gears[one].places if net.slots[p] == (one,)]
    alone = [p for p in alone if net.threaded.places[p].mode not in ("wait", "hold")]
    waits = [p for p in net.gears[other].places if net.slots[p] == (other,)]
    if one == other or not alone or not waits:
        return None
    place, wait = alone[-1], waits[-1]
    a, b = net.threaded.places[place].left[0], net.threaded.places[place].right[0]
    gear, places = net.gears[other], list(net.threaded.places)
    at = gear.places.index(wait)
    later = Place("later", (b,), places[wait].right, "wait", places[wait].label)
    places[wait] = replace(places[wait], right=(a,))
    places[place] = replace(places[place], size=2)
    places.append(later)
    end = len(places) - 1
    longer = Gear(
        gear.robot,
        gear.type,
        (*gear.places[: at + 1], place, end, *gear.places[at + 1 :]),
        (*gear.transitions[: at + 1], a, b, *gear.transitions[at + 1 :]),
    )
    slots = list(net.slots)
    slots[place] = (one, other)
    gears = tuple(longer if g == gear else g for g in net.gears)
    return MarkedNet(
        PetriNet(net.threaded.transitions, tuple(places)),
        (*subject.tokens, 0),
        gears,
        (*slots, (other,)),
    )


def glued(nets: list[GearNet], places: list[int]) -> GearNet:
    """Lemma 5.1: the nets with one place [a; b] of each, and its transitions, made one."""
    events: list[Transition] = []
    made: list[Place] = []
    gears: list[Gear] = []
    slots: list[tuple[int, ...]] = []
    initial: list[int] = []
    joint: list[int] = []
    first = nets[0].threaded.places[places[0]]
    ends = {first.left[0]: 0, first.right[0]: 1}
    for number, (net, place) in enumerate(zip(nets, places, strict=True)):
        at = net.threaded.places[place]
        shift_t = {at.left[0]: 0, at.right[0]: 1}
        if number == 0:
            events = [nets[0].threaded.transitions[e] for e in ends]
            made, slots = [first], [()]
        for e, transition in enumerate(net.threaded.transitions):
            if e not in shift_t:
                shift_t[e] = len(events)
                events.append(replace(transition, name=f"{number}.{transition.name}"))
        shift_p = {place: 0}
        for p, old in enumerate(net.threaded.places):
            if p != place:
                shift_p[p] = len(made)
                left = tuple(shift_t[e] for e in old.left)
                right = tuple(shift_t[e] for e in old.right)
                made.append(replace(old, name=f"{number}.{old.name}", left=left, right=right))
                slots.append(tuple(g + len(gears) for g in net.slots[p]))
        joint += [g + len(gears) for g in net.slots[place]]
        initial += [shift_p[p] for p in net.initial]
        gears += [
            Gear(
                f"n{number}{g.robot}",
                g.type,
                tuple(shift_p[p] for p in g.places),
                tuple(shift_t[e] for e in g.transitions),
            )
            for g in net.gears
        ]
    slots[0] = tuple(joint)
    made[0] = replace(first, left=(0,), right=(1,), size=len(joint))
    return GearNet(
        _threaded(PetriNet(tuple(events), tuple(made)), gears, slots),
        tuple(gears),
        tuple(initial),
        tuple(slots),
    )


def _threaded(net: PetriNet, gears: list[Gear], slots: list[tuple[int, ...]]) -> ThreadedNet:
    """Every robot stays itself."""
    moves: list[list[tuple[tuple[int, int], tuple[int, int]]]] = [[] for _ in net.transitions]
    for number, gear in enumerate(gears):
        for i, place in enumerate(gear.places):
            q = gear.places[(i + 1) % len(gear.places)]
            event = gear.transitions[(i + 1) % len(gear.places)]
            moves[event].append(((place, slots[place].index(number)), (q, slots[q].index(number))))
    return ThreadedNet(net, tuple(tuple(sorted(m)) for m in moves))


def planted(net: GearNet, rng: random.Random, which: int) -> GearNet | MarkedNet:
    """The net with one fault of a kind: a lost or doubled token, a missing producer, two gears that
    cross twice (a lost token where they cannot), an unclosed gear."""
    robot = rng.randrange(len(net.gears))
    return (
        lost_token(net, robot),
        doubled_token(net, robot),
        missing_producer(net, rng.randrange(len(net.threaded.places))),
        crossed_twice(net, robot, 0) or lost_token(net, robot),
        unclosed_gear(net, robot, 0, net.gears[robot].transitions[0]),
    )[which]
