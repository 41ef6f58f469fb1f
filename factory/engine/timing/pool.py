"""How many copies of each part can be in the factory at once, and nets that bound it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from factory.support.errors import Diagnostic, InputError
from factory.theory.nets.marked import MarkedNet, least_tokens
from factory.theory.nets.petri import PetriNet, Place
from factory.theory.plant.factory import Factory


def part_pool(factory: Factory, wip: int | None = None) -> Mapping[str, int]:
    """For each part the greatest number of copies inside: from the start of the operation that
    makes it to the end of dropoff.

    That is the least number of initial tokens on a path from dropoff_e to part_s, for part_s can
    fire no oftener than that beyond dropoff_e. With `wip`, in the net extended by `with_wip`. One
    search for all parts of a unit of a period. Raises InputError (BadValue) where `wip` is below 1.
    """
    net = MarkedNet.of(factory.net) if wip is None else with_wip(factory, wip)
    least_of = [least_tokens(net, dropoff.end) for dropoff in factory.dropoffs]
    pool = {part.label: least_of[part.turn][part.start] for part in factory.leaves}
    return MappingProxyType({label: n for label, n in pool.items() if n is not None})


def with_wip(factory: Factory, wip: int) -> MarkedNet:
    """The net with a place [dropoff_e; part_s] of `wip` tokens for each part; in a period of
    several units from the dropoff of the unit that comes so many before.

    A marked graph in which every new circuit carries tokens, hence still live; not a gear net, so a
    `MarkedNet` without gears, for proofs only. Raises InputError (BadValue) where `wip` is below 1.
    """
    if wip < 1:
        hint = "at least one copy of each part must be let in: --wip 1"
        raise InputError(Diagnostic("BadValue", f"work in process bounded by {wip}", None, hint))
    net = factory.net.threaded.net
    ends = [dropoff.end for dropoff in factory.dropoffs]
    before = [divmod(part.turn - wip, factory.period) for part in factory.leaves]
    extra = tuple(
        Place(f"wip:{o.label}", (ends[turn],), (o.start,), "wip", o.label, 0, o.position)
        for o, (_, turn) in zip(factory.leaves, before, strict=True)
    )
    tokens = MarkedNet.of(factory.net).tokens + tuple(-periods for periods, _ in before)
    return MarkedNet(PetriNet(net.transitions, net.places + extra), tokens)
