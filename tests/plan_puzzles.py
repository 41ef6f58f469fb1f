"""Puzzles with known answers, for the tests of the planner: parts made of convex bodies, written as
meshes and read as any product's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

from factory.apps.planning.parts import InPlace
from factory.apps.planning.source import SourceOptions, read_source
from factory.theory.lang.template_reader import all_templates

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
Body = Box | Sequence[tuple[float, float, float]]
Parts = Mapping[str, Sequence[Body]]

MM = 1e-3


def source(folder: Path, parts: Parts) -> InPlace:
    """The parts [mm], each of some boxes (low, high) or hulls of points, as a source of a plan."""
    lines = [f"root = all; all = mate ( {', '.join(parts)} );"]
    for label, bodies in parts.items():
        (folder / f"{label}.obj").write_text(_obj(bodies))
        lines.append(f'{label} = atomic ( mesh = "{label}.obj", scale = {MM} );')
    file = folder / "puzzle.pag"
    file.write_text("\n".join(lines))
    return read_source(file, all_templates(), SourceOptions(replan=True))


def _obj(bodies: Sequence[Body]) -> str:
    lines, before = [], 1
    for body in bodies:
        points = np.array(_corners(*body) if len(body) == 2 else body, float)
        hull = ConvexHull(points)
        centre = points.mean(axis=0)
        lines += [f"v {x} {y} {z}" for x, y, z in points.tolist()]
        for a, b, c in hull.simplices.tolist():
            normal = np.cross(points[b] - points[a], points[c] - points[a])
            if normal @ (points[a] - centre) < 0:
                b, c = c, b
            lines.append(f"f {a + before} {b + before} {c + before}")
        before += len(points)
    return "\n".join(lines)


def _corners(low: Sequence[float], high: Sequence[float]) -> list[tuple[float, ...]]:
    ends = list(zip(low, high, strict=True))
    return [(x, y, z) for x in ends[0] for y in ends[1] for z in ends[2]]


def tub(width: float, depth: float, floor: float, height: float, wall: float = 4) -> list[Box]:
    """A box that is open above, its inside so wide and deep, from `floor` up."""
    w, d, top = width / 2, depth / 2, floor + height
    x, y, low = w + wall, d + wall, floor - wall
    return [
        ((-x, -y, low), (x, y, floor)),
        ((-x, -y, floor), (-w, y, top)),
        ((w, -y, floor), (x, y, top)),
        ((-w, -y, floor), (w, -d, top)),
        ((-w, d, floor), (w, y, top)),
    ]


def block(width: float, depth: float, low: float, high: float, x: float = 0, y: float = 0) -> Box:
    """A box about a vertical."""
    return (x - width / 2, y - depth / 2, low), (x + width / 2, y + depth / 2, high)


def prism(profile: Sequence[tuple[float, float]], low: float, high: float) -> Body:
    """A convex profile in y and z, drawn along x."""
    return [(x, y, z) for x in (low, high) for y, z in profile]


def dovetail(gap: float = 0.2, stops: Sequence[float] = ()) -> Parts:
    """A tail in its socket, along x, with a gap around it, less than 0 where they are drawn into
    each other; with walls at the ends `stops` of the socket."""
    left = [(-20, 0), (-10 - gap, 0), (-5 - gap, 10), (-20, 10)]
    right = [(-y, z) for y, z in left]
    socket: list[Body] = [prism(left, -30, 30), prism(right, -30, 30)]
    socket.append(((-30, -20, -6), (30, 20, 0)))
    socket += [((min(x, x * 1.2), -20, 0), (max(x, x * 1.2), 20, 10)) for x in stops]
    low = max(gap, 0.0)
    tail = prism([(-10, low), (10, low), (5, 10), (-5, 10)], -29.8, 29.8)
    return {"socket": socket, "tail": [tail]}


def ring(x: float, flat: int, missing: int = 0) -> list[Box]:
    """A square ring of 30 mm on the x axis, its hole along an axis, y or z; `missing`: +1 or -1 for
    a ring without that side in x."""
    bars = {
        -1: ((-15, -15), (-11, 15)),
        +1: ((11, -15), (15, 15)),
        2: ((-11, -15), (11, -11)),
        3: ((-11, 11), (11, 15)),
    }
    found: list[Box] = []
    for side, (low, high) in bars.items():
        if side != missing:
            one, other = list(map(float, low)), list(map(float, high))
            one.insert(flat, -2.0)
            other.insert(flat, 2.0)
            found.append(((one[0] + x, one[1], one[2]), (other[0] + x, other[1], other[2])))
    return found


def pinwheel(closed: bool = True) -> Parts:
    """Three parts of which any two come apart, each pair along an axis of its own: each has a pin
    in a ring of the next. Without the pin of the last they can be joined."""
    bodies: list[Box] = [
        ((-10, -10, 56), (10, -5.2, 64)),
        ((-10, 5.2, 56), (10, 10, 64)),
        ((-10, -5.2, 56), (-5.2, 5.2, 64)),
        ((5.2, -5.2, 56), (10, 5.2, 64)),
        ((10, -4, 56), (94, 4, 64)),
        ((86, -4, -4), (94, 4, 56)),
    ]
    pin: Box = ((50, -5, -5), (86, 5, 5))
    parts = {}
    for label in "abc":
        parts[label] = [*bodies, pin] if closed or label != "c" else list(bodies)
        bodies = [_cycled(body) for body in bodies]
        pin = _cycled(pin)
    return parts


def _cycled(box: Box) -> Box:
    """A box with x, y and z in place of y, z and x."""
    (a, b, c), (d, e, f) = box
    return (c, a, b), (f, d, e)
