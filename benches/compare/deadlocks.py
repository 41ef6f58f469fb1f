"""Deadlocks: what users of a fleet manager report, and what excludes the same here; with a count of
the nets that were proved while this report was made."""

from __future__ import annotations

from typing import Any

import factory
from benches.fidelity.products import BRICKS_NAMES, EXAMPLES, file_of, is_here
from benches.tables import table
from factory.floor.layout.exclusions import coordinated
from factory.pipeline import read


def measure(quick: bool = False) -> dict[str, Any]:
    """For each product: the size of the net that runs, and whether it is live."""
    names = sorted(file.stem for file in EXAMPLES.glob("*.pag"))
    names = names[:2] if quick else [*names, *filter(is_here, BRICKS_NAMES[:3])]
    rows = []
    for name in names:
        project = read(file_of(name))
        net, layout = coordinated(project.layout), project.layout
        assert layout.certificate is not None
        rows.append(
            {
                "product": name,
                "robots": len(layout.factory.robots),
                "places": len(net.net.tokens),
                "orders": sum(place.mode == "order" for place in net.net.net.places),
                "live": factory.verify(layout.factory).live and not net.deadlock,
                "clear": layout.certificate.holds,
            }
        )
        print(".", end="", flush=True)
    print()
    return {"rows": rows}


def section(results: dict[str, Any]) -> str:
    """The report."""
    head = ("product", "robots", "places", "order places", "live", "certified clear")
    rows = [tuple(row.values()) for row in results["rows"]]
    reports = table(("report", "what happens there", "why not here"), REPORTS)
    text = TEXT.format(reports=reports)
    return "\n\n".join(["## Deadlocks", text, table(head, rows), LIMITS])


TRACKER = "https://github.com/open-rmf"

REPORTS = (
    (
        f"[rmf_ros2#503]({TRACKER}/rmf_ros2/issues/503) (2026)",
        'two robots that patrol and swap places end in a deadlock "after several patrols", with the'
        " reservation system running",
        "Robots do not swap places. Each has a guidepath of its own; where two meet, an operation"
        " couples them, or an order place lets one go first. The order is part of the net, whose"
        " liveness does not depend on how long it has run: the number of tokens on a circuit never"
        " changes.",
    ),
    (
        f"[rmf_traffic#108]({TRACKER}/rmf_traffic/issues/108) (2024)",
        "two robots head for one place; the negotiation takes long, oscillates, and sometimes"
        ' fails: "both robots refuse to yield"',
        "Nothing is negotiated. Who goes first is fixed when the factory is compiled, in the order"
        " in which a single unit is made, so a sequence in which everything fires exists.",
    ),
    (
        f"[rmf#356]({TRACKER}/rmf/issues/356) (2023)",
        "two robots wait for each other at an intersection for about 2.5 minutes, at random",
        "A wait for each other is a circuit of the net without token. `check` looks for such"
        " circuits, in linear time; a layout that has one is refused, with the circuit.",
    ),
)
"""Reports of users of Open-RMF, read as issues."""


TEXT = """\
Why what users of [Open-RMF](https://www.open-rmf.org) report cannot happen here. That is no
judgement of Open-RMF: it decides at run time, for fleets of several makers and tasks that nobody
knows in advance. A factory here is compiled for one product (or a fixed mix), so all decisions can
be made, and proved, before it is built.

{reports}

Read as issues, not reproduced. The argument in four steps: (1) the compiled net and all waits of a
layout (hands, magazines, the tray) are one marked graph, the [coordinated
net](theory/coordinated.md); (2) a marked graph is live iff no circuit is free of tokens (Commoner
et al. 1971), which is decided in linear time for each factory; (3) machines that come near each
other are in a mode together, or excluded by a circuit with one token, which the layout's
certificate names; (4) each run is replayed on the net, and a monitor that knows only the engine's
state reconstructs the same firings. [Ablations](#ablations) shows what happens if step 2 or 3 is
left out.

`python -m benches.compare deadlocks`, per product the net that runs (`factory check FILE -v`):"""

LIMITS = """\
What the proof does not say: that a robot gets to its goal (decided for each mode, measured in each
run), or that nothing fails. A robot that dies stops, in time, all that waits for it; see
[Failures](guide/faults.md)."""
