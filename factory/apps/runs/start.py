"""The marking at which a run starts, by the names of places."""

from __future__ import annotations

from collections.abc import Iterable

from factory.api import Diagnostic, GearNet, InputError, Marking
from factory.engine.record.history import unreached
from factory.support.errors import Position, did_you_mean, listing


def legal_marking(net: GearNet, names: str) -> Marking:
    """The marking that a text such as `sub1, r1:sub3` describes; robots it leaves out wait where
    they do initially.

    An operation place is named by the label that it makes, and takes all its robots; a wait place
    by robot and label, `r3:sub1`. Raises InputError (BadMarking) with every fault found: an unknown
    place, a robot marked twice, or an unreachable marking (`unreached`).
    """
    faults: list[Diagnostic] = []
    at: dict[int, int] = {}
    for name, position in _items(names):
        place = net.threaded.net.place_index.get(name)
        if place is None:
            hint = did_you_mean(name, list(net.threaded.net.place_index), "places")
            faults.append(_bad(f"the net has no place '{name}'", position, hint))
            continue
        for robot in net.slots[place]:
            if at.setdefault(robot, place) != place:
                faults.append(_twice(net, robot, (at[robot], place), position))
    if faults:
        raise InputError(faults)
    for number, start in enumerate(net.initial):
        at.setdefault(number, start)
    marking = _whole(net, at, names)
    circuit = () if net.is_tree else unreached(net, marking)
    if circuit:
        raise InputError(_never(net, circuit, marking, names))
    return marking


def _never(net: GearNet, circuit: tuple[int, ...], marking: Marking, names: str) -> Diagnostic:
    """The diagnostic of a circuit whose number of tokens is not that of m_0."""
    here, always = (sum(p in m for p in circuit) for m in (marking, net.initial_marking))
    shown = listing(net.threaded.places[p].name for p in circuit)
    message = (
        f"the marking is unreachable: the circuit through {shown} would carry"
        f" {here or 'no'} token{'' if here == 1 else 's'} instead of {always}"
    )
    numbers = dict.fromkeys(robot for p in circuit for robot in net.slots[p])
    robots = listing(net.gears[robot].robot for robot in numbers)
    return _bad(message, Position("--from", 1, 1, names), f"say where each of {robots} is")


def _items(names: str) -> Iterable[tuple[str, Position]]:
    start = 0
    for item in names.split(","):
        name = item.strip()
        column = start + len(item) - len(item.lstrip()) + 1
        if name:
            yield name, Position("--from", 1, column, names)
        start += len(item) + 1


def _bad(message: str, position: Position, hint: str) -> Diagnostic:
    return Diagnostic("BadMarking", message, position, hint)


def _twice(net: GearNet, robot: int, places: tuple[int, int], position: Position) -> Diagnostic:
    """The diagnostic of a robot at two places."""
    named = [net.threaded.places[p].name for p in places]
    message = f"{net.gears[robot].robot} is marked twice: at {named[0]} and at {named[1]}"
    hints = [
        f"{named[i]} needs all its robots, " + ", ".join(net.gears[r].robot for r in net.slots[p])
        for i, p in enumerate(places)
        if len(net.slots[p]) > 1
    ]
    return _bad(message, position, "; ".join(hints) or "name one place for each robot")


def _whole(net: GearNet, at: dict[int, int], names: str) -> Marking:
    """The marking of these places. Raises InputError where an operation lacks one of its robots."""
    for robot, place in sorted(at.items()):
        missing = [r for r in net.slots[place] if at.get(r) != place]
        if missing:
            lacking = ", ".join(net.gears[r].robot for r in missing)
            name = net.threaded.places[place].name
            message = f"{net.gears[robot].robot} is at {name}, which also needs {lacking}"
            hint = f"name {name}, which takes all its robots"
            raise InputError(_bad(message, Position("--from", 1, 1, names), hint))
    return frozenset(at.values())
