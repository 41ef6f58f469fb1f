"""Fits: a shaft in a bore of the same diameter, as files round it and facets draw it, and parts
that are allowed to be drawn into each other."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh
from manifold3d import Manifold

from factory.floor.geometry.overlap import merged
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.findings import LEFT_OUT, NO_DEEPER
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.theory.compiler.expanding import expand
from factory.theory.lang.pag_reader import load_pag

MM = 1e-3


def bar(diameter: float, length: float, sides: int = 48) -> Manifold:
    """An upright round bar about the origin [mm]."""
    return Manifold.cylinder(MM * length, MM * diameter / 2, -1.0, sides, True)


def write(folder: Path, **bodies: Manifold) -> Path:
    """A folder of STL files in millimetres."""
    folder.mkdir(exist_ok=True)
    for name, body in bodies.items():
        vertices, faces = merged(body.to_mesh64())
        mesh = trimesh.Trimesh(vertices / MM, faces, process=False)
        (folder / f"{name}.stl").write_bytes(mesh.export(file_type="stl"))
    return folder


PINNED = """root = r; r = mate ( ring, pin );
ring = atomic ( mesh = "ring.stl", scale = 0.001 );
pin = atomic ( cylinder = ( 0.0015, 0.03 ), pos = ( 0.012, 0, 0.005 ) );
allow ( pin, ring, 0.01 );"""


def test_a_way_that_cuts_is_not_clean_however_deep_parts_are(tmp_path: Path) -> None:
    """A pin where the ring has no hole is as deep in it as it is thick. It comes sideways through
    solid without getting deeper, or from above, where it cuts no more than it fills."""
    cone = Manifold.cylinder(10 * MM, 20 * MM, 19 * MM, 48, True)
    write(tmp_path, ring=cone - bar(10, 20))
    (tmp_path / "r.pag").write_text(PINNED)
    pag = load_pag(tmp_path / "r.pag", all_templates())
    product = product_geometry(pag)
    assert overlaps_of(product).pairs[0].depth == pytest.approx(1.5e-3, rel=0.05)
    nodes = expand(pag, all_templates())
    (made,) = matings(nodes, product).all
    assert made.approach.told == "pin is lowered 0.035 m"
    assert (made.slide, made.lower) == (LEFT_OUT, NO_DEEPER)
    found = matings(nodes, product, lifts=False)
    assert found.faults(pag.allowed) == ()
    assert "through each other" in found.notes(pag.allowed)[0]
