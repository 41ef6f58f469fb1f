"""SVG: the net with a lane for each robot (`--of net`), or the assembly tree (`--of tree`).

Nothing outside the file is referred to, and the same input gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from factory.api import PAG, Assembly, Diagnostic, InputError, MarkedNet, Project, Solid
from factory.apps.drawing.canvas import LETTER, Canvas, Point, hexadecimal, shortened
from factory.apps.exports.subject import Subject
from factory.apps.exports.swimlanes import COLOURS, LEFT, SHARED, apart, swimlanes

RADIUS, HEAD = 12.0, (8.0, 3.5)
"""Radius of a place; length and half width of an arrowhead."""

ARC = "arc", "tip"
"""The styles of an arc and its head."""

EDGE, EDGE_NAME = 20.0, 60.0
"""Distance between arcs where they cross the edges, and room for the names of their places."""

ALONG = 60.0
"""Length above which a bar crosses several lanes."""


class NetDrawing:
    """Draws a net on its `canvas`. `styles`: style class for the elements of some gears; `every`:
    whether each place gets a token, for a page that shows and hides them. `choices`: the places
    that lead to several transitions."""

    def __init__(
        self, net: MarkedNet, styles: Callable[[Sequence[int]], str], every: bool = False
    ) -> None:
        self.net, self.styles, self.every = net, styles, every
        self.at, self.owners, self.canvas = swimlanes(net), net.owners, Canvas()
        self.choices = [n for n, p in enumerate(net.net.places) if len(p.right) > 1]
        self.page = (0.0, self.at.width, 0.0, self.at.height)
        for layer in (self._arcs, self._lanes, self._transitions, self._crossings, self._places):
            with self.canvas.group():
                layer()

    def _arcs(self) -> None:
        """Draw the arcs; those that close a circuit leave at the right edge and enter at the
        left."""
        edges = self._edges()
        for place, shape in enumerate(self.net.net.places):
            x, y = self.at.places[place]
            with self.canvas.group(f"arcs {self._style(place)}", data_arc=place):
                edge = edges.get(place, y)
                right = self.at.width - (EDGE_NAME if place in edges else 14)
                for event in shape.left:
                    back = not self.at.forward(place, event)
                    end = (right, edge) if back else (x - RADIUS, y)
                    self._arc(place, self.at.touch(event, y), end)
                if any(not self.at.forward(place, event) for event in shape.left):
                    self._arc(place, (LEFT - 24, edge), (x - RADIUS, y))
                if place in edges:
                    self.canvas.text((right + 6, edge), shape.name, 10.5, "edge")
                for event in shape.right:
                    self._arc(place, (x + RADIUS, y), self.at.touch(event, y), 3.0)

    def _style(self, place: int) -> str:
        """The style of a place and its arcs: that of its gears, and where there is a choice among
        what it leads to a colour of its own."""
        style = self.styles(self.owners[place])
        if place not in self.choices:
            return style
        return f"{style} choice{self.choices.index(place) % len(COLOURS)}"

    def _edges(self) -> dict[int, float]:
        """The y at which arcs to places without a robot cross the edges, all different."""
        back = [
            (place, self.at.places[place][1])
            for place, shape in enumerate(self.net.net.places)
            if not self.owners[place] and any(not self.at.forward(place, e) for e in shape.left)
        ]
        return apart(dict(back), EDGE)

    def _arc(self, place: int, start: Point, end: Point, off: float = 0.0) -> None:
        """Draw an arc of a place, straight along the lane of its robot, or around other nodes."""
        if self.owners[place]:
            self.canvas.arrow(start, end, ARC, HEAD, off)
        else:
            self.canvas.curved_arrow(self.at.corners(start, end), ARC, HEAD, off)

    def _lanes(self) -> None:
        """Draw the names of robots, and the lanes of those that an operation has besides its
        carrier."""
        for number, gear in enumerate(self.net.gears):
            y = self.at.lanes[number]
            with self.canvas.group(f"lane {self.styles([number])}", data_robot=number):
                for place in gear.places:
                    shape = self.net.net.places[place]
                    if self.at.places[place][1] != y and shape.left and shape.right:
                        ends = shape.left[0], shape.right[0]
                        self.canvas.line("thread", *((self.at.x[event], y) for event in ends))
                self.canvas.text((14.0, y - 7), gear.robot, 15.0, "h name")
                self.canvas.text((14.0, y + 9), gear.type, 10.0, "kind")

    def _transitions(self) -> None:
        for event, transition in enumerate(self.net.net.transitions):
            x, (low, high) = self.at.x[event], self.at.spans[event]
            with self.canvas.group("transition", data_transition=event):
                self.canvas.rectangle((x - 3, x + 3, low, high), "bar", 2.0)
                about = (x, low - 7), (x, high + 8), (x, low - 17), (x, high + 18)
                self.canvas.place_at(about, transition.name, 9.5)

    def _crossings(self) -> None:
        """Draw a dot where a robot passes a long bar."""
        for number, gear in enumerate(self.net.gears):
            with self.canvas.group(f"lane {self.styles([number])}", data_robot=number):
                for event in (e for e in gear.transitions if e >= 0):
                    low, high = self.at.spans[event]
                    if high - low > ALONG:
                        middle = self.at.x[event], self.at.lanes[number]
                        self.canvas.circle(middle, 4.5, "pass")

    def _places(self) -> None:
        for index, place in enumerate(self.net.net.places):
            at, tokens = self.at.places[index], self.net.tokens[index]
            with self.canvas.group(f"place {self._style(index)}", data_place=index):
                self.canvas.circle(at, RADIUS, "ring", title=place.name)
                if self.every:
                    self.canvas.circle(at, 6.0, "token", data_token=index)
                elif tokens == 1:
                    self.canvas.circle(at, 4.5, "token")
                elif tokens:
                    self.canvas.text(at, str(tokens), 12.0, "h", "middle")
                words = f"{place.mode} {place.label}".strip() or place.name
                about = [
                    (at[0], at[1] + side * (RADIUS + off)) for off in (10, 20) for side in (1, -1)
                ]
                self.canvas.place_at(about, words, 10.5)


FORMAT, TAKES, OF = "svg", "net", "net or tree"

NET_STYLE = """
.arc, .thread { fill: none; stroke: currentColor; stroke-width: 1.6; }
.thread { stroke-width: 1.2; stroke-dasharray: 2 4; }
.bar { fill: #323f4b; } .tip, .pass, .name { fill: currentColor; }
.pass { stroke: #ffffff; stroke-width: 1.5; }
.ring { stroke: currentColor; stroke-width: 1.8; fill: #ffffff; }
.shared .ring { stroke-width: 2.6; fill: #fdecd2; } .token { fill: #1f2933; }
.place text { fill: #3e4c59; } .transition text { fill: #7b8794; } .kind { fill: #52606d; }
.edge { fill: currentColor; }
""" + "".join(f".gear{n} {{ color: {paint}; }}\n" for n, paint in enumerate(COLOURS))

CHOICES = "".join(f".choice{n} {{ color: {paint}; }}\n" for n, paint in enumerate(COLOURS))


def export(subject: Subject) -> str:
    """The net or the assembly tree as a drawing."""
    if view_of(subject) == "tree":
        return draw_tree(pag_of(subject))
    return draw_net(MarkedNet.of(subject.net), subject.stem)


def draw_net(net: MarkedNet, title: str) -> str:
    """The net as a drawing."""
    drawing, robots = NetDrawing(net, _style), len(net.gears)
    places, transitions = len(net.net.places), len(net.net.transitions)
    counts = f"{places} places, {transitions} transitions"
    counts = f"{robots} robots, {counts}" if robots else counts
    ends = "; the left and the right edge are one" if transitions else ""
    heading = f"{title}: {counts}{ends}"
    drawing.canvas.text((14.0, 20.0), heading, 12.0, "grey")
    left, right, top, bottom = drawing.page
    page = left, max(right, 28 + 12 * LETTER * len(heading)), top, bottom
    style = f"{NET_STYLE}.shared {{ color: {SHARED}; }}\n{CHOICES if drawing.choices else ''}"
    return drawing.canvas.document(f"{title}: net", page, style)


def _style(owners: Sequence[int]) -> str:
    return f"gear{owners[0] % len(COLOURS)}" if len(owners) == 1 else "shared"


ROW, COLUMN, BOX, MARGIN = 34.0, 190.0, 120.0, 24.0
"""Height of a row, distance of columns, width of a box, margin."""

BEND = 22.0
"""Distance from a box at which the lines of its inputs join."""

TREE_STYLE = """
.edge { fill: none; stroke: #9aa5b1; stroke-width: 1.8; }
.part { fill: #f5f7fa; stroke: #9aa5b1; stroke-width: 1.2; }
.made { fill: #e3edf7; stroke: #4a7fb5; stroke-width: 1.4; }
"""


def view_of(subject: Subject) -> str:
    """The requested view: net or tree. Raises InputError (Usage) for anything else."""
    return subject.choose(["net", "tree"], "views")


def pag_of(subject: Subject) -> PAG:
    """The assembly tree. Raises InputError (Usage) where there is none, in a net from elsewhere."""
    if not isinstance(subject.source, Project):
        message = f"'{subject.file}' is a net in PNML, in which there is no assembly tree"
        raise InputError(Diagnostic("Usage", message, None, "give a PAG, or --of net"))
    return subject.source.pag


def draw_tree(pag: PAG) -> str:
    """The tree as SVG, the same bytes for the same PAG."""
    at, canvas, parts = _places(pag), Canvas(), 0
    for node in pag.postorder():
        for label in node.inputs:
            (x0, y0), (x1, y1) = at[label], at[node.label]
            left, right = x0 + BOX / 2, x1 - BOX / 2
            bend = right - BEND
            canvas.line("edge", (left, y0), (bend, y0), (bend, y1), (right, y1))
    for node in pag.postorder():
        x, y = at[node.label]
        _box(canvas, (x, y), node)
        if not node.inputs:
            left, paint = x - BOX / 2 + 5, hexadecimal(Solid.colour_of(node, parts))
            canvas.rectangle((left, left + 12, y - 6, y + 6), "", 2.0, fill=paint)
            parts += 1
    width = max(x for x, _ in at.values()) + BOX / 2 + MARGIN
    height = max(y for _, y in at.values()) + ROW / 2 + MARGIN
    return canvas.document(f"{pag.root}: assembly tree", (0.0, width, 0.0, height), TREE_STYLE)


def _places(pag: PAG) -> dict[str, Point]:
    """Middle of each label's box: a row for each part; an assembly lies between its inputs, to the
    right of them. In a mix, one that would lie on another lies further to the right."""
    middles: dict[str, Point] = {}
    row = 0
    for node in pag.postorder():
        inputs = [middles[label] for label in node.inputs]
        if inputs:
            x = max(x for x, _ in inputs) + COLUMN
            y = (inputs[0][1] + inputs[-1][1]) / 2
            while pag.mix and any(x == u and abs(y - v) < ROW for u, v in middles.values()):
                x += COLUMN
            middles[node.label] = x, y
        else:
            middles[node.label] = MARGIN + BOX / 2, MARGIN + ROW * (row + 0.5)
            row += 1
    return middles


def _box(canvas: Canvas, at: Point, node: Assembly) -> None:
    """Draw the label in a box, that of an assembly with its operation below."""
    (x, y), made = at, bool(node.inputs)
    half = 15 if made else 11
    box = x - BOX / 2, x + BOX / 2, y - half, y + half
    canvas.rectangle(box, "made" if made else "part", 4.0)
    size = min(12.0, (BOX - 24) / (0.62 * len(shortened(node.label))))
    canvas.label((x, y - 5) if made else (x + 6, y), node.label, size, "h" if made else "")
    if made:
        canvas.text((x, y + 8), shortened(node.operation), 9.5, "grey", "middle")
