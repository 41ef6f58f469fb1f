"""Which robot does which tour: every variant of a factory is as it was, kept as digests."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import pytest

from factory.apps.few_robots.folding import fold
from factory.apps.few_robots.lines import Shift
from factory.apps.few_robots.parallel import in_parallel
from factory.floor.layout.durations import Pace
from factory.floor.layout.shapes import payload_boxes
from factory.floor.mating.mating import judged
from factory.pipeline import read
from factory.support.errors import InputError
from factory.theory.compiler.assigning import shared
from factory.theory.compiler.tees import on_stems
from factory.theory.plant.factory import Factory

PRODUCTS = ("truck", "lamp", "stool", "shelf")
LONG = ("chair", "gearbox", "chest")
FILLINGS = 12
"""So many ways to fill lines are looked at."""


def digest(factory: Factory) -> str:
    """A digest of all that is compiled: operations, programs, net, parents, period."""
    robots = [(r.name, r.type, r.operations) for r in factory.robots]
    operations = [
        (o.label, o.template.name, o.robots, o.before, o.after, o.dwell, o.turn)
        for o in factory.operations
    ]
    net = factory.net
    places = [(p.left, p.right, p.name, p.mode, p.label) for p in net.threaded.net.places]
    gears = [(g.robot, g.type, g.places, g.transitions) for g in net.gears]
    kept = robots, operations, places, gears, factory.parents, factory.period, net.initial
    return hashlib.sha256(repr(kept).encode()).hexdigest()[:16]


def variants(file: Path) -> Iterator[tuple[str, Factory]]:
    """The variants of a product's factory, by name."""
    project = read(file)
    base, catalogue = judged(project.compiled, project.product), project.catalogue
    yield "as written", base
    shift = Shift.of(base, catalogue, payload_boxes(base, project.product), Pace())
    every = dict.fromkeys(map(shift.lines, islice(shift.fillings(1.3), 60)))
    plans = [fold(base, lines, catalogue) for lines in islice(filter(None, every), FILLINGS)]
    folds = [shared(base, plan, catalogue) for plan in plans]
    for number, folded in enumerate(folds):
        yield f"fold {number}", folded
    for name, factory in (("written", base), *((f"fold {n}", f) for n, f in enumerate(folds[-2:]))):
        for robot in factory.robots[1:]:
            for label in factory.deliveries(robot.index)[:1]:
                for k in (2, 3):
                    try:
                        made = shared(base, in_parallel(factory, [(label, k)]), catalogue)
                    except InputError:
                        continue
                    if on_stems(made)[0] is not made:  # tees have tests of their own
                        continue
                    yield f"{name}, {label} = {k}", made


@pytest.mark.parametrize(
    "product", [*PRODUCTS, *(pytest.param(name, marks=pytest.mark.slow) for name in LONG)]
)
def test_every_variant_is_as_it_was(product: str, golden: Callable[[str, str], None]) -> None:
    lines = [f"{digest(made)} {name}" for name, made in variants(Path(f"examples/{product}.pag"))]
    golden(f"assignments/{product}.txt", "\n".join(lines) + "\n")
