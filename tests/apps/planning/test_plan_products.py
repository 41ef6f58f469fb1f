"""Products whose trees are thrown away: what is planned is as good as what was written."""

from __future__ import annotations

import numpy as np
import pytest

from factory.apps.planning.plan import CannotAssemble, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.theory.lang.template_reader import all_templates
from tests.paths import ROOT

LDRAW = ROOT.parent / "shared" / "products" / "ldraw"
TEMPLATES = all_templates()


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
