"""GraphML, as networkx writes it: the net (`--of net`) or the assembly tree (`--of tree`), with
the attributes of `factory.to_networkx`."""

from __future__ import annotations

from io import BytesIO

from factory.export.pnml import legal
from factory.export.subject import Subject
from factory.export.tree_drawing import pag_of, view_of
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet
from factory.plant.graphs import to_networkx
from factory.problem.pag import PAG

FORMAT, TAKES, OF = "graphml", "net", "net or tree"


def export(subject: Subject) -> str:
    """The net or the assembly tree as GraphML."""
    return write_graphml(pag_of(subject) if view_of(subject) == "tree" else subject.net)


def write_graphml(subject: PAG | GearNet | MarkedNet) -> str:
    """A GraphML document, the same bytes for the same subject."""
    import networkx as nx

    graph, content = to_networkx(subject), BytesIO()
    for attributes in graph.nodes.values():
        attributes |= {k: legal(v) for k, v in attributes.items() if isinstance(v, str)}
    nx.write_graphml_xml(graph, content, named_key_ids=True)
    return content.getvalue().decode()
