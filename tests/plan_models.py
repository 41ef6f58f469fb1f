"""Small products with known answers, as volumes: none is made of convex bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import Manifold

from factory.apps.planning.parts import InPlace
from factory.apps.planning.source import SourceOptions, read_source
from factory.theory.lang.template_reader import all_templates

MM = 1e-3

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)


@dataclass(frozen=True)
class Model:
    """Parts in place [mm], and along which `ways` the named ones leave the others: either way of a
    direction in `both`, one way of one in `ways`. Neither: they cannot be joined, and `stuck` are
    the parts that hold each other."""

    parts: Mapping[str, Manifold]
    ways: Mapping[str, tuple[float, ...]] | None = None
    both: Mapping[str, tuple[float, ...]] | None = None
    stuck: frozenset[str] = frozenset()


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> Manifold:
    """A box about a point."""
    return Manifold.cube((x, y, z), True).translate(at)


def rod(radius: float, length: float, axis: tuple[int, int, int] = Z, sides: int = 16) -> Manifold:
    """A round bar along an axis through the origin."""
    bar = Manifold.cylinder(length, radius, radius, sides, True)
    return bar.rotate((0, 90, 0)) if axis == X else bar.rotate((90, 0, 0)) if axis == Y else bar


def tail(gap: float, length: float = 60) -> Manifold:
    """The profile of a dovetail along x, wider by a gap on either side."""
    low, high = 12 + gap, 7 + gap
    profile = [(-length / 2, y, z) for y, z in ((-low, -gap), (low, -gap), (high, 10), (-high, 10))]
    return Manifold.hull_points(np.array([*profile, *((-x, y, z) for x, y, z in profile)]))


def socket(ends: tuple[int, ...] = ()) -> Manifold:
    """The socket of a dovetail, with walls at some of its ends."""
    body = box(60, 40, 15.8, (0, 0, 2)) - tail(0.2, 70)
    for side in ends:
        body += box(4, 40, 15.8, (32 * side, 0, 2))
    return body


def jig() -> dict[str, Manifold]:
    """A plate with four holes, and four dowels."""
    at = [(x, y, 0) for x in (-20, 20) for y in (-15, 15)]
    plate = box(60, 44, 10)
    for place in at:
        plate -= rod(3.05, 12).translate(place)
    return {"plate": plate, **{f"dowel{n}": rod(3, 16).translate(p) for n, p in enumerate(at)}}


def cabinet() -> dict[str, Manifold]:
    """Two drawers in a cabinet that is open in front, with a knob each that is higher than its
    drawer."""
    body = box(44, 40, 44) - box(40, 38, 19, (0, -2, 10.5)) - box(40, 38, 19, (0, -2, -10.5))
    parts = {"cabinet": body}
    for n, z in enumerate((10.5, -10.5)):
        drawer = box(39, 36, 16, (0, -2, z - 1)) - box(35, 32, 16, (0, -2, z + 1))
        parts[f"drawer{n}"] = drawer + box(6, 4, 19, (0, -22, z))
    return parts


def slanted(angle: float) -> dict[str, Manifold]:
    """A peg in a blind hole that leans so far [degrees] from the vertical in x."""
    peg = rod(4, 40).rotate((0, angle, 0))
    hole = rod(4.1, 40.2).rotate((0, angle, 0)) + rod(4.1, 60).rotate((0, angle, 0)).translate(
        tuple(30 * np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))]))
    )
    return {"block": box(50, 30, 30, (0, 0, -8)) - hole, "peg": peg}


def snapped(lip: float) -> dict[str, Manifold]:
    """A cover over a base, with a lip that reaches so far into the groove of the base."""
    base = box(40, 40, 20) - (box(42, 42, 4) - box(36, 36, 6))
    cover = box(46, 46, 26, (0, 0, 2)) - box(40.4, 40.4, 26, (0, 0, -1.8))
    ring = box(42, 42, 3) - box(40.4 - 2 * lip, 40.4 - 2 * lip, 6)
    return {"base": base, "cover": cover + ring}


MODELS: Mapping[str, Model] = {
    "cross pin": Model(
        {"block": box(30, 30, 30) - rod(4.1, 40, X), "pin": rod(4, 44, X)}, both={"pin": X}
    ),
    "cabinet": Model(cabinet(), ways={"drawer0": (0, -1, 0), "drawer1": (0, -1, 0)}),
    "press fit": Model(
        {"frame": box(40, 40, 10) - box(20, 20, 12), "peg": box(20.1, 20.1, 30)}, both={"peg": Z}
    ),
    "slanted peg": Model(slanted(30), ways={"peg": (0.5, 0, 0.75**0.5)}),
    "snap": Model(snapped(1.0), stuck=frozenset({"base", "cover"})),
    "dovetail across closed": Model(
        {"socket": socket((1, -1)).rotate((0, 0, 45)), "tail": tail(0, 58).rotate((0, 0, 45))},
        stuck=frozenset({"socket", "tail"}),
    ),
}


def model_source(folder: Path, parts: Mapping[str, Manifold]) -> InPlace:
    """Parts [mm] as a source of a plan."""
    lines = [f"root = all; all = mate ( {', '.join(parts)} );"]
    for label, body in parts.items():
        mesh = body.to_mesh64()
        vertices, faces = np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts) + 1
        text = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices.tolist()]
        text += [f"f {a} {b} {c}" for a, b, c in faces.tolist()]
        (folder / f"{label}.obj").write_text("\n".join(text))
        lines.append(f'{label} = atomic ( mesh = "{label}.obj", scale = {MM} );')
    file = folder / "model.pag"
    file.write_text("\n".join(lines))
    return read_source(file, all_templates(), SourceOptions(replan=True))
