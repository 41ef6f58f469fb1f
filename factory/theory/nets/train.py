"""Gear trains: Definition 3.6', the net of a factory whose robots have several tours each.

A gear train is a set of gears (Definition 3.5) that have nothing in common but operations, which
are a place [x_s; x_e] with its two transitions; each gear has a wait of its own before each
operation that it shares, and none is apart from the rest. A gear net is a gear train whose
incidence graph of gears and operations is a tree.

Theorem 1. For a gear train in which each gear carries one token these are equivalent: it is live;
no circuit is free of tokens; there is an order of the transitions in which every gear, from its
token on, ascends. Such an order is found, or a circuit without token, in linear time from the
places without token (Commoner et al. 1971): in each gear they lead from the token around to it. The
circuit never gets one, so what is on it never moves. A train is safe, for each place is on a gear;
a live one is reversible, for it consists of circuits and hangs together (Murata 1989, Theorem 21).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from factory.support.errors import listing
from factory.theory.nets.composition import MOST, Composition, named
from factory.theory.nets.marked import MarkedNet
from factory.theory.nets.verdict import Defect


def train_defects(net: MarkedNet, composition: Composition) -> tuple[Defect, ...]:
    """The defects of a gear train; those of the composition where gears do not fit one by one.
    Linear."""
    if not composition.fitting or not net.gears:
        return composition.defects
    if not composition.defects:
        return ()
    return tuple(islice((*_hasty(net), *_apart(net)), MOST))


def _hasty(net: MarkedNet) -> Iterator[Defect]:
    """Shared operations that directly follow a shared operation in some gear, without a wait."""
    owners, names = net.owners, net.net.places
    for number, gear in enumerate(net.gears):
        for step, place in enumerate(gear.places):
            before = gear.places[step - 1]
            if len(owners[place]) > 1 and len(owners[before]) > 1:
                text = (
                    f"{gear.robot} comes from {names[before].name} to {names[place].name} without"
                    " a wait of its own"
                )
                yield Defect("gear_train", "missing wait", text, (number,), (before, place))


def _apart(net: MarkedNet) -> Iterator[Defect]:
    """Gears that share no operation with the rest, directly or not."""
    owners, seen, queue = net.owners, {0}, [0]
    for gear in queue:
        met = (other for place in net.gears[gear].places for other in owners[place])
        fresh = [other for other in dict.fromkeys(met) if other not in seen]
        seen.update(fresh)
        queue += fresh
    apart = [number for number in range(len(net.gears)) if number not in seen]
    if apart:
        text = f"gears {named(net, apart)} share no operation with the rest, directly or not"
        yield Defect("gear_train", "gears apart", text, tuple(apart))


def dead_train_defects(net: MarkedNet, stuck: tuple[int, ...]) -> Iterator[Defect]:
    """The defects of a gear train whose gears carry one token each, given the transitions that
    never fire: it is not live, because of a circuit without token. With a transition that can fire
    before it stops, it is not reversible either."""
    circuit, names = net.stuck_circuit(stuck), net.net.places
    events = tuple(net.right[place] for place in circuit)
    shown = listing(names[place].name for place in circuit)
    text = f"the circuit through {shown} carries no token"
    gears = tuple(dict.fromkeys(gear for place in circuit for gear in net.owners[place]))
    yield Defect("live", "token-free circuit", text, gears, circuit, events)
    for event in islice(net.enabled(net.tokens), 1):
        yield Defect.no_way_back(net, event)
