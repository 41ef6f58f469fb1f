"""The assembly tree as a drawing: parts on the left in their colours, the product on the right."""

from __future__ import annotations

from factory.exporting.subject import Subject
from factory.geometry.solids import colour
from factory.pipeline import Project
from factory.problem.pag import PAG, Assembly
from factory.support.canvas import Canvas, Point, hexadecimal, shortened
from factory.support.errors import Diagnostic, InputError

ROW, COLUMN, BOX, EDGE = 34.0, 190.0, 120.0, 24.0
"""Height of a row, distance of columns, width of a box, margin."""

BEND = 22.0
"""Distance from a box at which the lines of its inputs join."""

STYLE = """
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
            left, paint = x - BOX / 2 + 5, hexadecimal(colour(node, parts))
            canvas.rectangle((left, left + 12, y - 6, y + 6), "", 2.0, fill=paint)
            parts += 1
    width = max(x for x, _ in at.values()) + BOX / 2 + EDGE
    height = max(y for _, y in at.values()) + ROW / 2 + EDGE
    return canvas.document(f"{pag.root}: assembly tree", (0.0, width, 0.0, height), STYLE)


def _places(pag: PAG) -> dict[str, Point]:
    """Middle of each label's box: a row for each part; an assembly lies between its inputs, to the
    right of them. In a mix, one that would lie on another lies further to the right."""
    found: dict[str, Point] = {}
    row = 0
    for node in pag.postorder():
        inputs = [found[label] for label in node.inputs]
        if inputs:
            x = max(x for x, _ in inputs) + COLUMN
            y = (inputs[0][1] + inputs[-1][1]) / 2
            while pag.mix and any(x == u and abs(y - v) < ROW for u, v in found.values()):
                x += COLUMN
            found[node.label] = x, y
        else:
            found[node.label] = EDGE + BOX / 2, EDGE + ROW * (row + 0.5)
            row += 1
    return found


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
