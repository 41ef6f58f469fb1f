"""What can be said of any net: with gears claimed, discovered or none, with choice or without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from factory.foreign_nets.discover import discover
from factory.foreign_nets.explore import LIMIT
from factory.nets.behaviour import behaviour
from factory.nets.gears import Gear, GearNet
from factory.nets.marked import MarkedNet
from factory.nets.verdict import Fault, Verdict, testify
from factory.nets.verify import verify
from factory.support.errors import Position


def analyse(
    net: GearNet | MarkedNet,
    sources: Mapping[str, Position] | None = None,
    limit: int = LIMIT,
) -> Verdict:
    """The verdict on a net that may come from elsewhere.

    Where it claims gears, these are checked as `verify` does; else they are discovered. Without
    gears there is no legal marking to speak of: `legal` is None.
    """
    if isinstance(net, GearNet) or net.gears:
        return verify(net, sources, limit)
    gears, faults = discover(net)
    if gears:
        return verify(with_gears(net, gears), sources, limit)
    found = behaviour(net, (), limit)
    text = "undecided: a legal marking marks each gear once, and the net has no gears"
    every = (*faults, *found.faults, Fault("legal", "undecided", text))
    return Verdict(
        False,
        found.live,
        found.safe,
        found.reversible,
        None,
        testify(net, (), every, sources),
        (),
        found.method,
    )


def with_gears(net: MarkedNet, gears: tuple[Gear, ...]) -> MarkedNet:
    """The net with gears, sizes and slots that fit them."""
    owners: list[list[int]] = [[] for _ in net.net.places]
    for number, gear in enumerate(gears):
        for place in gear.places:
            owners[place].append(number)
    pairs = zip(net.net.places, owners, strict=True)
    places = tuple(replace(place, size=len(own)) for place, own in pairs)
    return MarkedNet(replace(net.net, places=places), net.tokens, gears, tuple(map(tuple, owners)))
