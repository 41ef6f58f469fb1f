"""Makes the meshes of the products `chest`, `gearbox` and `peg`: run it to write them again.

    python examples/make_meshes.py [FOLDER]

Each part is a list of convex bodies that touch and do not overlap, and its file keeps their corners
apart: so the factory knows exactly what collides, and a hole is a hole. Lengths are millimetres in
the frame of the part; the PAG scales and places them. Needs nothing but Python.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import cos, pi, radians, sin, tan
from pathlib import Path

Point = tuple[float, float]
Polygon = list[Point]
Corner = tuple[float, float, float]
Body = tuple[list[Corner], list[Corner]]
"""A lower and an upper polygon with as many corners; counterclockwise seen from above."""
Part = list[Body]

SLACK = 0.15
"""Clearance between parts that slide in each other."""


# --- polygons -------------------------------------------------------------------------------------


def rectangle(u0: float, u1: float, v0: float, v1: float) -> Polygon:
    return [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]


def circle(radius: float, sides: int = 24, at: Point = (0.0, 0.0)) -> Polygon:
    """A polygon in a circle."""
    turns = [2 * pi * (k + 0.5) / sides for k in range(sides)]
    return [(at[0] + radius * cos(t), at[1] + radius * sin(t)) for t in turns]


def bored(at: Point, half: float, radius: float, sides: int = 16) -> list[Polygon]:
    """A square with a round hole that a peg of `radius` just fits, as wedges; `sides` is a multiple
    of 8, so that the corners of the square are corners of wedges."""
    corner = radius / cos(pi / sides)
    rays = [(cos(2 * pi * k / sides), sin(2 * pi * k / sides)) for k in range(sides)]
    found = []
    for (c, s), (d, t) in pairwise([*rays, rays[0]]):
        far, further = half / max(abs(c), abs(s)), half / max(abs(d), abs(t))
        wedge = [(corner * c, corner * s), (far * c, far * s)]
        wedge += [(further * d, further * t), (corner * d, corner * t)]
        found.append([(at[0] + u, at[1] + v) for u, v in wedge])
    return found


Bore = tuple[Point, float, float]
"""Middle, half edge of the square cut into wedges, radius of the peg that just fits."""


def plate(outline: Polygon, bores: Sequence[Bore] = (), slots: Sequence[Polygon] = ()) -> list:
    """A rectangle with round holes and rectangular slots, as few rectangles and the wedges."""
    squares = [rectangle(u - h, u + h, v - h, v + h) for (u, v), h, _ in bores]
    gaps = [*squares, *slots]
    columns = sorted({u for polygon in (outline, *gaps) for u, _ in polygon})
    rows = sorted({v for polygon in (outline, *gaps) for _, v in polygon})
    columns = [u for u in columns if outline[0][0] <= u <= outline[2][0]]
    rows = [v for v in rows if outline[0][1] <= v <= outline[2][1]]
    runs: list[list[float]] = []
    for v0, v1 in pairwise(rows):
        row: list[list[float]] = []
        for u0, u1 in pairwise(columns):
            u, v = (u0 + u1) / 2, (v0 + v1) / 2
            if any(g[0][0] < u < g[2][0] and g[0][1] < v < g[2][1] for g in gaps):
                continue
            if row and row[-1][1] == u0:
                row[-1][1] = u1
            else:
                row.append([u0, u1, v0, v1])
        for run in row:
            below = next((r for r in runs if r[:2] == run[:2] and r[3] == run[2]), None)
            if below:
                below[3] = run[3]
            else:
                runs.append(run)
    wedges = [w for at, half, radius in bores for w in bored(at, half, radius)]
    return [rectangle(*run) for run in runs] + wedges


# --- bodies ---------------------------------------------------------------------------------------


def along(axis: str, polygon: Polygon, height: float) -> list[Corner]:
    """A polygon at a height: (u, v, height) are (x, y, z) for z, (y, z, x) for x, (z, x, y) for
    y."""
    turn = {"z": (0, 1, 2), "x": (2, 0, 1), "y": (1, 2, 0)}[axis]
    three = [(u, v, height) for u, v in polygon]
    return [(p[turn[0]], p[turn[1]], p[turn[2]]) for p in three]


def prisms(axis: str, polygons: Iterable[Polygon], low: float, high: float) -> Part:
    return [(along(axis, p, low), along(axis, p, high)) for p in polygons]


def block(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Part:
    return prisms("z", [rectangle(x0, x1, y0, y1)], z0, z1)


def turned(axis: str, profile: Sequence[tuple[float, float]], sides: int = 24, at: Point = (0, 0)):
    """A turned part: (height, radius) along its axis; where two follow at one height, a step."""
    return [
        (along(axis, circle(r, sides, at), h), along(axis, circle(s, sides, at), i))
        for (h, r), (i, s) in pairwise(profile)
        if h != i
    ]


def mesh(part: Part) -> str:
    """An OBJ file: the corners of each body apart from those of the others."""
    lines, first = ["# millimetres; made by make_meshes.py"], 1
    for number, (low, high) in enumerate(part, 1):
        n = len(low)
        lines.append(f"# body {number}")
        lines += ["v " + " ".join(f"{c + 0.0:.4f}" for c in corner) for corner in (*low, *high)]
        faces = [(0, k + 1, k) for k in range(1, n - 1)]
        faces += [(n, n + k, n + k + 1) for k in range(1, n - 1)]
        for k in range(n):
            m = (k + 1) % n
            faces += [(k, m, n + m), (k, n + m, n + k)]
        lines += ["f " + " ".join(str(first + c) for c in face) for face in faces]
        first += 2 * n
    return "\n".join(lines).replace("-0.0000", "0.0000") + "\n"


# --- the chest of drawers -------------------------------------------------------------------------

WIDE, DEEP, TALL, BOARD = 67.0, 50.0, 148.0, 8.0
"""Half the width and depth inside the carcass, its height, the thickness of its boards."""

SHELVES = [(0.0, 8.0), (48.0, 54.0), (94.0, 100.0), (140.0, 148.0)]
"""Heights of the shelves: the bottom, two dividers, the top."""

PEG = 2.4
"""Radius of the pegs of a shelf."""


def pegs(thin: bool) -> list[float]:
    """Where along y the pegs of a shelf are."""
    return [0.0] if thin else [-30.0, 30.0]


def shelf(thick: float) -> Part:
    """A board with pegs at both ends and a tongue at the back; its bottom at z = 0."""
    part = block(-WIDE + 0.1, WIDE - 0.1, -DEEP, DEEP - BOARD - 0.1, 0, thick)
    part += block(-30, 30, DEEP - BOARD - 0.1, DEEP - 0.5, 1.5, thick - 1.5)
    for y in pegs(thick < 8):
        peg = circle(PEG, 16, (y, thick / 2))
        part += prisms("x", [peg], -WIDE - BOARD + 0.5, -WIDE + 0.1)
        part += prisms("x", [peg], WIDE - 0.1, WIDE + BOARD - 0.5)
    return part


def side() -> Part:
    """A side of the carcass between x = 0 and its thickness, with the holes of the pegs."""
    bores = [
        ((y, (low + high) / 2), 3.2, PEG + SLACK)
        for low, high in SHELVES
        for y in pegs(high - low < 8)
    ]
    return prisms("x", plate(rectangle(-DEEP, DEEP, 0, TALL), bores), 0, BOARD)


def back() -> Part:
    """The back, with a slot for each shelf's tongue."""
    slots = [
        rectangle(low + 1.5 - SLACK, high - 1.5 + SLACK, -30 - SLACK, 30 + SLACK)
        for low, high in SHELVES
    ]
    outline = rectangle(0, TALL, -WIDE + 0.1, WIDE - 0.1)
    return prisms("y", plate(outline, (), slots), DEEP - BOARD, DEEP)


def tray() -> Part:
    """A drawer's tray, its bottom at z = 0, with a rail of T section across its front."""
    wide, front, rear, tall = WIDE - 0.3, -DEEP, 41.0, 34.0
    part = block(-wide, wide, front, rear, 0, 3)
    part += block(-wide, wide, front, front + 4, 3, tall)
    part += block(-wide, wide, rear - 4, rear, 3, tall)
    part += block(-wide, -wide + 4, front + 4, rear - 4, 3, tall)
    part += block(wide - 4, wide, front + 4, rear - 4, 3, tall)
    neck, head = 3 - SLACK, 6 - SLACK
    part += block(-60, 60, front - 3.2 - SLACK, front, 18 - neck, 18 + neck)
    part += block(-60, 60, front - 7.2 + SLACK, front - 3.2 - SLACK, 18 - head, 18 + head)
    return part


def front() -> Part:
    """A drawer's front, about the middle of its height: a slot of T section across its back, a hole
    for the knob. The tray's rail is at z = 0, 0.2 mm off the tray's front."""
    wide, half, rear = WIDE + BOARD - 1, 21.5, -DEEP - 0.2
    outline = rectangle(-half, half, -wide, wide)
    face = plate(outline, [((0, 0), 6, 3 + SLACK)])
    part = prisms("y", face, rear - 12, rear - 7)
    for gap, low, high in ((6, rear - 7, rear - 3), (3, rear - 3, rear)):
        rims = (rectangle(-half, -gap, -wide, wide), rectangle(gap, half, -wide, wide))
        part += prisms("y", rims, low, high)
    return part


def knob() -> Part:
    """A knob with a peg, along y; its shoulder is 0.1 mm off the front."""
    y = -DEEP - 12.2
    profile = [(y - 17, 5.5), (y - 15, 8), (y - 11, 9), (y - 8, 7), (y - 5, 4), (y - 2, 4)]
    profile += [(y - 0.1, 6), (y - 0.1, 3), (y + 4.5, 3)]
    return turned("y", profile)


# --- the gearbox ----------------------------------------------------------------------------------

MODULE, SMALL, LARGE = 3.0, 12, 20
"""Of the gears: pitch diameter by tooth; teeth."""

AXES = (-30.0, -30.0 + MODULE * (SMALL + LARGE) / 2)
"""Where along x the two shafts stand."""

FLOOR, RIM = 26.0, 52.0
"""Heights of the tub's floor, inside, and of its rim."""

SCREWS = [(x, y) for x in (-60.0, 60.0) for y in (-42.0, 42.0)]
"""Where the lid's screws are."""


def gear(teeth: int, gap_first: bool) -> Part:
    """A spur gear about the origin from z = 0, bored for a shaft of 6 mm: a tooth, or a gap, is at
    `gap_first` turned to +x. Flanks are straight."""
    pitch, half = MODULE * teeth / 2, MODULE * pi / 4 - 0.35
    root, tip = pitch - 1.25 * MODULE, pitch + 0.9 * MODULE
    slope = tan(radians(20))
    step = 2 * pi / teeth
    foot = (half + (pitch - root) * slope) / root
    bore = (6 + SLACK) / cos(max(foot, step / 2 - foot))

    def ring(radius: float, turn: float) -> Point:
        return radius * cos(turn), radius * sin(turn)

    polygons = []
    for k in range(teeth):
        at = step * (k + (0.5 if gap_first else 0.0))
        edge = (half - (tip - pitch) * slope) / tip
        tooth = [ring(bore, at - foot), ring(root, at - foot), ring(tip, at - edge)]
        tooth += [ring(tip, at + edge), ring(root, at + foot), ring(bore, at + foot)]
        since, until = at + foot, at + step - foot
        polygons.append(tooth)
        polygons.append(
            [ring(bore, since), ring(root, since), ring(root, until), ring(bore, until)]
        )
    return prisms("z", polygons, 0, 13.8)


def shaft(top: float) -> Part:
    """A shaft from its lower end in the tub's bore to `top`, with a collar under its gear."""
    profile = [(15.1, 4.5), (15.6, 5), (26.1, 5), (26.1, 9), (30, 9), (30, 6), (44.5, 6)]
    profile += [(44.5, 5), (top - 1, 5), (top, 4)]
    return turned("z", profile)


def tub() -> Part:
    """The housing: two bores in its floor, four in its rim, one through either end, rails of T
    section below."""
    x, y = 65.0, 47.0
    outline = rectangle(-x, x, -y, y)
    part = prisms("z", [outline], 12, 15)
    part += prisms("z", plate(outline, [((c, 0), 9, 5 + SLACK) for c in AXES]), 15, FLOOR)
    low, high = FLOOR, 45.0
    for sign in (-1, 1):
        ends = sorted((sign * (y - 10), sign * y))
        bores = [((36, 0), 7, 5 + SLACK)] if sign < 0 else []
        wall = plate(rectangle(low, high, -x, x), bores)
        part += prisms("y", wall, *ends)
        ends = sorted((sign * (x - 10), sign * x))
        bores = [((0, 36), 7, 5 + SLACK)] if sign > 0 else []
        part += prisms("x", plate(rectangle(-y + 10, y - 10, low, high), bores), *ends)
    inside = rectangle(-x + 10, x - 10, -y + 10, y - 10)
    holes = [(at, 4.0, 2 + SLACK) for at in SCREWS]
    part += prisms("z", plate(outline, holes, [inside]), high, RIM)
    for middle in (-30, 30):
        part += block(-x, x, middle - 3, middle + 3, 8, 12)
        part += block(-x, x, middle - 6, middle + 6, 5, 8)
    return part


def foot() -> Part:
    """A foot along x about y = 0, with a slot of T section for the tub's rail."""
    x, wide = 70.0, 12.0
    part = block(-x, x, -wide, wide, 0, 5 - SLACK)
    for gap, low, high in ((6 + SLACK, 5 - SLACK, 8 + SLACK), (3 + SLACK, 8 + SLACK, 12 - SLACK)):
        part += block(-x, x, -wide, -gap, low, high) + block(-x, x, gap, wide, low, high)
    return part


def lid() -> Part:
    """The lid, 0.1 mm over the rim, with the holes of two shafts and four screws, and windows over
    the gears; a lip below keeps it in place."""
    bores = [((c, 0.0), 9.0, 5 + SLACK) for c in AXES] + [(at, 4.0, 2 + SLACK) for at in SCREWS]
    windows = [rectangle(-47, 47, v, v + 19) for v in (-32, 13)]
    part = prisms("z", plate(rectangle(-65, 65, -47, 47), bores, windows), RIM + 0.1, RIM + 6)
    x, y = 55 - 0.2, 37 - 0.2
    lip = plate(rectangle(-x, x, -y, y), (), [rectangle(-x + 2, x - 2, -y + 2, y - 2)])
    return part + prisms("z", lip, RIM - 2, RIM + 0.1)


def screw() -> Part:
    """A cap screw about the origin; its head is 0.1 mm over the lid."""
    seat = RIM + 6.1
    profile = [(45.5, 1.5), (46, 2), (seat, 2), (seat, 3.5), (seat + 3.5, 3.5), (seat + 4, 3)]
    return turned("z", profile, 16)


def plug(axis: str, outside: float, inside: float, at: Point) -> Part:
    """A plug in a bore through a wall: a peg from outside to inside with a flange 0.1 mm off."""
    away = 1 if outside > inside else -1
    flange = outside + 0.1 * away
    profile = [(inside + 0.5 * away, 5.0), (flange, 5.0), (flange, 9.0)]
    profile += [(flange + 3 * away, 9.0), (flange + 4 * away, 8.0)]
    return turned(axis, profile if away > 0 else profile[::-1], at=at)


def coupling() -> Part:
    """A wheel about the origin from z = 0, bored for a shaft of 5 mm, with three handles."""
    rings = []
    count = 24
    bore = (5 + SLACK) / cos(pi / count)
    for inner, outer, low, high in ((bore, 10.0, 0, 12), (10.0, 16.0, 3, 7), (16.0, 20.0, 0, 9)):
        for k in range(count):
            a, b = 2 * pi * k / count, 2 * pi * (k + 1) / count
            if inner == 10.0 and (k // 4) % 2:
                continue
            wedge = [(r * cos(t), r * sin(t)) for r, t in ((inner, a), (outer, a))]
            wedge += [(r * cos(t), r * sin(t)) for r, t in ((outer, b), (inner, b))]
            rings += prisms("z", [wedge], low, high)
    return rings


# --- the peg in its pocket ------------------------------------------------------------------------

POCKETED = (40.0, 20.0)
"""Length and width of the peg."""

LOOSE = 0.2
"""Between the peg and each wall of its pocket."""


def base() -> Part:
    """A plate from z = 0 with four walls round a pocket for the peg, in its middle."""
    u, v = (length / 2 + LOOSE for length in POCKETED)
    wall, floor, rim = 8.0, 10.0, 22.0
    found = block(-40.0, 40.0, -40.0, 40.0, 0.0, floor)
    for x in (-u - wall, u):
        found += block(x, x + wall, -v - wall, v + wall, floor, rim)
    for y in (-v - wall, v):
        found += block(-u, u, y, y + wall, floor, rim)
    return found


PARTS = {
    "chest/thick_shelf": lambda: shelf(8.0),
    "chest/thin_shelf": lambda: shelf(6.0),
    "chest/side": side,
    "chest/back": back,
    "chest/tray": tray,
    "chest/front": front,
    "chest/knob": knob,
    "gearbox/tub": tub,
    "gearbox/foot": foot,
    "gearbox/lid": lid,
    "gearbox/screw": screw,
    "gearbox/small_gear": lambda: gear(SMALL, False),
    "gearbox/large_gear": lambda: gear(LARGE, LARGE % 2 == 0),
    "gearbox/long_shaft": lambda: shaft(82.0),
    "gearbox/short_shaft": lambda: shaft(66.0),
    "gearbox/sight": lambda: plug("y", -47.0, -37.0, (36.0, 0.0)),
    "gearbox/drain": lambda: plug("x", 65.0, 55.0, (0.0, 36.0)),
    "gearbox/wheel": coupling,
    "peg/base": base,
}
"""What makes the mesh of each part."""


def main(folder: Path) -> None:
    for name, make in PARTS.items():
        path = folder / f"{name}.obj"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(mesh(make()).encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
