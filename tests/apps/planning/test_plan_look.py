"""The exploded view of a planned product, as a still and as a film."""

from __future__ import annotations

from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from factory.apps.planning.exploded import ExplodedView
from factory.apps.planning.exploding import explosion
from factory.apps.planning.loose_parts import loose_parts
from factory.pipeline import read
from tests.command_line import Terminal
from tests.opengl import needs_gl

SHELF = """root = shelf; shelf = mate ( foot, top );
foot = atomic ( box = ( 0.2, 0.2, 0.1 ), pos = ( 0, 0, 0.05 ), rgba = ( 0.9, 0.1, 0.1, 1 ) );
top = atomic ( box = ( 0.2, 0.2, 0.1 ), pos = ( 0, 0, 0.15 ), rgba = ( 0.1, 0.2, 0.9, 1 ) )
"""


@needs_gl
def test_the_film_begins_apart_and_ends_together(tmp_path: Path) -> None:
    (tmp_path / "shelf.pag").write_text(SHELF)
    project = read(tmp_path / "shelf.pag")
    assert project.matings is not None
    view = ExplodedView(project.product, explosion(project.pag, project.matings, project.product))
    assert view.film(tmp_path / "film.mp4", fps=4.0) == 15
    film = iio.imread(tmp_path / "film.mp4", plugin="pyav")
    assert is_apart(film[0])
    assert not is_apart(film[-1])
    assert film[0].shape == (640, 480, 3)


@needs_gl
@pytest.mark.slow
def test_plan_writes_a_still_and_a_film(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "shelf.pag").write_text(SHELF)
    out = tmp_path / "out"
    done = Terminal(capsys)("plan", tmp_path / "shelf.pag", "--replan", "-o", out, "--json")
    assert done.status == 0, done.err
    names = [Path(name).name for name in done.json["files"]]
    assert names == ["shelf.pag", "shelf-exploded.png", "shelf-assembly.mp4"]
    still = iio.imread(out / "shelf-exploded.png")
    film = iio.imread(out / "shelf-assembly.mp4", plugin="pyav")
    assert is_apart(still)
    assert not is_apart(film[-1])


def is_apart(pixels: NDArray[np.uint8]) -> bool:
    """Whether the upper side of what is red is seen, which shines brighter than its walls."""
    red, green, blue = (pixels[..., k].astype(int) for k in range(3))
    return bool(((red > 200) & (green < 60) & (blue < 60)).sum() > 0.002 * red.size)


def test_a_light_stands_as_far_off_as_the_product_is_large() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    surfaces = {"a": (np.array(box.vertices), np.array(box.faces))}
    for size in (0.1, 2.0):
        m = loose_parts(surfaces, [(1.0, 0.0, 0.0, 1.0)], 0.0, size)
        assert m.light_pos == pytest.approx(-3.0 * size * m.light_dir, rel=0.01)
