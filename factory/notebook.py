"""The pictures of values in a notebook, put in when the package is imported."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from factory.support.showing import DRAWINGS

if TYPE_CHECKING:
    from factory.engine.simulation.run import Run
    from factory.floor.layout.certificate import Certificate
    from factory.floor.layout.layout import Layout
    from factory.theory.nets.gears import GearNet
    from factory.theory.nets.marked import MarkedNet
    from factory.theory.nets.verdict import Verdict
    from factory.theory.plant.factory import Factory
    from factory.theory.problem.pag import PAG

LARGE = 400
"""The most nodes of a tree, places of a net or robots of a layout that are drawn."""


def _tree(pag: PAG) -> str | None:
    from factory.apps.exports.svg import draw_tree

    return draw_tree(pag) if len(pag) <= LARGE else None


def _net(net: GearNet | MarkedNet, title: str = "net") -> str | None:
    from factory.apps.exports.svg import draw_net
    from factory.theory.nets.marked import MarkedNet

    made = MarkedNet.of(net)
    return draw_net(made, title) if len(made.tokens) <= LARGE else None


def _factory(factory: Factory) -> str | None:
    return _net(factory.net, factory.pag.root)


def _floor(layout: Layout) -> str | None:
    from factory.apps.exports.floor_sheet import write_svg

    return write_svg(layout) if len(layout.factory.robots) <= LARGE else None


def _run(run: Run) -> str:
    """The report of a run that was logged; of another its figures."""
    from factory.apps.report.page import inline, report_on
    from factory.engine.simulation.figures import figures

    if run.log is not None and run.world == "mujoco" and run.log.is_file():
        return inline(report_on(run.log).text)
    return f"<pre>{escape(chr(10).join(figures(run)))}</pre>"


def _verdict(verdict: Verdict) -> str:
    """Each property, whether it holds, and why not."""
    from factory.apps.drawing.tables import titled

    rows = (
        (
            name.replace("_", " "),
            {True: "proved", False: "does not hold", None: "undecided"}[getattr(verdict, name)],
            "; ".join(str(one) for one in verdict.witness if one.property == name),
        )
        for name in verdict.properties
    )
    return titled(repr(verdict), ("property", "", "witness"), rows)


def _certificate(certificate: Certificate) -> str:
    """Its figures and, where it fails, its faults."""
    from factory.apps.drawing.tables import titled

    faults = (("fault", str(fault.diagnostic())) for fault in certificate.faults)
    return titled(repr(certificate), ("", ""), (*certificate.summary().items(), *faults))


DRAWINGS |= {
    "PAG": _tree,
    "GearNet": _net,
    "MarkedNet": _net,
    "Factory": _factory,
    "Layout": _floor,
    "Run": _run,
    "Verdict": _verdict,
    "Certificate": _certificate,
}
