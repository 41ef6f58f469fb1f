"""The assembly tree as a drawing: parts on the left in their colours, the product on the right."""

from __future__ import annotations

from collections.abc import Iterator

from factory.geometry.solids import colour
from factory.layout.layout import Point2
from factory.layout.svg import clean, number, rectangle, shortened, text
from factory.problem.pag import PAG, Assembly

ROW, COLUMN, BOX, EDGE = 34.0, 190.0, 120.0, 24.0
"""Height of a row, distance of columns, width of a box, margin."""

STYLE = """
text { font-family: 'DejaVu Sans', 'Helvetica Neue', Arial, sans-serif; fill: #1f2933; }
.paper { fill: #ffffff; } .edge { fill: none; stroke: #9aa5b1; stroke-width: 1.8; }
.part { fill: #f5f7fa; stroke: #9aa5b1; stroke-width: 1.2; }
.made { fill: #e3edf7; stroke: #4a7fb5; stroke-width: 1.4; }
.h { font-weight: bold; } .o { fill: #52606d; }
"""


def draw_tree(pag: PAG) -> str:
    """The tree as SVG, the same bytes for the same PAG."""
    return "".join(f"{element}\n" for element in _elements(pag))


def _places(pag: PAG) -> dict[str, Point2]:
    """The middle of each label's box: parts in a row each, the others between their inputs and
    to the right of all of them."""
    found: dict[str, Point2] = {}
    row = 0
    for node in pag.postorder():
        inputs = [found[label] for label in node.inputs]
        if inputs:
            x = max(x for x, _ in inputs) + COLUMN
            found[node.label] = x, (inputs[0][1] + inputs[-1][1]) / 2
        else:
            found[node.label] = EDGE + BOX / 2, EDGE + ROW * (row + 0.5)
            row += 1
    return found


def _elements(pag: PAG) -> Iterator[str]:
    at = _places(pag)
    width = max(x for x, _ in at.values()) + BOX / 2 + EDGE
    height = max(y for _, y in at.values()) + ROW / 2 + EDGE
    size = f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}"'
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    yield f"<title>{clean(pag.root)}: assembly tree</title>"
    yield f"<style>{STYLE}</style>"
    yield rectangle((0.0, width, 0.0, height), "paper")
    for node in pag.postorder():
        for label in node.inputs:
            yield _edge(at[label], at[node.label])
    part = 0
    for node in pag.postorder():
        yield from _box(at[node.label], node)
        if not node.inputs:
            yield _swatch(at[node.label], colour(node, part))
            part += 1
    yield "</svg>"


def _edge(start: Point2, end: Point2) -> str:
    """From the right of one box to the left of another, with one step."""
    x0, x1 = start[0] + BOX / 2, end[0] - BOX / 2
    bend = x1 - 22
    points = f"M{number(x0)} {number(start[1])}H{number(bend)}V{number(end[1])}H{number(x1)}"
    return f'<path class="edge" d="{points}"/>'


def _box(at: Point2, node: Assembly) -> Iterator[str]:
    """The label in a box; what is made has its operation below."""
    (x, y), made = at, bool(node.inputs)
    half = 15 if made else 11
    yield rectangle((x - BOX / 2, x + BOX / 2, y - half, y + half), "made" if made else "part", 4)
    shown = shortened(node.label)
    size = min(12.0, (BOX - 24) / (0.62 * len(shown)))
    middle = (x, y - 5) if made else (x + 6, y)
    drawn = text(middle, shown, size, "h" if made else "", "middle")
    yield drawn.replace("</text>", f"<title>{clean(node.label)}</title></text>")
    if made:
        yield text((x, y + 8), shortened(node.operation), 9.5, "o", "middle")


def _swatch(at: Point2, rgba: tuple[float, ...]) -> str:
    red, green, blue = (round(255 * min(max(float(c), 0.0), 1.0)) for c in rgba[:3])
    x, y = at[0] - BOX / 2 + 5, at[1] - 6
    place = f'x="{number(x)}" y="{number(y)}" width="12" height="12" rx="2"'
    return f'<rect {place} style="fill:#{red:02x}{green:02x}{blue:02x}"/>'
