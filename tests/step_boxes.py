"""A STEP file (ISO 10303-21, AP214) of named boxes, written entity by entity, in millimetres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from types import MappingProxyType
from typing import Any

Vector = tuple[float, float, float]
Box = tuple[Vector, Vector]

FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""The corners of each face of a box, as (0, 0, 0), (0, 0, 1), ..., (1, 1, 1), seen from outside."""


class _Writer:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.styled: list[str] = []

    def add(self, text: str) -> str:
        self.lines.append(f"#{len(self.lines) + 1}={text};")
        return f"#{len(self.lines)}"

    def point(self, at: Vector) -> str:
        return self.add(f"CARTESIAN_POINT('',({','.join(f'{x:.6f}' for x in at)}))")

    def direction(self, along: Vector) -> str:
        return self.add(f"DIRECTION('',({','.join(f'{x:.6f}' for x in along)}))")

    def axes(self, at: Vector, z: Vector, x: Vector) -> str:
        ends = ",".join((self.point(at), self.direction(z), self.direction(x)))
        return self.add(f"AXIS2_PLACEMENT_3D('',{ends})")

    def frame(self, at: Vector = (0, 0, 0)) -> str:
        return self.axes(at, (0, 0, 1), (1, 0, 0))

    def paint(self, item: str, colour: Vector) -> None:
        light = self.add(f"COLOUR_RGB('',{','.join(f'{x:.3f}' for x in colour)})")
        fill = self.add(f"FILL_AREA_STYLE_COLOUR('',{light})")
        filled = self.add(f"FILL_AREA_STYLE('',({fill}))")
        area = self.add(f"SURFACE_STYLE_FILL_AREA({filled})")
        side = self.add(f"SURFACE_SIDE_STYLE('',({area}))")
        usage = self.add(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
        style = self.add(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")
        self.styled.append(self.add(f"STYLED_ITEM('',({style}),{item})"))


def step_of(
    boxes: Mapping[str, Box | Sequence[Box]],
    colours: Mapping[str, Mapping[int, Vector]] = MappingProxyType({}),
) -> str:
    """The text of a file of boxes by name, each from its low to its high corner [mm]; of several
    boxes one component is made. `colours`: those of some faces of a component's first box, by
    number, -1 for that of the box, -2 for that of the second."""
    w = _Writer()
    app = w.add("APPLICATION_CONTEXT('automotive design')")
    w.add(f"APPLICATION_PROTOCOL_DEFINITION('','automotive_design',2000,{app})")
    length = w.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = w.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid = w.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    fine = w.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),{length},'','')")
    context = w.add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({fine}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
    )
    for name, given in boxes.items():
        several: Sequence[Any] = [given] if isinstance(given[0][0], float | int) else given
        bodies, frame = [], w.frame()
        for low, high in several:
            body, faces = _brep(w, name, low, high)
            bodies.append(body)
            for number, colour in colours.get(name, {}).items():
                if -number == len(bodies) or (number >= 0 and len(bodies) == 1):
                    w.paint(body if number < 0 else faces[number], colour)
        items = ",".join([frame, *bodies])
        shape = w.add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('',({items}),{context})")
        _product(w, app, name, shape)
    if w.styled:
        styled = ",".join(w.styled)
        w.add(f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({styled}),{context})")
    head = (
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n"
        "FILE_NAME('boxes','2026-01-01T00:00:00',(''),(''),'','','');\n"
        "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n"
    )
    return head + "\n".join(w.lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"


def _product(w: _Writer, app: str, name: str, shape: str) -> None:
    """A product with a shape."""
    where = w.add(f"PRODUCT_CONTEXT('',{app},'mechanical')")
    made = w.add(f"PRODUCT('{name}','{name}','',({where}))")
    form = w.add(f"PRODUCT_DEFINITION_FORMATION('','',{made})")
    view = w.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{app},'design')")
    definition = w.add(f"PRODUCT_DEFINITION('design','',{form},{view})")
    given = w.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
    w.add(f"SHAPE_DEFINITION_REPRESENTATION({given},{shape})")


def _brep(w: _Writer, name: str, low: Vector, high: Vector) -> tuple[str, list[str]]:
    """A box, and its faces."""
    corners: list[Any] = list(product(*zip(low, high, strict=True)))
    vertices = [w.add(f"VERTEX_POINT('',{w.point(corner)})") for corner in corners]
    edges: dict[tuple[int, int], str] = {}
    faces = []
    for face in FACES:
        oriented = []
        for start, end in zip(face, (*face[1:], face[0]), strict=True):
            key = (min(start, end), max(start, end))
            if key not in edges:
                edges[key] = _edge(w, corners, vertices, key)
            forward = ".T." if (start, end) == key else ".F."
            oriented.append(w.add(f"ORIENTED_EDGE('',*,*,{edges[key]},{forward})"))
        loop = w.add(f"EDGE_LOOP('',({','.join(oriented)}))")
        bound = w.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
        a, b, c = (corners[index] for index in face[:3])
        along = _unit(_minus(b, a))
        normal = _unit(_cross(_minus(b, a), _minus(c, b)))
        plane = w.add(f"PLANE('',{w.axes(a, normal, along)})")
        faces.append(w.add(f"ADVANCED_FACE('',({bound}),{plane},.T.)"))
    shell = w.add(f"CLOSED_SHELL('',({','.join(faces)}))")
    return w.add(f"MANIFOLD_SOLID_BREP('{name}',{shell})"), faces


def _edge(w: _Writer, corners: list[Vector], vertices: list[str], key: tuple[int, int]) -> str:
    start, end = key
    along = _minus(corners[end], corners[start])
    vector = w.add(f"VECTOR('',{w.direction(_unit(along))},1.)")
    line = w.add(f"LINE('',{w.point(corners[start])},{vector})")
    return w.add(f"EDGE_CURVE('',{vertices[start]},{vertices[end]},{line},.T.)")


def _minus(a: Vector, b: Vector) -> Vector:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _unit(a: Vector) -> Vector:
    length = sum(x * x for x in a) ** 0.5
    return (a[0] / length, a[1] / length, a[2] / length)
