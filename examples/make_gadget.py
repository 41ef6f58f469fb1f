"""Makes a folder of CAD: ten STL files of a sensor in a case, each where it is in the product.

    python examples/make_gadget.py [FOLDER]

The tutorial "From CAD to a running cell" begins with it. Lengths are millimetres. Takes manifold3d,
which the package installs.
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
from manifold3d import Manifold

FIT = 0.15
"""Room between parts that slide in each other."""

POSTS = [(x, y) for x in (-24.0, 24.0) for y in (-15.0, 15.0)]
"""Where the screws are."""

LEDGES = [(x, y) for x in (-16.0, 16.0) for y in (-9.0, 9.0)]
"""Where the board lies on the case."""


def box(x: float, y: float, z: float, low: float = 0.0) -> Manifold:
    """A box centred in x and y, from a height on."""
    return Manifold.cube((x, y, z), True).translate((0, 0, low + z / 2))


def rod(radius: float, low: float, high: float, at: tuple[float, float] = (0, 0)) -> Manifold:
    """An upright cylinder."""
    return Manifold.cylinder(high - low, radius, radius, 48).translate((*at, low))


def case() -> Manifold:
    """A tub with a drilled post for each screw, and ledges for the board."""
    made = box(60, 42, 26) - box(54, 36, 26, 3)
    for at in LEDGES:
        made = made + rod(3, 3, 10, at)
    for at in POSTS:
        made = made + rod(4, 3, 20, at) - rod(1.5, 8, 27, at)
    return made


def lid() -> Manifold:
    """It lies on the walls and the posts; its rim goes into the tub."""
    made = box(60, 42, 3, 26) + (box(54 - 2 * FIT, 36 - 2 * FIT, 4, 22) - box(48, 30, 5, 21.5))
    for at in POSTS:
        made = made - rod(4.5, 20, 26, at) - rod(1.7, 20, 30, at)
    return made - rod(5.2, 20, 30)


def screw(at: tuple[float, float]) -> Manifold:
    """M3, 15 mm long, with a cylinder head."""
    return rod(1.5, 14, 29, at) + (rod(2.75, 29, 32, at) - rod(1.2, 30.5, 33, at))


def parts() -> dict[str, Manifold]:
    """The parts by their names."""
    made = {
        "case": case(),
        "battery": box(24, 20, 6, 3),
        "board": box(38, 24, 2, 10),
        "sensor": box(12, 12, 8, 12),
        "lid": lid(),
        "knob": rod(5, 20.0, 30) + rod(7, 30, 35),
    }
    return made | {f"screw_M3x15_{n}": screw(at) for n, at in enumerate(POSTS, 1)}


def stl(solid: Manifold) -> bytes:
    """Binary STL."""
    mesh = solid.to_mesh()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    rows = np.zeros(len(corners), [("v", "<f4", (4, 3)), ("a", "<u2")])
    rows["v"] = np.concatenate([normals[:, None], corners], axis=1)
    return bytes(80) + struct.pack("<I", len(corners)) + rows.tobytes()


def main(folder: Path) -> None:
    """Write the files."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, solid in parts().items():
        (folder / f"{name}.stl").write_bytes(stl(solid))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "gadget"))
