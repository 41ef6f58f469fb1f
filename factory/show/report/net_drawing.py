"""The net of a report: a lane for each robot's gear, with a token on every place, which the page
shows or hides with the time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from factory.export.swimlanes import LEFT, Swimlanes, owners_of, swimlanes
from factory.layout.layout import Point2
from factory.layout.svg import circle, label, line, rectangle, text
from factory.nets.marked import marked
from factory.plant.factory import Factory

RADIUS = 12.0
"""Of a place."""


def net_drawing(factory: Factory, roles: Sequence[str]) -> str:
    """The drawing as SVG, to be put into a page."""
    return _Drawing(factory, roles).text()


class _Drawing:
    """The elements, from the ground up."""

    def __init__(self, factory: Factory, roles: Sequence[str]) -> None:
        self.net = marked(factory.net)
        self.roles = roles
        self.at: Swimlanes = swimlanes(self.net)
        self.owners = owners_of(self.net)

    def text(self) -> str:
        """The document."""
        width, height = f"{self.at.width:.0f}", f"{self.at.height:.0f}"
        layers = (self._lanes(), self._arcs(), self._transitions(), self._places())
        drawn = "".join(f"<g>{''.join(layer)}</g>" for layer in layers)
        return (
            f'<svg class="net" viewBox="0 0 {width} {height}" data-width="{width}"'
            f' data-height="{height}" role="img" aria-label="The net">{drawn}</svg>'
        )

    def _role(self, owners: list[int]) -> str:
        """The style of what belongs to these robots."""
        return self.roles[owners[0]] if len(owners) == 1 else "shared"

    def _lanes(self) -> Iterator[str]:
        """A faint line for each robot, with its name at its left end."""
        for number, gear in enumerate(self.net.gears):
            y = self.at.lanes[number]
            yield f'<g data-robot="{number}" class="lane {self._role([number])}">'
            yield line("track", (LEFT - 30, y), (self.at.width - 14, y))
            yield text((14.0, y - 6), gear.robot, 15.0, "name")
            yield text((14.0, y + 9), gear.type, 10.0, "kind")
            yield "</g>"

    def _arcs(self) -> Iterator[str]:
        for place, shape in enumerate(self.net.net.places):
            x, y = self.at.places[place]
            yield f'<g data-arc="{place}" class="arcs {self._role(self.owners[place])}">'
            for event in shape.left:
                start = self.at.touch(event, y)
                if self.at.forward(place, event):
                    yield from _arrow(start, (x - RADIUS, y))
                else:
                    yield from _arrow(start, (self.at.width - 14, start[1]))
                    yield from _arrow((LEFT - 24, y), (x - RADIUS, y))
            for event in shape.right:
                yield from _arrow((x + RADIUS, y), self.at.touch(event, y), 3.0)
            yield "</g>"

    def _transitions(self) -> Iterator[str]:
        for event, transition in enumerate(self.net.net.transitions):
            x, (low, high) = self.at.x[event], self.at.spans[event]
            yield f'<g data-transition="{event}" class="transition">'
            yield rectangle((x - 9, x + 9, low, high), "reach")
            yield rectangle((x - 3, x + 3, low, high), "bar", 2)
            yield label((x, low - 7), transition.name, 9.5, "")
            yield "</g>"

    def _places(self) -> Iterator[str]:
        for index, place in enumerate(self.net.net.places):
            at, words = self.at.places[index], f"{place.mode} {place.label}".strip() or place.name
            yield f'<g data-place="{index}" class="place {self._role(self.owners[index])}">'
            yield circle(at, RADIUS, "ring", "", place.name)
            yield circle(at, 6.0, "token", f' data-token="{index}"')
            yield label((at[0], at[1] + RADIUS + 10), words, 10.5, "")
            yield "</g>"


def _arrow(start: Point2, end: Point2, short: float = 0.0) -> Iterator[str]:
    """A line with a head; the head ends `short` of the end."""
    (x0, y0), (x1, y1) = start, end
    length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1e-9)
    u, v = (x1 - x0) / length, (y1 - y0) / length
    tip = x1 - short * u, y1 - short * v
    foot = tip[0] - 8 * u, tip[1] - 8 * v
    yield line("arc", start, foot)
    yield line(
        "tip", tip, (foot[0] - 3.5 * v, foot[1] + 3.5 * u), (foot[0] + 3.5 * v, foot[1] - 3.5 * u)
    )
