"""How a planned product stands, and what turns bring its ways along axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.plan import CannotAssemble, Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.standing import overhang
from factory.pipeline import all_templates
from factory.support.errors import InputError
from tests.paths import ROOT
from tests.plan_models import box, jig, model_source, slanted, socket, tail

QUICK = PlanOptions(lay_out=False)
CASES = ROOT.parent / "shared" / "cases"


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ways are the same without CoACD, which takes most of the time."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


def turned(parts: dict[str, Manifold], *angles: float) -> dict[str, Manifold]:
    return {label: body.rotate(angles) for label, body in parts.items()}


def test_a_wall_stands_as_it_was_drawn() -> None:
    if not CASES.exists():
        pytest.skip(f"{CASES} is missing: the shared cases are not here")
    found = plan(read_source(CASES / "wall10.glb", all_templates(), SourceOptions()), QUICK)
    assert isinstance(found, Planned)
    assert found.orientation[2] == pytest.approx((0, 0, 1))
    assert found.notes[0].startswith("the product stands as it was drawn, +z up")


def test_another_side_is_up_if_it_is_asked_for(tmp_path: Path) -> None:
    parts = {"low": box(40, 40, 40), "high": box(40, 40, 40, (0, 0, 40))}
    source = model_source(tmp_path, parts)
    for up in ((0, 1), (1, -1), (2, -1)):
        found = plan(source, PlanOptions(lay_out=False, up=up))
        assert isinstance(found, Planned)
        assert found.orientation[2] == pytest.approx(up[1] * np.eye(3)[up[0]])


def test_what_would_tip_stands_on_another_side_and_an_up_that_tips_is_refused(
    tmp_path: Path,
) -> None:
    """A bar on a post at its end: as drawn its centre of mass is beyond the post."""
    parts = {"post": box(10, 10, 20, (0, 0, 10)), "bar": box(90, 10, 10, (40, 0, 25))}
    source = model_source(tmp_path, parts)
    assert overhang(source.parts, np.array([0.0, 0.0, 1.0])) > 0.02
    found = plan(source, QUICK)
    assert isinstance(found, Planned)
    assert overhang(source.parts, found.orientation[2]) < 0
    assert "of the file up" in found.notes[0]
    with pytest.raises(InputError, match=r"tips over if .z is up"):
        plan(source, PlanOptions(lay_out=False, up=(2, 1)))


def test_a_model_that_was_drawn_leaning_stands_on_its_face(tmp_path: Path) -> None:
    """A jig that leans by 30° comes apart along its holes, and these are upright."""
    found = plan(model_source(tmp_path, turned(jig(), 30, 0, 0)), QUICK)
    assert isinstance(found, Planned)
    way = (0, -0.5, 0.75**0.5)
    assert abs(found.orientation[2] @ way) == pytest.approx(1, abs=1e-6)
    assert all(abs(np.dot(join.direction, way)) > 1 - 1e-6 for join in found.operations)


def test_a_turn_about_the_vertical_is_said_with_its_angle(tmp_path: Path) -> None:
    parts = turned({"socket": socket(), "tail": tail(0, 58)}, 0, 0, 30)
    found = plan(model_source(tmp_path, parts), QUICK)
    assert isinstance(found, Planned)
    assert found.orientation[2] == pytest.approx((0, 0, 1))
    assert "turned by" in found.notes[0] and "30°" in found.notes[0].replace("60°", "30°")
    (join,) = found.operations
    assert np.abs(join.direction) == pytest.approx((0.75**0.5, 0.5, 0), abs=1e-6)


def test_ways_that_no_turn_brings_along_axes_are_named(tmp_path: Path) -> None:
    """Two dovetails in one block, at 20° and at 50° about the vertical."""
    one, other = (0, 0, 20), (0, 0, 50)
    base = socket().rotate(one) + socket().rotate(other).translate((0, 90, 0))
    base += box(20, 120, 10, (0, 45, -3.9)) - tail(0.2, 70).rotate(one)
    base -= tail(0.2, 70).rotate(other).translate((0, 90, 0))
    parts = {
        "base": base,
        "first": tail(0, 58).rotate(one),
        "second": tail(0, 58).rotate(other).translate((0, 90, 0)),
    }
    found = plan(model_source(tmp_path, parts), QUICK)
    assert isinstance(found, CannotAssemble)
    ways = {labels: np.abs(way) for labels, way in found.needs}
    for label, angle in (("first", np.radians(20)), ("second", np.radians(50))):
        assert ways[label,] == pytest.approx((np.cos(angle), np.sin(angle), 0), abs=1e-6)


def test_a_peg_that_leans_is_put_in_lying(tmp_path: Path) -> None:
    """It leans by 20°: neither the block nor what has the peg stands on an edge."""
    found = plan(model_source(tmp_path, slanted(20)), QUICK)
    assert isinstance(found, Planned)
    assert np.abs(found.orientation[2]) == pytest.approx((0, 1, 0), abs=1e-6)
    assert overhang(model_source(tmp_path, slanted(20)).parts, found.orientation[2]) < 0


def test_no_sub_assembly_tips_where_another_order_stands(tmp_path: Path) -> None:
    """A bar on two posts: with one post alone it would tip over."""
    posts = {f"post{n}": box(10, 10, 40, (x, 0, 20)) for n, x in enumerate((-45, 45))}
    parts = {"floor": box(100, 20, 4, (0, 0, -2)), **posts, "bar": box(100, 10, 10, (0, 0, 45))}
    found = plan(model_source(tmp_path, parts), QUICK)
    assert isinstance(found, Planned) and found.figures.tips == 0
    made = [{*join.pile, *join.come} for join in found.operations]
    assert not any({"bar"} < units and "floor" not in units for units in made)
    assert not any("tip" in note for note in found.notes)
    bridge = plan(model_source(tmp_path, {k: v for k, v in parts.items() if k != "floor"}), QUICK)
    assert isinstance(bridge, Planned) and bridge.figures.tips == 1
    assert any("a sub-assembly tips over" in note for note in bridge.notes)


@pytest.mark.parametrize("base", ["plate", "dowel2"])
def test_all_others_come_onto_the_base(base: str, tmp_path: Path) -> None:
    found = plan(model_source(tmp_path, jig()), PlanOptions(lay_out=False, base=base))
    assert isinstance(found, Planned)
    made = [join for join in found.operations if base in (*join.pile, *join.come)]
    assert made and all(base in join.pile for join in made)
    assert all(join.direction[2] > 0 for join in made if join.lowered)
    with pytest.raises(InputError, match=r"there is no part or kept sub-assembly 'plat'"):
        plan(model_source(tmp_path, jig()), PlanOptions(lay_out=False, base="plat"))
