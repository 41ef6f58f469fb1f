"""How a planned product stands, and what turns bring its ways along axes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from factory.apps.planning.plan import Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.standing import overhang
from factory.support.errors import InputError
from factory.theory.lang.template_reader import all_templates
from tests.paths import ROOT
from tests.plan_models import box, jig, model_source, socket, tail

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


def test_a_turn_about_the_vertical_is_said_with_its_angle(tmp_path: Path) -> None:
    parts = turned({"socket": socket(), "tail": tail(0, 58)}, 0, 0, 30)
    found = plan(model_source(tmp_path, parts), QUICK)
    assert isinstance(found, Planned)
    assert found.orientation[2] == pytest.approx((0, 0, 1))
    assert "turned by" in found.notes[0] and "30°" in found.notes[0].replace("60°", "30°")
    (join,) = found.operations
    assert np.abs(join.direction) == pytest.approx((0.75**0.5, 0.5, 0), abs=1e-6)


def test_all_others_come_onto_the_base(tmp_path: Path) -> None:
    base = "plate"
    found = plan(model_source(tmp_path, jig()), PlanOptions(lay_out=False, base=base))
    assert isinstance(found, Planned)
    made = [join for join in found.operations if base in (*join.pile, *join.come)]
    assert made and all(base in join.pile for join in made)
    assert all(join.direction[2] > 0 for join in made if join.lowered)
    with pytest.raises(InputError, match=r"there is no part or kept sub-assembly 'plat'"):
        plan(model_source(tmp_path, jig()), PlanOptions(lay_out=False, base="plat"))
