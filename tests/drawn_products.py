"""Random products as people draw them: tables, plates on pins, tubs with inserts and lids, crates,
wheel sets and others, as meshes with real holes, of 1 mm to 2 m."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import manifold3d
import numpy as np
import trimesh

Solid = manifold3d.Manifold


@dataclass
class Drawing:
    """The parts of a product in place, and how an engineer would join them.

    Attributes:
        scale: metres per unit of the drawing.
        solids: by the name of the part, in units of the drawing, z up.
        joins: (name of the sub-assembly, its inputs in order), the last is the product.
    """

    scale: float
    solids: dict[str, Solid] = field(default_factory=dict)
    joins: list[tuple[str, list[str]]] = field(default_factory=list)

    def write(self, folder: Path) -> Path:
        """Writes each part as an STL file, and `product.pag`, whose path is returned."""
        folder.mkdir(parents=True, exist_ok=True)
        lines = [f"root = {self.joins[-1][0]};"]
        lines += [f"{name} = mate ( {', '.join(inputs)} );" for name, inputs in self.joins]
        for name, solid in self.solids.items():
            surface = solid.to_mesh()
            mesh = trimesh.Trimesh(np.asarray(surface.vert_properties)[:, :3], surface.tri_verts)
            mesh.apply_scale(self.scale)
            mesh.export(folder / f"{name}.stl")
            lines.append(f'{name} = atomic ( mesh = "{name}.stl" );')
        path = folder / "product.pag"
        path.write_text("\n".join(lines) + "\n", "utf-8")
        return path


def drawn_product(seed: int) -> Drawing:
    """A product of one of the kinds in `KINDS`, its size from a few millimetres to two metres."""
    rng = random.Random(seed)
    kind = rng.choice(KINDS)
    longest = 10 ** rng.uniform(np.log10(0.012), np.log10(2.0))
    drawing = Drawing(longest / 100)
    kind(rng, drawing)
    return drawing


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> Solid:
    """A box centred in x and y, standing at a height."""
    return Solid.cube((x, y, z), True).translate((at[0], at[1], at[2] + z / 2))


def rod(radius: float, height: float, at: tuple[float, float, float] = (0, 0, 0)) -> Solid:
    """An upright cylinder, standing at a height."""
    return Solid.cylinder(height, radius, radius, 32).translate(at)


def table(rng: random.Random, drawing: Drawing) -> None:
    """A top that lies on three or four legs, upside down or not, with or without a rail."""
    wide, thick = rng.uniform(40, 90), rng.uniform(3, 8)
    tall, leg = rng.uniform(20, 60), rng.uniform(4, 8)
    feet = [(1, 1), (1, -1), (-1, 1), (-1, -1)][: rng.choice([3, 4])]
    drawing.solids["top"] = box(
        100, wide, thick, (0, 0, tall if (over := rng.random() < 0.5) else 0)
    )
    names = []
    for n, (sx, sy) in enumerate(feet):
        names.append(f"leg{n}")
        at = (sx * (50 - leg), sy * (wide / 2 - leg), 0 if over else thick)
        shape = rod(leg / 2, tall, at) if rng.random() < 0.5 else box(leg, leg, tall, at)
        drawing.solids[names[-1]] = shape
    drawing.joins.append(("table", ["top", *names]))


def pinned(rng: random.Random, drawing: Drawing) -> None:
    """A base with pins in blind holes, and one or two plates that go over the pins."""
    fit, radius = rng.choice([0.0, 0.05, 0.1, 0.3]), rng.uniform(2, 5)
    spots = [(30, 15), (-30, 15), (30, -15), (-30, -15)][: rng.randint(1, 4)]
    base = box(100, 60, 12)
    plates = rng.randint(1, 2)
    thick = rng.uniform(4, 10)
    for x, y in spots:
        base -= rod(radius + fit, 8, (x, y, 4.0))
    drawing.solids["base"] = base
    names = ["base"]
    for n, (x, y) in enumerate(spots):
        names.append(f"pin{n}")
        drawing.solids[f"pin{n}"] = rod(radius, 8 + plates * thick + 3, (x, y, 4.0))
    for n in range(plates):
        plate = box(90, 50, thick, (0, 0, 12 + n * thick))
        for x, y in spots:
            plate -= rod(radius + fit, 2 * thick, (x, y, 12 + (n - 0.5) * thick))
        drawing.solids[f"plate{n}"] = plate
        names.append(f"plate{n}")
    drawing.joins.append(("pinned", names))


def tub(rng: random.Random, drawing: Drawing) -> None:
    """A tub with one to four inserts on its floor, and a lid with or without a lip."""
    wall, tall, gap = rng.uniform(2, 6), rng.uniform(20, 50), rng.choice([0.05, 0.2, 1.0])
    drawing.solids["tub"] = box(100, 60, tall) - box(
        100 - 2 * wall, 60 - 2 * wall, tall, (0, 0, wall)
    )
    count = rng.randint(1, 4)
    names = ["tub"]
    cell = (100 - 2 * wall) / count
    for n in range(count):
        x = -50 + wall + cell * (n + 0.5)
        size = (cell - 2 * gap, 60 - 2 * wall - 2 * gap)
        tall_n = rng.uniform(0.3, 0.8) * (tall - wall)
        insert = (
            box(*size, tall_n, (x, 0, wall))
            if rng.random() < 0.6
            else rod(min(size) / 2, tall_n, (x, 0, wall))
        )
        drawing.solids[f"insert{n}"] = insert
        names.append(f"insert{n}")
    lid = box(100, 60, 4, (0, 0, tall))
    if rng.random() < 0.5:
        lip = box(100 - 2 * wall - 2 * gap, 60 - 2 * wall - 2 * gap, 3, (0, 0, tall - 3))
        lid += lip
    if rng.random() < 0.85:
        drawing.solids["lid"] = lid
        names.append("lid")
    drawing.joins.append(("boxed", names))


def sheets(rng: random.Random, drawing: Drawing) -> None:
    """A stack of three to eight sheets of unequal outlines."""
    height, names = 0.0, []
    for n in range(rng.randint(3, 8)):
        thick = rng.uniform(1.5, 6)
        at = (rng.uniform(-5, 5), rng.uniform(-5, 5), height)
        drawing.solids[f"sheet{n}"] = box(rng.uniform(50, 95), rng.uniform(30, 80), thick, at)
        names.append(f"sheet{n}")
        height += thick
    drawing.joins.append(("stack", names))


def bars(rng: random.Random, drawing: Drawing) -> None:
    """Bars that lie across each other in two layers on a plate."""
    drawing.solids["plate"] = box(100, 100, 5)
    names, height = ["plate"], 5.0
    for layer in range(rng.randint(1, 2)):
        thick = rng.uniform(4, 10)
        for n in range(rng.randint(2, 3)):
            at = -35 + n * 35
            size, spot = ((90, thick), (0, at)) if layer % 2 == 0 else ((thick, 90), (at, 0))
            name = f"bar{layer}{n}"
            drawing.solids[name] = box(*size, thick, (*spot, height))
            names.append(name)
        height += thick
    drawing.joins.append(("bars", names))


def tubes(rng: random.Random, drawing: Drawing) -> None:
    """A foot with a spigot, tubes that go over each other, and a cap."""
    gap, radius = rng.choice([0.0, 0.05, 0.2]), rng.uniform(8, 14)
    foot = box(60, 60, 8) + rod(radius, 40, (0, 0, 8))
    drawing.solids["foot"] = foot
    names = ["foot"]
    inner = radius + gap
    for n in range(rng.randint(1, 3)):
        outer = inner + rng.uniform(3, 6)
        length = 40.0 - 8 * n
        drawing.solids[f"tube{n}"] = rod(outer, length, (0, 0, 8)) - rod(inner, 60, (0, 0, 0))
        names.append(f"tube{n}")
        inner = outer + gap
    if rng.random() < 0.6:
        drawing.solids["cap"] = rod(radius, 6, (0, 0, 48))
        names.append("cap")
    drawing.joins.append(("mast", names))


def crate(rng: random.Random, drawing: Drawing) -> None:
    """A floor with four walls around it, and perhaps a divider."""
    tall, wall = rng.uniform(20, 50), rng.uniform(3, 6)
    deep = rng.uniform(40, 80)
    drawing.solids["floor"] = box(100, deep, wall)
    drawing.solids["front"] = box(100, wall, tall, (0, -deep / 2 + wall / 2, wall))
    drawing.solids["back"] = box(100, wall, tall, (0, deep / 2 - wall / 2, wall))
    side = deep - 2 * wall
    drawing.solids["left"] = box(wall, side, tall, (-50 + wall / 2, 0, wall))
    drawing.solids["right"] = box(wall, side, tall, (50 - wall / 2, 0, wall))
    names = ["floor", "front", "back", "left", "right"]
    if rng.random() < 0.5:
        drawing.solids["divider"] = box(wall, side - 0.4, 0.8 * tall, (0, 0, wall))
        names.append("divider")
    drawing.joins.append(("crate", names))


def wheels(rng: random.Random, drawing: Drawing) -> None:
    """One or two axles in the open bearings of a frame, a wheel at each end."""
    radius, gap = rng.uniform(2, 4), rng.choice([0.05, 0.1, 0.3])
    frame = box(80, 30, 10, (0, 0, 10))
    axles = [-25.0, 25.0][: rng.randint(1, 2)]
    inputs = ["frame"]
    for n, x in enumerate(axles):
        groove = Solid.cylinder(40, radius + gap, radius + gap, 32, True).rotate((90, 0, 0))
        frame -= groove.translate((x, 0, 20)) + box(2 * (radius + gap), 40, 10, (x, 0, 20))
        axle = Solid.cylinder(60, radius, radius, 32, True).rotate((90, 0, 0))
        drawing.solids[f"axle{n}"] = axle.translate((x, 0, 20))
        for side in (-1, 1):
            disc = Solid.cylinder(6, 14, 14, 32, True).rotate((90, 0, 0))
            hole = Solid.cylinder(20, radius + gap, radius + gap, 32, True).rotate((90, 0, 0))
            disc = (disc - hole).translate((x, side * 24.0, 20))
            drawing.solids[f"wheel{n}{side > 0:d}"] = disc
        drawing.joins.append((f"set{n}", [f"axle{n}", f"wheel{n}0", f"wheel{n}1"]))
        inputs.append(f"set{n}")
    drawing.solids["frame"] = frame
    drawing.joins.append(("cart", inputs))


def gantry(rng: random.Random, drawing: Drawing) -> None:
    """Two posts on a base, a beam on both, perhaps a hanging head or a load below."""
    tall, post = rng.uniform(30, 70), rng.uniform(6, 12)
    drawing.solids["base"] = box(100, 40, 6)
    drawing.solids["post0"] = box(post, post, tall, (-40, 0, 6))
    drawing.solids["post1"] = box(post, post, tall, (40, 0, 6))
    drawing.solids["beam"] = box(96, post, 8, (0, 0, 6 + tall))
    names = ["base", "post0", "post1"]
    if rng.random() < 0.5:
        drawing.solids["load"] = box(20, 20, 0.5 * tall, (0, 0, 6))
        names.append("load")
    names.append("beam")
    if rng.random() < 0.5:
        drawing.solids["head"] = box(16, 16, 10, (rng.uniform(-20, 20), 0, 14 + tall))
        names.append("head")
    drawing.joins.append(("gantry", names))


KINDS: tuple[Callable[[random.Random, Drawing], None], ...] = (
    table,
    pinned,
    tub,
    sheets,
    bars,
    tubes,
    crate,
    wheels,
    gantry,
)
