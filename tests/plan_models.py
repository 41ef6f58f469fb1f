"""Twenty small products with known answers, as volumes, for the tests of ways: none is made of
convex bodies, and hulls tell of nearly all of them what is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from manifold3d import Manifold

from factory.apps.planning.parts import InPlace
from factory.apps.planning.source import SourceOptions, read_source
from factory.pipeline import all_templates

MM = 1e-3

X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
TURNED = np.cos(np.pi / 4), np.sin(np.pi / 4)


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


def tube(outer: float, inner: float, length: float, axis: tuple[int, int, int] = Z) -> Manifold:
    """A round bar with a hole."""
    return rod(outer, length, axis) - rod(inner, length + 2, axis)


def link(at: float, turned: bool) -> Manifold:
    """A link of a chain along x."""
    ring = box(40, 24, 6) - box(28, 12, 8)
    return (ring.rotate((90, 0, 0)) if turned else ring).translate((at, 0, 0))


def tee(gap: float = 0.0) -> Manifold:
    """A profile like a T along y, larger by a gap all round."""
    foot, neck = box(20 + gap, 60, 6 + gap, (0, 0, -4)), box(8 + gap, 60, 20, (0, 0, 6))
    return foot + neck


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


def caged() -> dict[str, Manifold]:
    """A ball in a tub with a lid whose hole it does not go through."""
    tub = box(40, 40, 30) - box(32, 32, 30, (0, 0, 4))
    lid = box(40, 40, 4, (0, 0, 17)) + box(31.6, 31.6, 3, (0, 0, 14))
    lid -= rod(6, 12).translate((0, 0, 16))
    return {"tub": tub, "ball": Manifold.sphere(10, 24).translate((0, 0, 0)), "lid": lid}


def keyed() -> dict[str, Manifold]:
    """A wheel with a flat in its bore, on a shaft with a collar below."""
    shaft = rod(5, 40) - box(10, 20, 30, (8.5, 0, 10))
    bore = rod(5.1, 20) - box(10, 20, 30, (8.6, 0, 10))
    return {"shaft": shaft + rod(9, 4).translate((0, 0, -8)), "wheel": rod(15, 8) - bore}


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


def cube_in(lids: tuple[int, ...]) -> dict[str, Manifold]:
    """A cube in a frame with foils of 0.1 mm far out at some ends of its hole."""
    frame = box(30, 200, 30) - box(20.2, 202, 20.2)
    for side in lids:
        frame += box(30, 0.1, 30, (0, 99.95 * side, 0))
    return {"frame": frame, "cube": box(20, 20, 20)}


MODELS: Mapping[str, Model] = {
    "jig": Model(jig(), both={f"dowel{n}": Z for n in range(4)}),
    "blind hole": Model(
        {
            "block": box(30, 30, 30) - rod(5.1, 30).translate((0, 0, 8)),
            "peg": rod(5, 30).translate((0, 0, 8.1)),
        },
        ways={"peg": Z},
    ),
    "cross pin": Model(
        {"block": box(30, 30, 30) - rod(4.1, 40, X), "pin": rod(4, 44, X)}, both={"pin": X}
    ),
    "one thin wall": Model(cube_in((1,)), ways={"cube": (0, -1, 0)}),
    "tee slot": Model(
        {"rail": box(40, 60, 24) - tee(0.4), "nut": tee() ^ box(40, 20, 60)}, both={"nut": Y}
    ),
    "cabinet": Model(cabinet(), ways={"drawer0": (0, -1, 0), "drawer1": (0, -1, 0)}),
    "caged ball": Model(caged(), ways={"lid": Z}),
    "keyed wheel": Model(keyed(), ways={"wheel": Z}),
    "three tubes": Model(
        {"outer": tube(20, 15.1, 40), "middle": tube(15, 10.1, 40), "inner": tube(10, 5, 40)},
        both={"inner": Z},
    ),
    "press fit": Model(
        {"frame": box(40, 40, 10) - box(20, 20, 12), "peg": box(20.1, 20.1, 30)}, both={"peg": Z}
    ),
    "dovetail across": Model(
        {"socket": socket((1,)).rotate((0, 0, 45)), "tail": tail(0, 58).rotate((0, 0, 45))},
        ways={"tail": (-TURNED[0], -TURNED[1], 0)},
    ),
    "slanted peg": Model(slanted(30), ways={"peg": (0.5, 0, 0.75**0.5)}),
    "snap": Model(snapped(1.0), stuck=frozenset({"base", "cover"})),
    "ball in a shell": Model(
        {
            "shell": Manifold.sphere(20, 24) - Manifold.sphere(16, 24) - rod(8, 60),
            "ball": Manifold.sphere(12, 24),
        },
        stuck=frozenset({"shell", "ball"}),
    ),
    "chain": Model({"one": link(0, False), "two": link(26, True)}, stuck=frozenset({"one", "two"})),
    "dumbbell": Model(
        {
            "plate": box(40, 40, 6) - rod(4.1, 8),
            "dumbbell": rod(4, 30)
            + rod(8, 6).translate((0, 0, 12))
            + rod(8, 6).translate((0, 0, -12)),
        },
        stuck=frozenset({"plate", "dumbbell"}),
    ),
    "two thin walls": Model(cube_in((1, -1)), stuck=frozenset({"frame", "cube"})),
    "tee slot closed": Model(
        {"rail": box(40, 60, 24) - (tee(0.4) ^ box(40, 30, 60)), "nut": tee() ^ box(40, 20, 60)},
        stuck=frozenset({"rail", "nut"}),
    ),
    "dovetail across closed": Model(
        {"socket": socket((1, -1)).rotate((0, 0, 45)), "tail": tail(0, 58).rotate((0, 0, 45))},
        stuck=frozenset({"socket", "tail"}),
    ),
    "bent peg": Model(
        {
            "block": box(40, 40, 40)
            - rod(4.1, 30).translate((0, 0, 10))
            - rod(4.1, 12, X).translate((5, 0, -5)),
            "peg": (rod(4, 30).translate((0, 0, 10)) + rod(4, 12, X).translate((5, 0, -5))),
        },
        stuck=frozenset({"block", "peg"}),
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
