"""Reading PNML: an XML tree to a net, with every fault of the document at its line and column.

Elements of this project name the gears of a net, the slots of its places and the redistribution
functions of its transitions.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from factory.api import Gear, GearNet, GearProof, MarkedNet, PetriNet, Place, Transition, read_text
from factory.support.collector import collector_paused
from factory.support.errors import Position, did_you_mean
from factory.support.files import NET
from factory.support.xml_tree import Element, XmlDocument
from factory.theory.problem.ids import PlaceId, TransitionId

N = TypeVar("N", bound=int)
Moves = tuple[tuple[tuple[PlaceId, int], tuple[PlaceId, int]], ...]
"""Which slot of a place goes to which, as an event fires."""

Events = list[TransitionId]
Numbers = Mapping[str, N]

DRAWN = frozenset({"graphics"})
"""Elements that describe the drawing of a net, and are not read."""

FORM = (
    'a net starts <pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">'
    '<net id="n" type="http://www.pnml.org/version-2009/grammar/ptnet"><page id="p">'
)
WEIGHT = "the paper's nets have arcs of weight 1"

SUGGESTIONS = 20
"""Greatest number of unknown nodes that get a suggestion, since these take time."""

_NODES = ("place", "transition", "referencePlace", "referenceTransition")
_NUMBER = re.compile(r"[0-9]{1,9}")
_DIGITS = re.compile(r"[0-9]+")


@collector_paused()
def read_pnml(text: str, file: str = "<text>") -> GearNet | MarkedNet:
    """The net in a PNML document, with its initial marking.

    A gear net where the document names the gears and they can be read as a claim (`verify` checks
    it), else a marked net. Raises InputError: Syntax where it is no XML, BadNet where it is no
    place/transition net with arcs of weight 1.
    """
    document = XmlDocument(file, text.split("\n"), "BadNet")
    return _Reader(document).net(document.read(text, DRAWN))


def load_net(file: Path) -> GearNet | MarkedNet:
    """The net in a PNML file. Raises InputError as `read_pnml` does, and where the file cannot be
    read."""
    return read_pnml(read_text(file, NET), str(file))


class _Reader:
    """The nodes of a document by their ids, and its arcs."""

    def __init__(self, document: XmlDocument) -> None:
        self.document, self.fault, self.stop = document, document.fault, document.stop
        self.nodes: dict[str, Element] = {}
        self.arcs: list[Element] = []

    def net(self, root: Element) -> GearNet | MarkedNet:
        """The only net of the document."""
        net = self._only_net(root)
        self._collect(net)
        self.stop()
        targets = {name: self._resolve(element) for name, element in self.nodes.items()}
        self.stop()
        places = [name for name, e in self.nodes.items() if e.name == "place"]
        events = [name for name, e in self.nodes.items() if e.name == "transition"]
        left, right = self._connect(places, events, targets)
        tokens = tuple(self._tokens(self.nodes[name]) for name in places)
        self.stop()
        transitions = tuple(
            Transition(name, self._source(self.nodes[key]))
            for key, name in self._names(events).items()
        )
        made = tuple(
            self._place(key, name, left[key], right[key])
            for key, name in self._names(places).items()
        )
        marked = MarkedNet(PetriNet(transitions, made), tokens)
        gears = list(_notes(net, "gear"))
        return self._claimed(marked, gears, places, events) if gears else marked

    def _claimed(
        self, net: MarkedNet, elements: list[Element], places: list[str], events: list[str]
    ) -> GearNet | MarkedNet:
        """The net with the gears that the document claims.

        A GearNet where each is marked once, every event has a redistribution function and every
        place a slot for each robot that its size speaks of; a MarkedNet where arcs, tokens or notes
        are missing. Raises InputError where notes contradict a net that is whole.
        """
        place_index, event_index = _numbers(places, PlaceId), _numbers(events, TransitionId)
        gears = tuple(_gear(element, place_index, event_index) for element in elements)
        robots = _numbers((gear.robot for gear in gears), int)
        for element, gear in zip(elements, gears, strict=True):
            if len(gear.robot.split()) != 1 or len(robots) < len(gears):
                message = f"the robots of the gears need names of their own; found '{gear.robot}'"
                self.fault(element, message, "name them r1, r2, ...")
        self.stop()
        slots = tuple(_slots(self.nodes[name], robots) for name in places)
        loose = MarkedNet(net.net, net.tokens, gears, slots)
        initial = _initial(loose)
        moves = [_redistribution(self.nodes[name], place_index) for name in events]
        redistribution = tuple(move for move in moves if move is not None)
        pairs = zip(net.net.places, slots, strict=True)
        sized = all(place.size == len(owners) for place, owners in pairs)
        if initial is None or len(redistribution) < len(moves) or not sized:
            return loose
        try:
            return GearNet.of(net.net, redistribution, gears, initial, slots)
        except ValueError as error:
            if not GearProof.of(loose).composition.defects:
                hint = "name each slot before and after it once, or leave the notes out"
                self.fault(elements[0], str(error), hint)
                self.stop()
            return loose

    def _only_net(self, root: Element) -> Element:
        if root.name != "pnml":
            self.fault(root, f"the root element is <{root.name}>, not <pnml>", FORM)
            self.stop()
        nets = list(root.all("net"))
        if len(nets) != 1:
            self.fault(nets[1] if nets else root, f"{len(nets)} nets, where one is wanted", FORM)
            self.stop()
        kind = nets[0].attributes.get("type", "")
        if kind.rpartition("/")[2] != "ptnet":
            typed = f"of type '{kind}'" if kind else "without a type"
            self.fault(nets[0], f"a net {typed}, not a place/transition net", FORM)
        if nets[0].first("page") is None:
            self.fault(nets[0], "the net has no page", 'wrap its nodes in <page id="page">')
        return nets[0]

    def _collect(self, net: Element) -> None:
        """The nodes by their ids, and the arcs, of every page."""
        ids: dict[str, Element] = {}
        stack = [net]
        while stack:
            element = stack.pop()
            self._identify(element, ids)
            stack.extend(reversed(list(element.all("page"))))
            for child in element.children:
                if child.name not in (*_NODES, "arc"):
                    continue
                if element is net:
                    self.fault(child, f"a <{child.name}> outside every page", "move it into a page")
                    continue
                self._identify(child, ids)
                if child.name == "arc":
                    self.arcs.append(child)
                else:
                    self.nodes[child.attributes.get("id", "")] = child

    def _identify(self, element: Element, ids: dict[str, Element]) -> None:
        name = element.attributes.get("id")
        if not name:
            self.fault(element, f"a <{element.name}> without id", "give it an id of its own")
        elif name in ids:
            first = f"line {ids[name].line} has it too: every id stands once"
            self.fault(element, f"the id '{name}' is used twice", first)
        else:
            ids[name] = element

    def _resolve(self, element: Element) -> str:
        """The id of the node to which a reference finally refers; of a node, its own id. References
        passed on the way are shortened to that node."""
        start, seen = element, dict[str, Element]()
        while element.name.startswith("reference"):
            name = element.attributes.get("ref", "")
            kind = start.name.removeprefix("reference").lower()
            if name in seen or name not in self.nodes:
                what = "stands for itself" if name in seen else f"refers to unknown '{name}'"
                self.fault(start, f"a <{start.name}> {what}", self._known(name))
                return ""
            element = seen[name] = self.nodes[name]
            if kind not in element.name.lower():
                self.fault(start, f"a <{start.name}> refers to a {element.name}", f"name a {kind}")
                return ""
        for passed in seen.values():
            if passed is not element:
                passed.attributes["ref"] = element.attributes["id"]
        return element.attributes["id"]

    def _known(self, name: str) -> str:
        if len(self.document.faults) >= SUGGESTIONS:
            return "name a node of the net"
        return did_you_mean(name, list(self.nodes)[:1000], "nodes")

    def _connect(
        self, places: Iterable[str], events: Iterable[str], targets: dict[str, str]
    ) -> list[dict[str, Events]]:
        """For each place its producers and consumers, in the order of the arcs."""
        both: list[dict[str, Events]] = [{name: [] for name in places} for _ in range(2)]
        left, right = both
        number, seen = _numbers(events, TransitionId), set[tuple[str, str]]()
        for arc in self.arcs:
            ends = self._ends(arc, targets)
            if ends is None:
                continue
            if ends in seen:
                self.fault(arc, f"a second arc from '{ends[0]}' to '{ends[1]}'", WEIGHT)
            seen.add(ends)
            if ends[0] in number and ends[1] in left:
                left[ends[1]].append(number[ends[0]])
            elif ends[0] in left and ends[1] in number:
                right[ends[0]].append(number[ends[1]])
            else:
                kind = self.nodes[ends[0]].name
                hint = "an arc joins a place and a transition"
                self.fault(arc, f"an arc from {kind} '{ends[0]}' to {kind} '{ends[1]}'", hint)
        return both

    def _ends(self, arc: Element, targets: dict[str, str]) -> tuple[str, str] | None:
        ends = []
        for side in ("source", "target"):
            name = arc.attributes.get(side, "")
            if name not in targets:
                what = f"unknown node '{name}'" if name else "nothing"
                self.fault(arc, f"the {side} of an arc is {what}", self._known(name))
            else:
                ends.append(targets[name])
        weight = arc.content("inscription", "1")
        if weight != "1":
            self.fault(arc, f"an arc of weight '{weight}'", WEIGHT)
        kind = arc.first("type")
        called = "" if kind is None else kind.attributes.get("value") or arc.content("type", "")
        if called not in ("", "normal"):
            self.fault(arc, f"an arc of type '{called}'", "only normal arcs are understood")
        return (ends[0], ends[1]) if len(ends) == 2 else None

    def _tokens(self, place: Element) -> int:
        marking = place.first("initialMarking")
        content = place.content("initialMarking", "0")
        if marking is not None and not _NUMBER.fullmatch(content):
            hint = "a number of tokens from 0 to 999999999 as <text>"
            self.fault(marking, f"the initial marking is '{content}'", hint)
            return 0
        return int(content)

    def _names(self, ids: Iterable[str]) -> dict[str, str]:
        """A name for each id: the node's name where it is unique, otherwise the id. Where an id is
        the name of another node, all names are ids."""
        written = {key: self.nodes[key].content("name", "") or key for key in ids}
        count = Counter(written.values())
        names = {key: name if count[name] == 1 else key for key, name in written.items()}
        return names if len(set(names.values())) == len(names) else {key: key for key in names}

    def _source(self, element: Element) -> Position:
        """The user's line that the document names for a node, else the node's own."""
        for source in _notes(element, "source"):
            notes = source.attributes
            line, column = notes.get("line", ""), notes.get("column", "")
            if _NUMBER.fullmatch(line) and _NUMBER.fullmatch(column):
                return Position(notes.get("file", "?"), int(line), int(column))
        return self.document.at(element)

    def _place(self, key: str, name: str, left: Events, right: Events) -> Place:
        element = self.nodes[key]
        mode = next(_notes(element, "mode"), None)
        notes = {} if mode is None else mode.attributes
        size = notes.get("size", "1")
        if not _NUMBER.fullmatch(size):
            self.fault(mode or element, f"the size of a mode is '{size}'", "give a number")
            self.stop()
        return Place(
            name,
            tuple(left),
            tuple(right),
            notes.get("mode", ""),
            notes.get("label", ""),
            int(size),
            self._source(element),
        )


def _notes(element: Element, name: str) -> Iterator[Element]:
    """The elements of this project within another, by name."""
    for tool in element.all("toolspecific"):
        if tool.attributes.get("tool") == "factory":
            yield from tool.all(name)


def _numbers(names: Iterable[str], kind: Callable[[int], N]) -> dict[str, N]:
    return {name: kind(number) for number, name in enumerate(names)}


def _gear(element: Element, places: Numbers[PlaceId], events: Numbers[TransitionId]) -> Gear:
    """A gear; a place that is gone is left out together with the transition before it."""
    notes = element.attributes
    through = [places.get(name, PlaceId(-1)) for name in notes.get("places", "").split()]
    turns = [events.get(name, MarkedNet.NONE) for name in notes.get("transitions", "").split()]
    if len(through) == len(turns):
        turns = [e for p, e in zip(through, turns, strict=True) if p >= 0]
    present = tuple(p for p in through if p >= 0)
    return Gear(notes.get("robot", ""), notes.get("type", ""), present, tuple(turns))


def _slots(place: Element, robots: Mapping[str, int]) -> tuple[int, ...]:
    """The robots that a place acts on, by number; -1 for one that has no gear."""
    named = (mode.attributes.get("slots", "") for mode in _notes(place, "mode"))
    return tuple(robots.get(robot, -1) for robot in next(named, "").split())


def _initial(net: MarkedNet) -> tuple[PlaceId, ...] | None:
    """The marked place of each gear, None where some has none or several."""
    marked = [[p for p in gear.places if net.tokens[p]] for gear in net.gears]
    if any(len(on) != 1 for on in marked):
        return None
    inside = {on[0] for on in marked}
    stray = any(t > 1 or (t and p not in inside) for p, t in enumerate(net.tokens))
    lost = any(min(gear.transitions, default=-1) < 0 for gear in net.gears)
    return None if stray or lost else tuple(on[0] for on in marked)


def _redistribution(event: Element, places: Mapping[str, PlaceId]) -> Moves | None:
    """d_e of an event, None where it is missing or names what is not there."""
    note = next(_notes(event, "redistribution"), None)
    if note is None:
        return None
    moves = []
    for move in note.all("move"):
        slots = [move.attributes.get(end, "").partition(" ") for end in ("from", "to")]
        if any(name not in places or not _DIGITS.fullmatch(i) for name, _, i in slots):
            return None
        before, after = ((places[name], int(i[:9])) for name, _, i in slots)
        moves.append((before, after))
    return tuple(sorted(moves))
