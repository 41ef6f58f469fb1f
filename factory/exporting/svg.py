"""SVG: the net with a lane for each robot (`--of net`), or the assembly tree (`--of tree`).

Nothing outside the file is referred to, and the same input gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence

from factory.exporting.net_drawing import NetDrawing
from factory.exporting.subject import Subject
from factory.exporting.swimlanes import COLOURS, SHARED
from factory.exporting.tree_drawing import draw_tree, pag_of, view_of
from factory.nets.marked import MarkedNet, marked

FORMAT, TAKES, OF = "svg", "net", "net or tree"

STYLE = """
.arc, .thread { fill: none; stroke: currentColor; stroke-width: 1.6; }
.thread { stroke-width: 1.2; stroke-dasharray: 2 4; }
.bar { fill: #323f4b; } .tip, .pass, .name { fill: currentColor; }
.pass { stroke: #ffffff; stroke-width: 1.5; }
.ring { stroke: currentColor; stroke-width: 1.8; fill: #ffffff; }
.shared .ring { stroke-width: 2.6; fill: #fdecd2; } .token { fill: #1f2933; }
.place text { fill: #3e4c59; } .transition text { fill: #7b8794; } .kind { fill: #52606d; }
""" + "".join(f".gear{n} {{ color: {paint}; }}\n" for n, paint in enumerate(COLOURS))


def export(subject: Subject) -> str:
    """The net or the assembly tree as a drawing."""
    if view_of(subject) == "tree":
        return draw_tree(pag_of(subject))
    return draw_net(marked(subject.net), subject.stem)


def draw_net(net: MarkedNet, title: str) -> str:
    """The net as a drawing."""
    drawing, robots = NetDrawing(net, _style), len(net.gears)
    places, transitions = len(net.net.places), len(net.net.transitions)
    counts = f"{robots} robots, {places} places, {transitions} transitions"
    ends = "; the left and the right edge are one" if transitions else ""
    drawing.canvas.text((14.0, 20.0), f"{title}: {counts}{ends}", 12.0, "grey")
    style = f"{STYLE}.shared {{ color: {SHARED}; }}\n"
    return drawing.canvas.document(f"{title}: net", drawing.page, style)


def _style(owners: Sequence[int]) -> str:
    return f"gear{owners[0] % len(COLOURS)}" if len(owners) == 1 else "shared"
