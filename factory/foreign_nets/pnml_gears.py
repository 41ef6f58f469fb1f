"""The gears, slots and redistribution functions that a PNML document names for its net."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from factory.foreign_nets.xml_tree import Element
from factory.nets.composition import compose
from factory.nets.gears import Gear, GearNet
from factory.nets.marked import MarkedNet
from factory.nets.petri import PetriNet
from factory.nets.threaded import Redistribution, Slot, ThreadedNet


class Faults(Protocol):
    """What collects faults and raises them."""

    def fault(self, element: Element, message: str, hint: str) -> None:
        """Note a fault at an element."""

    def stop(self) -> None:
        """Raise the faults noted, if any."""


@dataclass(frozen=True, slots=True)
class Document:
    """What a PNML document says: the net, its tokens, numbers by id, and the notes of this project
    about gears, places and transitions."""

    net: PetriNet
    tokens: tuple[int, ...]
    places: Mapping[str, int]
    events: Mapping[str, int]
    gears: tuple[Element, ...]
    about_places: tuple[tuple[Element, ...], ...]
    about_events: tuple[tuple[Element, ...], ...]


def claimed(document: Document, faults: Faults) -> GearNet | MarkedNet:
    """The net with the gears that the document claims.

    A GearNet where each is marked once, every event has a redistribution function and every place
    a slot for each robot that its size speaks of; a MarkedNet where arcs, tokens or notes are
    missing. Raises InputError where notes contradict a net that is whole.
    """
    if not document.gears:
        return MarkedNet(document.net, document.tokens)
    gears = tuple(_gear(document, element) for element in document.gears)
    numbers = {gear.robot: i for i, gear in enumerate(gears)}
    for element, gear in zip(document.gears, gears, strict=True):
        if len(gear.robot.split()) != 1 or len(numbers) < len(gears):
            message = f"the robots of the gears need names of their own; found '{gear.robot}'"
            faults.fault(element, message, "name them r1, r2, ...")
    faults.stop()
    slots = tuple(_slots(tools, numbers) for tools in document.about_places)
    loose = MarkedNet(document.net, document.tokens, gears, slots)
    initial = _initial(loose)
    redistribution = _redistribution(document)
    pairs = zip(document.net.places, slots, strict=True)
    sized = all(place.size == len(own) for place, own in pairs)
    if initial is None or redistribution is None or not sized:
        return loose
    try:
        threaded = ThreadedNet(document.net, redistribution)
    except ValueError as error:
        if not compose(loose).faults:
            hint = "name each slot before and after it once, or leave the notes out"
            faults.fault(document.gears[0], str(error), hint)
            faults.stop()
        return loose
    return GearNet(threaded, gears, initial, slots)


def _gear(document: Document, element: Element) -> Gear:
    """A gear; a place that is gone is left out together with the transition before it."""
    notes = element.attributes
    places = [document.places.get(name, -1) for name in notes.get("places", "").split()]
    events = [document.events.get(name, -1) for name in notes.get("transitions", "").split()]
    if len(places) == len(events):
        pairs = [pair for pair in zip(places, events, strict=True) if pair[0] >= 0]
        places, events = [p for p, _ in pairs], [e for _, e in pairs]
    known = tuple(p for p in places if p >= 0)
    return Gear(notes.get("robot", ""), notes.get("type", ""), known, tuple(events))


def _slots(tools: tuple[Element, ...], numbers: Mapping[str, int]) -> tuple[int, ...]:
    """The robots that a place acts on, by number; -1 for one that has no gear."""
    named = (mode.attributes.get("slots", "") for tool in tools for mode in tool.all("mode"))
    return tuple(numbers.get(robot, -1) for robot in next(named, "").split())


def _initial(net: MarkedNet) -> tuple[int, ...] | None:
    """The marked place of each gear, None where some has none or several."""
    found = []
    for gear in net.gears:
        on = [p for p in gear.places if net.tokens[p]]
        if len(on) != 1:
            return None
        found.append(on[0])
    inside = set(found)
    stray = any(t > 1 or (t and p not in inside) for p, t in enumerate(net.tokens))
    lost = any(min(gear.transitions, default=-1) < 0 for gear in net.gears)
    return None if stray or lost else tuple(found)


def _redistribution(document: Document) -> tuple[Redistribution, ...] | None:
    found: list[Redistribution] = []
    for tools in document.about_events:
        notes = next((n for tool in tools for n in tool.all("redistribution")), None)
        if notes is None:
            return None
        moves = []
        for move in notes.all("move"):
            before = _slot(document, move.attributes.get("from", ""))
            after = _slot(document, move.attributes.get("to", ""))
            if before is None or after is None:
                return None
            moves.append((before, after))
        found.append(tuple(sorted(moves)))
    return tuple(found)


def _slot(document: Document, text: str) -> Slot | None:
    name, _, number = text.partition(" ")
    if name not in document.places or not (number.isascii() and number.isdigit()):
        return None
    return document.places[name], int(number[:9])
