"""SVG: the net with a lane for each robot (`--of net`), or the assembly tree (`--of tree`).

Nothing outside the file is referred to, and the same input gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterator

from factory.export.palette import colour
from factory.export.subject import Subject
from factory.export.swimlanes import LEFT, Swimlanes, owners_of, swimlanes
from factory.export.views import pag_of, view_of
from factory.layout.layout import Point2
from factory.layout.svg import circle, clean, label, line, rectangle, text
from factory.nets.marked import MarkedNet, marked

FORMAT, TAKES, OF = "svg", "net", "net or tree"

RADIUS = 12.0
"""Of a place."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .arc { fill: none; stroke-width: 1.6; }
.thread { fill: none; stroke-width: 1.2; stroke-dasharray: 2 4; }
.bar { fill: #323f4b; } .pass { stroke: #ffffff; stroke-width: 1.5; }
.place { stroke-width: 1.8; fill: #ffffff; } .shared { stroke-width: 2.6; fill: #fdecd2; }
.token { fill: #1f2933; } .tip { stroke: none; } .h { font-weight: bold; }
.m { fill: #3e4c59; } .t { fill: #7b8794; } .g { fill: #52606d; }
"""


def export(subject: Subject) -> str:
    """The net or the assembly tree as a drawing."""
    if view_of(subject) == "tree":
        from factory.export.tree_drawing import draw_tree

        return draw_tree(pag_of(subject))
    return draw_net(marked(subject.net), subject.stem)


def draw_net(net: MarkedNet, title: str) -> str:
    """The net as a drawing."""
    return "".join(f"{element}\n" for element in _Drawing(net, title).elements())


class _Drawing:
    """The elements, from the ground up."""

    def __init__(self, net: MarkedNet, title: str) -> None:
        self.net, self.title = net, title
        self.at: Swimlanes = swimlanes(net)
        self.owners = owners_of(net)

    def elements(self) -> Iterator[str]:
        """The document."""
        width, height = self.at.width, self.at.height
        size = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
        yield '<?xml version="1.0" encoding="UTF-8"?>'
        yield f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
        yield f"<title>{clean(self.title)}: net</title>"
        yield f"<style>{STYLE}</style>"
        yield rectangle((0.0, width, 0.0, height), "paper")
        yield text((14.0, 20.0), self._heading(), 12.0, "g")
        for name, drawn in (
            ("arcs", self._arcs()),
            ("threads", self._threads()),
            ("transitions", self._transitions()),
            ("places", self._places()),
            ("robots", self._robots()),
        ):
            yield f'<g id="{name}">'
            yield from drawn
            yield "</g>"
        yield "</svg>"

    def _heading(self) -> str:
        net, robots = self.net.net, len(self.net.gears)
        counts = f"{robots} robots, {len(net.places)} places, {len(net.transitions)} transitions"
        ends = "; the left and the right edge are one" if robots else ""
        return f"{self.title}: {counts}{ends}"

    def _arcs(self) -> Iterator[str]:
        for place, shape in enumerate(self.net.net.places):
            paint = colour(self.owners[place])
            x, y = self.at.places[place]
            for event in shape.left:
                start = self.at.touch(event, y)
                if self.at.forward(place, event):
                    yield from _arrow(start, (x - RADIUS, y), paint)
                else:
                    yield from _arrow(start, (self.at.width - 14, start[1]), paint)
                    yield from _arrow((LEFT - 24, y), (x - RADIUS, y), paint)
            for event in shape.right:
                yield from _arrow((x + RADIUS, y), self.at.touch(event, y), paint, 3.0)

    def _threads(self) -> Iterator[str]:
        """The ways of the other robots of an operation through it, in their own lanes."""
        for place, shape in enumerate(self.net.net.places):
            y = self.at.places[place][1]
            for gear in self.owners[place]:
                lane = self.at.lanes[gear]
                if lane != y and shape.left and shape.right:
                    ends = (self.at.x[shape.left[0]], lane), (self.at.x[shape.right[0]], lane)
                    yield _painted(line("thread", *ends), colour([gear]))

    def _transitions(self) -> Iterator[str]:
        for event, transition in enumerate(self.net.net.transitions):
            x, (low, high) = self.at.x[event], self.at.spans[event]
            yield rectangle((x - 3, x + 3, low, high), "bar", 2)
            yield label((x, low - 7), transition.name, 9.5, "t")
        for number, gear in enumerate(self.net.gears):
            for event in gear.transitions:
                if event >= 0 and self._wide(event):
                    middle = self.at.x[event], self.at.lanes[number]
                    paint = f' style="fill:{colour([number])}"'
                    yield circle(middle, 4.5, "pass", paint)

    def _wide(self, event: int) -> bool:
        """Whether a bar crosses several lanes."""
        low, high = self.at.spans[event]
        return high - low > 60

    def _places(self) -> Iterator[str]:
        for index, place in enumerate(self.net.net.places):
            at, owners = self.at.places[index], self.owners[index]
            style = "shared" if len(owners) > 1 else "place"
            paint = f' style="stroke:{colour(owners)}"'
            yield circle(at, RADIUS, style, paint, place.name)
            yield from self._tokens(index, at)
            words = f"{place.mode} {place.label}".strip() or place.name
            yield label((at[0], at[1] + RADIUS + 10), words, 10.5, "m")

    def _tokens(self, place: int, at: Point2) -> Iterator[str]:
        count = self.net.tokens[place]
        if count == 1:
            yield circle(at, 4.5, "token")
        elif count:
            yield text(at, str(count), 12.0, "h", "middle")

    def _robots(self) -> Iterator[str]:
        for number, gear in enumerate(self.net.gears):
            y = self.at.lanes[number]
            yield _painted(text((14.0, y - 7), gear.robot, 15.0, "h"), colour([number]), "fill")
            yield text((14.0, y + 9), gear.type, 10.0, "g")


def _arrow(start: Point2, end: Point2, paint: str, short: float = 0.0) -> Iterator[str]:
    """A line with a head; the head ends `short` of the end."""
    (x0, y0), (x1, y1) = start, end
    length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1e-9)
    u, v = (x1 - x0) / length, (y1 - y0) / length
    tip = x1 - short * u, y1 - short * v
    foot = tip[0] - 8 * u, tip[1] - 8 * v
    yield _painted(line("arc", start, foot), paint)
    corners = tip, (foot[0] - 3.5 * v, foot[1] + 3.5 * u), (foot[0] + 3.5 * v, foot[1] - 3.5 * u)
    yield _painted(line("tip", *corners), paint, "fill")


def _painted(element: str, paint: str, what: str = "stroke") -> str:
    """An element in a colour."""
    head, space, tail = element.partition(" ")
    return f'{head}{space}style="{what}:{paint}" {tail}'
