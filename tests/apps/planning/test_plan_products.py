"""Products whose trees are thrown away: what is planned is as good as what was written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from factory.apps.planning.plan import CannotAssemble, Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product
from factory.engine.timing.timed import pace
from factory.floor.geometry.product import product_geometry
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates, read
from factory.theory.compiler.expanding import expand
from tests.paths import ROOT

EXAMPLES = ROOT / "examples"
LDRAW = ROOT.parent / "shared" / "products" / "ldraw"
TEMPLATES = all_templates()


def planned(file: Path, options: PlanOptions) -> Planned:
    found = plan(read_source(file, TEMPLATES, SourceOptions(replan=True)), options)
    assert isinstance(found, Planned)
    return found


def blocked(file: Path, found: Planned) -> tuple[int, int]:
    """How many operations `check` finds blocked: as written, and as planned."""
    source = read_source(file, TEMPLATES, SourceOptions(replan=True))
    made = planned_product(source, found.tree, found.orientation)
    theirs = matings(expand(made.pag, TEMPLATES), product_geometry(made.pag, made.files))
    written = read(file).matings
    assert written is not None and len(theirs.all) == len(written.all) == found.figures.operations
    return len(written.of_kind("blocked")), len(theirs.of_kind("blocked"))


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("gearbox", "chest", "truck")]


@pytest.mark.parametrize("name", ["chair", *SLOW])
def test_a_planned_example_is_no_slower_than_the_written_one(name: str) -> None:
    written = read(EXAMPLES / f"{name}.pag")
    found = planned(EXAMPLES / f"{name}.pag", PlanOptions(screws=None))
    figures = found.figures
    assert figures.blocked == figures.through == figures.left_out == figures.apart == 0
    assert figures.cycle is not None
    assert figures.cycle <= pace(written.layout, written.settings)[0].seconds
    assert figures.not_held is not None and figures.not_held <= len(written.no_grips)


BRICKS = ["30023-1-Lighthouse", "6966-1-JediStarfighter-Mini"]


@pytest.mark.parametrize(
    "name", [BRICKS[0], *(pytest.param(name, marks=pytest.mark.slow) for name in BRICKS[1:])]
)
def test_bricks_without_their_steps_block_no_operation(name: str) -> None:
    file = LDRAW / f"{name}.pag"
    if not file.exists():
        pytest.skip(f"{file} is missing: the shared products are not here")
    found = planned(file, PlanOptions(lay_out=False))
    steps, mine = blocked(file, found)
    assert mine == found.figures.blocked == 0 <= steps
    assert found.figures.apart == found.figures.left_out == 0


@pytest.mark.slow
def test_wheels_on_slanted_axles_are_named() -> None:
    """Eight round plates on round bricks, at 45 degrees to all axes of the product: along each axis
    they pass 0.31 mm or more of solid."""
    file = LDRAW / "5935-1-IslandHopper.pag"
    if not file.exists():
        pytest.skip(f"{file} is missing: the shared products are not here")
    source = read_source(file, TEMPLATES, SourceOptions(replan=True))
    found = plan(source, PlanOptions(lay_out=False))
    assert isinstance(found, CannotAssemble)
    pairs = {one.labels for one in found.interlocks}
    assert len(pairs) == len(found.interlocks) == len(found.needs) == 8
    assert all(
        round(1e3 * clash.depth, 2) == 0.31 for one in found.interlocks for clash in one.clashes
    )
    for labels, way in found.needs:
        assert labels in pairs and np.allclose(np.abs(way), [0.5**0.5, 0, 0.5**0.5], atol=1e-4)
