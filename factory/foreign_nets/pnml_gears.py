"""The gears, slots and redistribution functions that a PNML document names for its net."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from factory.foreign_nets.xml_tree import Element, XmlDocument
from factory.nets.composition import compose
from factory.nets.gears import Gear, GearNet
from factory.nets.marked import MarkedNet
from factory.nets.petri import PetriNet
from factory.nets.threaded import Redistribution, Slot, ThreadedNet

Notes = tuple[Element, ...]
"""Elements that a document has for this project alone."""


@dataclass(frozen=True, slots=True)
class NetNotes:
    """What a PNML document says: the net, its tokens, numbers by id, and the notes of this project
    about gears, places and transitions."""

    net: PetriNet
    tokens: tuple[int, ...]
    places: Mapping[str, int]
    events: Mapping[str, int]
    gears: Notes
    about_places: tuple[Notes, ...]
    about_events: tuple[Notes, ...]


def claimed(notes: NetNotes, document: XmlDocument) -> GearNet | MarkedNet:
    """The net with the gears that the document claims.

    A GearNet where each is marked once, every event has a redistribution function and every place
    a slot for each robot that its size speaks of; a MarkedNet where arcs, tokens or notes are
    missing. Raises InputError where notes contradict a net that is whole.
    """
    if not notes.gears:
        return MarkedNet(notes.net, notes.tokens)
    gears = tuple(_gear(notes, element) for element in notes.gears)
    numbers = {gear.robot: i for i, gear in enumerate(gears)}
    for element, gear in zip(notes.gears, gears, strict=True):
        if len(gear.robot.split()) != 1 or len(numbers) < len(gears):
            message = f"the robots of the gears need names of their own; found '{gear.robot}'"
            document.fault(element, message, "name them r1, r2, ...")
    document.stop()
    slots = tuple(_slots(tools, numbers) for tools in notes.about_places)
    loose = MarkedNet(notes.net, notes.tokens, gears, slots)
    initial = _initial(loose)
    redistribution = _redistribution(notes)
    pairs = zip(notes.net.places, slots, strict=True)
    sized = all(place.size == len(own) for place, own in pairs)
    if initial is None or redistribution is None or not sized:
        return loose
    try:
        return GearNet(ThreadedNet(notes.net, redistribution), gears, initial, slots)
    except ValueError as error:
        if not compose(loose).defects:
            hint = "name each slot before and after it once, or leave the notes out"
            document.fault(notes.gears[0], str(error), hint)
            document.stop()
        return loose


def _gear(notes: NetNotes, element: Element) -> Gear:
    """A gear; a place that is gone is left out together with the transition before it."""
    said = element.attributes
    places = [notes.places.get(name, -1) for name in said.get("places", "").split()]
    events = [notes.events.get(name, -1) for name in said.get("transitions", "").split()]
    if len(places) == len(events):
        events = [e for p, e in zip(places, events, strict=True) if p >= 0]
    known = tuple(p for p in places if p >= 0)
    return Gear(said.get("robot", ""), said.get("type", ""), known, tuple(events))


def _slots(tools: Notes, numbers: Mapping[str, int]) -> tuple[int, ...]:
    """The robots that a place acts on, by number; -1 for one that has no gear."""
    named = (mode.attributes.get("slots", "") for tool in tools for mode in tool.all("mode"))
    return tuple(numbers.get(robot, -1) for robot in next(named, "").split())


def _initial(net: MarkedNet) -> tuple[int, ...] | None:
    """The marked place of each gear, None where some has none or several."""
    found = [[p for p in gear.places if net.tokens[p]] for gear in net.gears]
    if any(len(on) != 1 for on in found):
        return None
    inside = {on[0] for on in found}
    stray = any(t > 1 or (t and p not in inside) for p, t in enumerate(net.tokens))
    lost = any(min(gear.transitions, default=-1) < 0 for gear in net.gears)
    return None if stray or lost else tuple(on[0] for on in found)


def _redistribution(notes: NetNotes) -> tuple[Redistribution, ...] | None:
    """d_e of every event, None where one is missing or names what is not there."""
    found: list[Redistribution] = []
    for tools in notes.about_events:
        said = next((n for tool in tools for n in tool.all("redistribution")), None)
        if said is None:
            return None
        moves = []
        for move in said.all("move"):
            before, after = (_slot(notes, move.attributes.get(end, "")) for end in ("from", "to"))
            if before is None or after is None:
                return None
            moves.append((before, after))
        found.append(tuple(sorted(moves)))
    return tuple(found)


def _slot(notes: NetNotes, text: str) -> Slot | None:
    name, _, number = text.partition(" ")
    if name not in notes.places or not (number.isascii() and number.isdigit()):
        return None
    return notes.places[name], int(number[:9])
