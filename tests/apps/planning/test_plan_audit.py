"""An audit of whole plans: along every approach that `check` finds in a planned product, what comes
cuts nothing out of what stands, by snapshots of the volumes that their meshes bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from factory.apps.planning.plan import CannotAssemble, Planned, PlanOptions, plan
from factory.apps.planning.source import SourceOptions, read_source
from factory.apps.planning.writing import planned_product
from factory.floor.geometry.overlap import drawn
from factory.floor.geometry.product import product_geometry
from factory.floor.geometry.solids import Product
from factory.floor.mating.findings import Mating
from factory.floor.mating.mating import matings
from factory.pipeline import all_templates
from factory.theory.compiler.expanding import expand
from factory.theory.problem.pag import PAG
from tests.paths import ROOT

CASES = ROOT.parent / "shared" / "cases"
TEMPLATES = all_templates()
STEPS = 100
LEAST = 1e-12
"""A thousandth of a cubic millimetre [m³]."""

QUICK = ["jig", "fit", "dado", "peg_0.8mm_too_thick", "wall10.glb"]
EXAMPLES = [
    pytest.param(f"{name}.pag", marks=pytest.mark.slow)
    for name in ("chair", "gearbox", "chest", "truck")
]


@pytest.fixture(autouse=True)
def no_decomposition(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ways are the same without CoACD, which takes most of the time."""
    monkeypatch.setattr("factory.floor.geometry.decomposition.release", lambda package: "")


@pytest.mark.parametrize("name", [*QUICK, *EXAMPLES])
def test_no_way_of_a_plan_leads_through_solid(name: str) -> None:
    file = (ROOT / "examples" if name.endswith(".pag") else CASES) / name
    if not file.exists():
        pytest.skip(f"{file} is missing: the shared cases are not here")
    options = SourceOptions(replan=name.endswith(".pag"))
    source = read_source(file, TEMPLATES, options)
    found = plan(source, PlanOptions(seconds=10.0, lay_out=False))
    assert isinstance(found, Planned)
    made = planned_product(source, found.tree, found.orientation)
    product = product_geometry(made.pag, made.files)
    judged = matings(expand(made.pag, TEMPLATES), product)
    assert len(judged.all) == len(source.units()) - 1 and not judged.of_kind("blocked")
    bodies = {label: drawn(solid) for label, solid in product.solids.items()}
    for mating in judged.all:
        for way in ways(mating):
            cut, finished = cuts(mating, made.pag, product, bodies, way)
            assert cut <= finished + LEAST, (mating.label, way)


def test_a_snap_fit_is_refused_with_its_clash() -> None:
    if not CASES.exists():
        pytest.skip(f"{CASES} is missing: the shared cases are not here")
    found = plan(read_source(CASES / "snap", TEMPLATES), PlanOptions(lay_out=False))
    assert isinstance(found, CannotAssemble)
    (clash,) = found.interlocks[0].clashes
    assert {clash.one, clash.other} == {"base", "cover"} and clash.depth > 5e-4


def ways(mating: Mating) -> Iterator[np.ndarray]:
    """The directions (3,) in which the last input leaves."""
    approach = mating.approach
    if approach.kind == "lower":
        yield np.array([0.0, 0.0, 1.0 if approach.lowered == mating.inputs[-1] else -1.0])
    else:
        yield from (side * np.eye(3)[approach.axis] for side in approach.sides)


def cuts(
    mating: Mating, pag: PAG, product: Product, bodies: dict[str, Manifold], way: np.ndarray
) -> tuple[float, float]:
    """The greatest volume [m³] that the last input has in common with the others on its way, and
    that in the finished product."""
    first, last = (below(pag, label) for label in (mating.inputs[0], mating.inputs[-1]))
    come = Manifold.batch_boolean([bodies[label] for label in last], OpType.Add)
    pile = Manifold.batch_boolean([bodies[label] for label in first], OpType.Add)
    far = 1.05 * float((product.high - product.low).max())
    volumes = [(come.translate(tuple(far * n / STEPS * way)) ^ pile).volume() for n in range(STEPS)]
    return max(volumes), volumes[0]


def below(pag: PAG, label: str) -> list[str]:
    """The parts of an input: those of `x/2`, a pile, are those of the first inputs of x."""
    name, _, number = label.partition("/")
    if label not in pag.by_label and number:
        return [p for child in pag[name].inputs[: int(number)] for p in below(pag, child)]
    return [node.label for node in PAG(label, pag.nodes).postorder() if not node.inputs]
