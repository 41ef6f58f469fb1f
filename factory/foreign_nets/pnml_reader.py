"""Reading PNML: an XML tree to a net, with every fault of the document at its line and column."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from factory.foreign_nets.pnml_gears import NetNotes, claimed
from factory.foreign_nets.xml_tree import Element, XmlDocument
from factory.lang.source import read_text
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet
from factory.nets.petri import PetriNet, Place, Transition
from factory.support.collector import collector_paused
from factory.support.errors import Position, did_you_mean
from factory.support.files import NET

DRAWN = frozenset({"graphics"})
"""Elements that say how a net looks, and are not read."""

FORM = (
    'a net starts <pnml xmlns="http://www.pnml.org/version-2009/grammar/pnml">'
    '<net id="n" type="http://www.pnml.org/version-2009/grammar/ptnet"><page id="p">'
)
WEIGHT = "the paper's nets have arcs of weight 1"

SUGGESTIONS = 20
"""The most unknown nodes that get a suggestion, which takes time."""

_NODES = ("place", "transition", "referencePlace", "referenceTransition")
_NUMBER = re.compile(r"[0-9]{1,9}")


@collector_paused()
def read_pnml(text: str, file: str = "<text>") -> GearNet | MarkedNet:
    """The net in a PNML document, with its initial marking.

    A gear net where the document names the gears and they can be read as a claim (`verify` checks
    it), else a marked net. Raises InputError: Syntax where it is no XML, BadNet where it is no
    place/transition net with arcs of weight 1.
    """
    document = XmlDocument(file, text.split("\n"))
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
        """The one net of the document."""
        found = self._only_net(root)
        self._collect(found)
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
        notes = NetNotes(
            PetriNet(transitions, made),
            tokens,
            {name: i for i, name in enumerate(places)},
            {name: i for i, name in enumerate(events)},
            tuple(gear for tool in tools(found) for gear in tool.all("gear")),
            tuple(tuple(tools(self.nodes[name])) for name in places),
            tuple(tuple(tools(self.nodes[name])) for name in events),
        )
        return claimed(notes, self.document)

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
            found = f"of type '{kind}'" if kind else "without a type"
            self.fault(nets[0], f"a net {found}, not a place/transition net", FORM)
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
        """The id of the node that a reference stands for in the end; of a node, its own. What it
        passes on the way then stands for that node at once."""
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
    ) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
        """For each place its producers and consumers, in the order of the arcs."""
        left: dict[str, list[int]] = {name: [] for name in places}
        right: dict[str, list[int]] = {name: [] for name in left}
        number = {name: i for i, name in enumerate(events)}
        seen: set[tuple[str, str]] = set()
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
        return left, right

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
        """A name for each id: its own name where that is not another's, too; else the id. Where
        an id is the name of another, every name is an id."""
        wanted = {key: self.nodes[key].content("name", "") or key for key in ids}
        count = Counter(wanted.values())
        names = {key: name if count[name] == 1 else key for key, name in wanted.items()}
        return names if len(set(names.values())) == len(names) else {key: key for key in names}

    def _source(self, element: Element) -> Position:
        """The user's line that the document names for a node, else the node's own."""
        for tool in tools(element):
            for source in tool.all("source"):
                notes = source.attributes
                line, column = notes.get("line", ""), notes.get("column", "")
                if _NUMBER.fullmatch(line) and _NUMBER.fullmatch(column):
                    return Position(notes.get("file", "?"), int(line), int(column))
        return self.document.at(element)

    def _place(self, key: str, name: str, left: list[int], right: list[int]) -> Place:
        element = self.nodes[key]
        mode = next((m for tool in tools(element) for m in tool.all("mode")), None)
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


def tools(element: Element) -> list[Element]:
    """The toolspecific elements of this project."""
    return [t for t in element.all("toolspecific") if t.attributes.get("tool") == "factory"]
