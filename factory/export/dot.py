"""Graphviz: the net as a drawing, one colour for each robot's gear, tokens as dots."""

from __future__ import annotations

from collections.abc import Iterator

from factory.export import net_of
from factory.factory import Factory
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet, marked

FORMAT = "dot"

_COLOURS = (
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#8c6d00", "#56b4e9", "#7f3c8d", "#e73f74",
)  # fmt: skip


def export(subject: Factory | GearNet | MarkedNet) -> str:
    """The net as a DOT graph."""
    return write_dot(net_of(subject))


def write_dot(net: GearNet | MarkedNet) -> str:
    """A digraph with circles for places and bars for transitions (section 3 of the paper).

    Arcs have the colour of the robot whose gear they belong to; a place with tokens shows them.
    """
    return "\n".join(_lines(marked(net))) + "\n"


def _lines(net: MarkedNet) -> Iterator[str]:
    owners = _owners(net)
    yield "digraph factory {"
    yield '  graph [rankdir=LR, fontname="sans-serif"];'
    yield '  node [fontname="sans-serif", fontsize=10];'
    for number, gear in enumerate(net.gears):
        yield from _robot(net, number, gear.robot, owners)
    for index in range(len(net.tokens)):
        if len(owners[index]) != 1:
            yield f"  {_place(net, index, owners[index])}"
    for index, transition in enumerate(net.net.transitions):
        name = f'label="", xlabel={_quote(transition.name)}'
        yield f"  t{index} [shape=box, height=0.1, style=filled, fillcolor=black, {name}];"
    yield from _arcs(net, owners)
    yield "}"


def _owners(net: MarkedNet) -> list[list[int]]:
    owners: list[list[int]] = [[] for _ in net.tokens]
    for number, gear in enumerate(net.gears):
        for place in gear.places:
            owners[place].append(number)
    return owners


def _robot(net: MarkedNet, number: int, robot: str, owners: list[list[int]]) -> Iterator[str]:
    """A cluster with the places of one robot alone."""
    yield f"  subgraph cluster_{number} {{"
    yield f"    label={_quote(robot)}; color={_quote(_colour([number]))}; style=rounded;"
    for place in net.gears[number].places:
        if owners[place] == [number]:
            yield f"    {_place(net, place, [number])}"
    yield "  }"


def _place(net: MarkedNet, index: int, owners: list[int]) -> str:
    place, tokens = net.net.places[index], net.tokens[index]
    mode = place.mode if place.mode not in ("", place.name) else ""
    shown = [place.name, mode, "●" * tokens if tokens < 5 else f"● {tokens}"]
    label = "\n".join(line for line in shown if line)
    width = 2 if len(owners) > 1 else 1
    colour = _quote(_colour(owners))
    return f"p{index} [shape=ellipse, penwidth={width}, color={colour}, label={_quote(label)}];"


def _arcs(net: MarkedNet, owners: list[list[int]]) -> Iterator[str]:
    for index, place in enumerate(net.net.places):
        colour = _quote(_colour(owners[index]))
        for event in place.left:
            yield f"  t{event} -> p{index} [color={colour}];"
        for event in place.right:
            yield f"  p{index} -> t{event} [color={colour}];"


def _colour(owners: list[int]) -> str:
    return _COLOURS[owners[0] % len(_COLOURS)] if len(owners) == 1 else "#333333"


def _quote(text: str) -> str:
    """A quoted DOT string: backslash and quote escaped, newlines as centred line breaks."""
    safe = text.replace("\\", "\\\\").replace('"', '\\"').replace("\r", " ").replace("\x00", " ")
    return '"' + safe.replace("\n", "\\n") + '"'
