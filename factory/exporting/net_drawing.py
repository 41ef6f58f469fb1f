"""A net as a drawing: a lane for each robot's gear, time from left to right.

Every robot, arc, transition and place is a group that says by number what it is (`data-place`), so
that a page can highlight it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from factory.exporting.swimlanes import LEFT, apart, swimlanes
from factory.nets.marked import MarkedNet
from factory.support.canvas import Canvas, Point

RADIUS, HEAD = 12.0, (8.0, 3.5)
"""Radius of a place; length and half width of an arrowhead."""

ARC = "arc", "tip"
"""The styles of an arc and its head."""

EDGE = 20.0
"""Distance between arcs where they cross the edges."""

ALONG = 60.0
"""Length above which a bar crosses several lanes."""


class NetDrawing:
    """Draws a net on its `canvas`. `styles`: style class for the elements of some gears; `every`:
    whether each place gets a token, for a page that shows and hides them."""

    def __init__(
        self, net: MarkedNet, styles: Callable[[Sequence[int]], str], every: bool = False
    ) -> None:
        self.net, self.styles, self.every = net, styles, every
        self.at, self.owners, self.canvas = swimlanes(net), net.owners, Canvas()
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
            style = f"arcs {self.styles(self.owners[place])}"
            with self.canvas.group(style, data_arc=place):
                edge = edges.get(place, y)
                for event in shape.left:
                    back = not self.at.forward(place, event)
                    end = (self.at.width - 14, edge) if back else (x - RADIUS, y)
                    self._arc(place, self.at.touch(event, y), end)
                if any(not self.at.forward(place, event) for event in shape.left):
                    self._arc(place, (LEFT - 24, edge), (x - RADIUS, y))
                if place in edges:
                    self.canvas.text((self.at.width - 26, edge - 7), shape.name, 9.5, "grey", "end")
                for event in shape.right:
                    self._arc(place, (x + RADIUS, y), self.at.touch(event, y), 3.0)

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
        points = [start, end] if self.owners[place] else self.at.way(start, end)
        if points[2:]:
            self.canvas.line("arc", *points[:-1])
        self.canvas.arrow(points[-2], end, ARC, HEAD, off)

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
                self.canvas.label((x, low - 7), transition.name, 9.5)

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
            with self.canvas.group(f"place {self.styles(self.owners[index])}", data_place=index):
                self.canvas.circle(at, RADIUS, "ring", title=place.name)
                if self.every:
                    self.canvas.circle(at, 6.0, "token", data_token=index)
                elif tokens == 1:
                    self.canvas.circle(at, 4.5, "token")
                elif tokens:
                    self.canvas.text(at, str(tokens), 12.0, "h", "middle")
                words = f"{place.mode} {place.label}".strip() or place.name
                self.canvas.label((at[0], at[1] + RADIUS + 10), words, 10.5)
