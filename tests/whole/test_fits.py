"""Fits: a shaft in a bore of the same diameter, as files round it and facets draw it, and parts
that are allowed to be drawn into each other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, Mesh64

from factory.floor.geometry.facets import sagitta
from factory.floor.geometry.overlap import common, merged
from factory.floor.geometry.overlapping import overlaps_of
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.findings import LEFT_OUT, NO_DEEPER
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.support.arrays import Array
from factory.theory.compiler.expanding import expand
from factory.theory.lang.pag_reader import load_pag
from tests.command_line import Terminal

MM = 1e-3


def bar(diameter: float, length: float, sides: int = 48) -> Manifold:
    """An upright round bar about the origin [mm]."""
    return Manifold.cylinder(MM * length, MM * diameter / 2, -1.0, sides, True)


def tube(outer: float, inner: float, length: float, sides: int = 48) -> Manifold:
    """An upright tube about the origin [mm]."""
    return bar(outer, length, sides) - bar(inner, 2 * length, sides)


def rounded(body: Manifold, noise: float, rng: np.random.Generator) -> Manifold:
    """A body whose vertices are off by a noise [mm]."""
    vertices, faces = merged(body.to_mesh64())
    return Manifold(Mesh64(vertices + MM * rng.normal(0, noise, vertices.shape), faces))


def placed(body: Manifold, turn: Array, shift: Array) -> Manifold:
    """A body that is turned, then shifted."""
    return body.rotate(turn).translate(shift)


def write(folder: Path, **bodies: Manifold) -> Path:
    """A folder of STL files in millimetres."""
    folder.mkdir(exist_ok=True)
    for name, body in bodies.items():
        vertices, faces = merged(body.to_mesh64())
        mesh = trimesh.Trimesh(vertices / MM, faces, process=False)
        (folder / f"{name}.stl").write_bytes(mesh.export(file_type="stl"))
    return folder


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-6, 1e-5])
@pytest.mark.parametrize("diameter", [3.0, 4.7, 8.0, 20.0, 50.0])
def test_a_film_is_not_as_deep_as_the_bore(diameter: float, noise: float) -> None:
    """The shaft and the bore have one diameter, and share what rounding leaves between them."""
    rng = np.random.default_rng(round(1e8 * noise + diameter))
    shaft, sleeve = bar(diameter, 60, 24), tube(1.6 * diameter, diameter, 30, 24)
    turn, shift = rng.random(3) * 360, rng.normal(0, 0.3, 3)
    both = [placed(rounded(body, noise, rng), turn, shift) for body in (shaft, sleeve)]
    assert common(*both).depth <= 10 * MM * noise + 1e-12


def test_a_shaft_comes_along_a_bore_of_its_own_diameter(run: Terminal, tmp_path: Path) -> None:
    """From files with seven digits to a run: nothing is said, nothing has to be allowed, and the
    pair is tested for contact."""
    turn, shift = np.array([0.0, 0.0, 17.3]), np.array([0.1237, -0.0531, 0.0119])
    shaft, sleeve = (placed(b, turn, shift) for b in (bar(12, 60), tube(19, 12, 30)))
    out = tmp_path / "out"
    planned = run("plan", write(tmp_path / "fit", rod=shaft, sleeve=sleeve), "--no-look", "-o", out)
    assert planned.status == 0 and "1 lower" in planned.out
    checked = run("check", out / "fit.pag")
    assert "Overlap" not in planned.err + checked.err
    assert "1 lowered, 0 blocked" in checked.out
    done = run("run", out / "fit.pag")
    assert done.status == 0 and "not checked" not in done.out


def test_overlaps_by_facets_are_called_that(run: Terminal, tmp_path: Path) -> None:
    """In `plan`, `check` and `run` alike, with the allowance, which is enough."""
    plate = bar(40, 20, 90) - bar(20, 40, 24).rotate((0.0, 0.0, 7.5))
    folder, out = write(tmp_path / "facets", plate=plate, shaft=bar(20, 40, 24)), tmp_path / "out"
    words = "which may be their facets (sagitta 0.086 mm)"
    option = "--allow plate:shaft:0.09mm"
    planned, file = run("plan", folder, "--no-look", "-o", out), out / "facets.pag"
    for said in (planned, run("check", file), run("run", file)):
        assert words in said.err + said.out
        assert option in said.err and "correct the drawing" not in said.err
    allowed = run("check", file, *option.split())
    assert "Overlap" not in allowed.err and "0.06 mm when finished" in allowed.out


def test_the_sagitta_is_that_of_the_facets_that_meet_there() -> None:
    """Of both sides of a round surface, of meshes with more triangles than facets, of a fillet
    beside a plane; not of chamfers, nor elsewhere."""
    everywhere = np.full((2, 3), [[-1.0], [1.0]])
    for sides in (10, 24, 64):
        expected = pytest.approx(0.01 * (1 - np.cos(np.pi / sides)))
        shaft = bar(20, 30, sides).rotate((10.0, 20.0, 30.0))
        assert sagitta(shaft, *everywhere) == expected
        assert sagitta(shaft.refine(3), *everywhere) == expected
        bush = tube(40, 20, 30, sides)
        assert sagitta(bush, *(0.011 * everywhere)) == expected
        assert sagitta(bush, *(0.004 * everywhere)) == 0.0
    corners = [bar(10, 10, 32).translate((x, y, 0.0)) for x in (0, 0.1) for y in (0, 0.08)]
    plate = Manifold.batch_hull(corners)
    assert sagitta(plate, *everywhere) == pytest.approx(0.005 * (1 - np.cos(np.pi / 32)))
    block = Manifold.cube((0.1, 0.1, 0.1), True)
    chamfered = block ^ Manifold.cube((0.13, 0.13, 0.2), True).rotate((0.0, 0.0, 45.0))
    assert sagitta(block, *everywhere) == sagitta(chamfered, *everywhere) == 0.0


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
