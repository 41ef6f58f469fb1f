"""Nets and assembly trees as graphs of networkx."""

from __future__ import annotations

from typing import TYPE_CHECKING

from factory.api import PAG, Factory, GearNet, MarkedNet
from factory.support.errors import Position

if TYPE_CHECKING:
    import networkx as nx


def to_networkx(subject: PAG | Factory | GearNet | MarkedNet) -> nx.DiGraph:
    """A digraph: of a PAG its assembly tree, of a factory or a net the net (T, P).

    Assembly tree: a node for each label, with `kind` (`part` or `assembly`), `operation` and
    `source` (`file:line`, "" where unknown); an edge from each input to what is made of it, with
    `input`, its number in the operation from 1. The graph has the `root`.

    Net: a node for each place (`p0`, `p1`, ...) and transition (`t0`, `t1`, ...), numbered as in
    PNML, with `kind` (`place` or `transition`), `name` and `source`; a place also with `mode`,
    `label`, `size` (l_p), `tokens` (m_0) and `robots`, the names of those whose gears it is in,
    separated by spaces. The arcs are edges.

    All attributes are texts or whole numbers. An import of networkx comes with the first call.
    """
    if isinstance(subject, PAG):
        return _tree(subject)
    return _net(MarkedNet.of(subject.net if isinstance(subject, Factory) else subject))


def _tree(pag: PAG) -> nx.DiGraph:
    import networkx as nx

    graph = nx.DiGraph(root=pag.root)
    for node in pag.nodes:
        kind = "assembly" if node.inputs else "part"
        source = _source(node.position)
        graph.add_node(node.label, kind=kind, operation=node.operation, source=source)
    for node in pag.nodes:
        for number, label in enumerate(node.inputs, start=1):
            graph.add_edge(label, node.label, input=number)
    return graph


def _net(net: MarkedNet) -> nx.DiGraph:
    import networkx as nx

    graph = nx.DiGraph()
    for index, (place, owners) in enumerate(zip(net.net.places, net.owners, strict=True)):
        graph.add_node(
            f"p{index}",
            kind="place",
            name=place.name,
            mode=place.mode,
            label=place.label,
            size=place.size,
            tokens=net.tokens[index],
            robots=" ".join(net.gears[gear].robot for gear in owners),
            source=_source(place.position),
        )
    for index, event in enumerate(net.net.transitions):
        source = _source(event.position)
        graph.add_node(f"t{index}", kind="transition", name=event.name, source=source)
    for index, place in enumerate(net.net.places):
        graph.add_edges_from((f"t{event}", f"p{index}") for event in place.left)
        graph.add_edges_from((f"p{index}", f"t{event}") for event in place.right)
    return graph


def _source(at: Position | None) -> str:
    return f"{at.file}:{at.line}" if at else ""
