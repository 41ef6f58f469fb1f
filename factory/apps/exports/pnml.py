"""PNML 2009 (ISO/IEC 15909-2), place/transition nets: the net for other tools, and back.

Nodes have the positions of the SVG drawing. What the standard does not define (gears, modes,
labels, slots and redistribution functions) is in `toolspecific` elements of tool `factory`,
version 1. `foreign_nets.pnml_reader` reads a legally marked gear net back as an equal value.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from factory.api import Gear, GearNet, LayoutMachines, MarkedNet, Place, Project, Transition
from factory.apps.drawing.markup import escape, quoteattr
from factory.apps.exports.subject import Subject
from factory.apps.exports.swimlanes import Swimlanes, swimlanes
from factory.support.boxes import Point2
from factory.support.errors import Position

FORMAT, TAKES = "pnml", "net"
OF = "net or, of a PAG, coordinated"

PNML = "http://www.pnml.org/version-2009/grammar/pnml"
NET_TYPE = "http://www.pnml.org/version-2009/grammar/ptnet"

BELOW, ABOVE = (0.0, 22.0), (0.0, -26.0)
"""Offsets of names from their nodes."""

ROUND, BAR = (24.0, 24.0), 6.0
"""Size of a place, width of a transition's bar."""

Moves = tuple[tuple[tuple[int, int], tuple[int, int]], ...]
"""From which slot of a place to which robots go as a transition fires."""

_ILLEGAL = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def export(subject: Subject) -> str:
    """The net as PNML; `coordinated` with hands, magazines and the tray, as it runs. Raises
    InputError (Usage)."""
    wanted = ["net", "coordinated"] if isinstance(subject.source, Project) else ["net"]
    if subject.choose(wanted, "choices") == "net":
        return write_pnml(subject.net)
    return write_pnml(LayoutMachines(subject.project.layout).coordinated.net)


def write_pnml(net: GearNet | MarkedNet) -> str:
    """The net and its initial marking as a PNML document, the same bytes for the same net."""
    return "\n".join(_lines(net)) + "\n"


def _lines(net: GearNet | MarkedNet) -> Iterator[str]:
    subject = MarkedNet.of(net)
    at = swimlanes(subject)
    moves = net.threaded.redistribution if isinstance(net, GearNet) else ()
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f"<pnml xmlns={quoteattr(PNML)}>"
    yield f'<net id="net" type={quoteattr(NET_TYPE)}>'
    if subject.gears:
        yield _tool(_gear(gear) for gear in subject.gears)
    yield '<page id="page">'
    for index, place in enumerate(subject.net.places):
        yield from _place(subject, index, place, at)
    for index, transition in enumerate(subject.net.transitions):
        move = moves[index] if moves else None
        low, high = at.spans[index]
        graphics = _drawn(at.middle(index), (BAR, high - low))
        yield from _transition(index, transition, move, graphics)
    yield from _arcs(subject)
    yield "</page>\n</net>\n</pnml>"


def _tool(content: Iterable[str]) -> str:
    inner = "".join(content)
    return f'<toolspecific tool="factory" version="1">{inner}</toolspecific>'


def legal(text: str) -> str:
    """A text with ? for each character that XML does not allow."""
    return _ILLEGAL.sub("?", text)


def _attribute(name: str, value: object) -> str:
    return f" {name}={quoteattr(legal(str(value)))}"


def _gear(gear: Gear) -> str:
    attributes = (
        _attribute("robot", gear.robot),
        _attribute("type", gear.type),
        _attribute("places", " ".join(f"p{p}" for p in gear.places)),
        _attribute("transitions", " ".join(f"t{e}" for e in gear.transitions)),
    )
    return f"\n<gear{''.join(attributes)}/>"


def _name(name: str, offset: Point2) -> str:
    """A node's name, with the offset at which it is drawn."""
    place = f'<graphics><offset x="{offset[0]:.0f}" y="{offset[1]:.0f}"/></graphics>'
    return f"<name>{place}<text>{escape(legal(name))}</text></name>"


def _source(at: Position | None) -> str:
    if at is None:
        return ""
    where = _attribute("file", at.file) + _attribute("line", at.line)
    return f"<source{where}{_attribute('column', at.column)}/>"


def _drawn(at: Point2, size: Point2) -> str:
    """Position and size of a node in the drawing."""
    position = f'<position x="{at[0]:.0f}" y="{at[1]:.0f}"/>'
    return f'<graphics>{position}<dimension x="{size[0]:.0f}" y="{size[1]:.0f}"/></graphics>'


def _place(net: MarkedNet, index: int, place: Place, at: Swimlanes) -> Iterator[str]:
    attributes = [_attribute("mode", place.mode), _attribute("label", place.label)]
    attributes.append(_attribute("size", place.size))
    if net.slots:
        robots = " ".join(net.gears[g].robot for g in net.slots[index] if 0 <= g < len(net.gears))
        attributes.append(_attribute("slots", robots))
    tokens = net.tokens[index]
    yield f'<place id="p{index}">{_name(place.name, BELOW)}{_drawn(at.places[index], ROUND)}'
    if tokens:
        yield f"<initialMarking><text>{tokens}</text></initialMarking>"
    yield _tool([f"<mode{''.join(attributes)}/>", _source(place.position)]) + "</place>"


def _transition(
    index: int, transition: Transition, moves: Moves | None, graphics: str
) -> Iterator[str]:
    content = []
    if moves is not None:
        pairs = "".join(f'<move from="p{p} {i}" to="p{q} {j}"/>' for (p, i), (q, j) in moves)
        content.append(f"<redistribution>{pairs}</redistribution>")
    content.append(_source(transition.position))
    extra = _tool(content) if any(content) else ""
    name = _name(transition.name, ABOVE)
    yield f'<transition id="t{index}">{name}{graphics}{extra}</transition>'


def _arcs(net: MarkedNet) -> Iterator[str]:
    ends: list[tuple[str, str]] = []
    for index, place in enumerate(net.net.places):
        ends += [(f"t{e}", f"p{index}") for e in place.left]
        ends += [(f"p{index}", f"t{e}") for e in place.right]
    for number, (source, target) in enumerate(ends):
        yield f'<arc id="a{number}" source="{source}" target="{target}"/>'
