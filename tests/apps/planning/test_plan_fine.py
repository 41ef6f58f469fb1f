"""Parts of many triangles: decimated bodies decide nothing that the parts themselves would not, and
nothing is decomposed before there is a tree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.blocking import blocking
from factory.apps.planning.parts import InPlace
from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.floor.geometry.decimation import ENOUGH, decimated
from factory.floor.geometry.mesh_reader import read_mesh
from factory.pipeline import all_templates
from tests.plan_models import MM, box

SIDES = 512
"""The sides of round parts."""


def ball(radius: float) -> Manifold:
    return Manifold.sphere(radius, SIDES // 4)


def round_box() -> dict[str, Manifold]:
    """A ball in a socket that is open above, with 0.02 mm between them, and a cap on it."""
    hole = Manifold.cylinder(20, 8.02, 8.02, SIDES).translate((0, 0, 0))
    socket = box(30, 30, 30) - ball(8.02) - hole
    cap = box(30, 30, 6, (0, 0, 18.1)) + Manifold.cylinder(6, 6, 6, SIDES).translate((0, 0, 9))
    return {"socket": socket, "ball": ball(8.0), "cap": cap}


def folder_of(folder: Path, parts: dict[str, Manifold]) -> Path:
    """A folder of OBJ files in millimetres."""
    folder.mkdir()
    for name, body in parts.items():
        mesh = body.to_mesh64()
        lines = ["v {:.6f} {:.6f} {:.6f}".format(*v) for v in np.asarray(mesh.vert_properties)]
        lines += ["f {} {} {}".format(*(f + 1)) for f in np.asarray(mesh.tri_verts).astype(int)]
        (folder / f"{name}.obj").write_text("\n".join(lines) + "\n")
    return folder


@pytest.fixture
def fine(tmp_path: Path) -> InPlace:
    """The round box, read."""
    folder = folder_of(tmp_path / "box", round_box())
    return read_source(folder, all_templates(), SourceOptions(unit="mm", in_place=True))


@pytest.mark.parametrize("within", [1e-2, 1e-1])
def test_a_decimated_body_is_as_near_as_it_says(within: float) -> None:
    body = ball(8.0)
    coarse = decimated(body, within)
    assert coarse.body.num_tri() < body.num_tri() and 0 < coarse.far <= within
    points = np.asarray(coarse.body.to_mesh64().vert_properties)
    middles = points[np.asarray(coarse.body.to_mesh64().tri_verts).astype(int)].mean(axis=1)
    sunk = 8.0 - np.linalg.norm(middles, axis=1).min()
    assert sunk <= 3 * within, "the surface has not gone elsewhere"


def test_what_is_coarse_enough_stays_as_it_is() -> None:
    body = Manifold.sphere(8.0, 32)
    assert body.num_tri() <= ENOUGH
    assert decimated(body, 1.0).body is body


def test_a_tolerance_that_no_coarser_body_keeps_gives_the_body_itself() -> None:
    body = ball(8.0)
    coarse = decimated(body, 1e-9)
    assert coarse.far == 0.0 and coarse.body.num_tri() == body.num_tri()


def test_decimated_bodies_change_no_verdict(fine: InPlace, monkeypatch: pytest.MonkeyPatch) -> None:
    assert max(len(part.faces) for part in fine.parts) > ENOUGH
    quick = blocking(fine)
    monkeypatch.setattr("factory.floor.mating.drawn.ENOUGH", 10**9)
    fine.__dict__.pop("product")  # and all that was measured of it
    monkeypatch.setattr("factory.floor.mating.overlaps.load_arrays", lambda *_: None)
    exact = blocking(fine)
    assert (quick.levels == exact.levels).all() and (quick.locks == exact.locks).all()
    assert (quick.touch == exact.touch).all() and quick.levels.any()


def test_no_part_is_decomposed_before_there_is_a_tree(
    fine: InPlace, monkeypatch: pytest.MonkeyPatch
) -> None:
    stages: list[str] = []

    def cut(*_: object) -> tuple[object, ...]:
        stages.append("coacd")
        return ()

    monkeypatch.setattr("factory.floor.geometry.decomposition.can_decompose", lambda: True)
    monkeypatch.setattr("factory.floor.geometry.decomposition._kept", lambda *_: None)
    monkeypatch.setattr("factory.floor.geometry.decomposition._run_coacd", cut)
    monkeypatch.setattr("factory.floor.geometry.decomposition.store_arrays", lambda *_: None)
    monkeypatch.setattr("factory.floor.geometry.product._kept", lambda *_: None)
    monkeypatch.setattr("factory.floor.geometry.product._keep", lambda *_: None)
    found = plan(fine, PlanOptions(told=lambda stage, *_: stages.append(stage)))
    assert isinstance(found, Planned)
    assert "coacd" in stages, "nothing was decomposed at all"
    assert stages.index("coacd") > stages.index("searching for a tree")
    assert stages.index("coacd") > stages.index("decomposing parts into convex bodies")


@pytest.mark.parametrize("more", ["", "vn 0 0 1\n", "g body\n"])
def test_plain_files_are_read_as_others_are(more: str) -> None:
    """A line of another kind takes the slow way."""
    mesh = ball(8.0 * MM).to_mesh64()
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*v) for v in np.asarray(mesh.vert_properties)]
    lines += ["f {} {} {}".format(*(f + 1)) for f in np.asarray(mesh.tri_verts).astype(int)]
    text = "# a ball\n" + "\n".join(lines) + "\n"
    plain, other = (read_mesh(t.encode(), ".obj").merged() for t in (text, more + text))
    assert all(np.array_equal(one, two) for one, two in zip(plain, other, strict=True))
