"""Graphviz: the net, one colour for each robot's gear (`--of net`), or the assembly tree
(`--of tree`)."""

from __future__ import annotations

from collections.abc import Iterator

from factory.api import PAG, GearNet, MarkedNet
from factory.apps.exports.subject import Subject
from factory.apps.exports.svg import pag_of, view_of
from factory.apps.exports.swimlanes import colour

FORMAT, TAKES, OF = "dot", "net", "net or tree"


def export(subject: Subject) -> str:
    """The net or the assembly tree as a DOT graph."""
    return write_tree(pag_of(subject)) if view_of(subject) == "tree" else write_dot(subject.net)


def write_dot(net: GearNet | MarkedNet) -> str:
    """A digraph with circles for places and bars for transitions (section 3 of the paper).

    Arcs have the colour of the robot whose gear they belong to; a place with tokens shows them.
    """
    return "\n".join(_lines(MarkedNet.of(net))) + "\n"


def write_tree(pag: PAG) -> str:
    """A digraph from the parts to the product; an assembly shows the operation that makes it."""
    number = {node.label: n for n, node in enumerate(pag.nodes)}
    lines = ["digraph assembly {", '  graph [rankdir=LR, fontname="sans-serif"];']
    lines.append('  node [fontname="sans-serif", fontsize=10, shape=box, style=rounded];')
    for node in pag.nodes:
        words = f"{node.label}\n{node.operation}" if node.inputs else node.label
        lines.append(f"  n{number[node.label]} [label={_quote(words)}];")
    for node in pag.nodes:
        lines += [f"  n{number[label]} -> n{number[node.label]};" for label in node.inputs]
    return "\n".join([*lines, "}"]) + "\n"


def _lines(net: MarkedNet) -> Iterator[str]:
    yield "digraph factory {"
    yield '  graph [rankdir=LR, fontname="sans-serif"];'
    yield '  node [fontname="sans-serif", fontsize=10];'
    for number, gear in enumerate(net.gears):
        yield from _robot(net, number, gear.robot)
    for index in range(len(net.tokens)):
        if len(net.owners[index]) != 1:
            yield f"  {_place(net, index)}"
    for index, transition in enumerate(net.net.transitions):
        name = f'label="", xlabel={_quote(transition.name)}'
        yield f"  t{index} [shape=box, height=0.1, style=filled, fillcolor=black, {name}];"
    yield from _arcs(net)
    yield "}"


def _robot(net: MarkedNet, number: int, robot: str) -> Iterator[str]:
    """A cluster with the places of one robot alone."""
    yield f"  subgraph cluster_{number} {{"
    yield f"    label={_quote(robot)}; color={_quote(colour([number]))}; style=rounded;"
    for place in net.gears[number].places:
        if net.owners[place] == (number,):
            yield f"    {_place(net, place)}"
    yield "  }"


def _place(net: MarkedNet, index: int) -> str:
    place, tokens, owners = net.net.places[index], net.tokens[index], net.owners[index]
    mode = place.mode if place.mode not in ("", place.name) else ""
    shown = [place.name, mode, "●" * tokens if tokens < 5 else f"● {tokens}"]
    label = "\n".join(line for line in shown if line)
    width, paint = 2 if len(owners) > 1 else 1, _quote(colour(owners))
    return f"p{index} [shape=ellipse, penwidth={width}, color={paint}, label={_quote(label)}];"


def _arcs(net: MarkedNet) -> Iterator[str]:
    for index, place in enumerate(net.net.places):
        paint = _quote(colour(net.owners[index]))
        for event in place.left:
            yield f"  t{event} -> p{index} [color={paint}];"
        for event in place.right:
            yield f"  p{index} -> t{event} [color={paint}];"


def _quote(text: str) -> str:
    """A quoted DOT string: backslash and quote escaped, newlines as centred line breaks."""
    safe = text.replace("\\", "\\\\").replace('"', '\\"').replace("\r", " ").replace("\x00", " ")
    return '"' + safe.replace("\n", "\\n") + '"'
