"""How many arms a cell has for a cycle time: one, or two where one is too slow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from factory.api import Diagnostic, InputError, Project, RunError, pace
from factory.apps.arms.cell_arm import CellArm
from factory.apps.arms.crew import RAILS, asked_arms
from factory.apps.arms.ground import CellProject, cell_of
from factory.support.errors import usage_error


def with_few_arms(
    project: Project, asked: str, cycle: float, warn: Callable[[Diagnostic], None]
) -> CellProject:
    """The project of a cell with as few arms as are found for a cycle time, or else the fastest
    found; that the cycle time asked for was not found (SlowCycle) is a warning.

    Args:
        project: of the product.
        asked: the kind of arm, or the path of its MJCF.
        cycle: the cycle time [s].
        warn: is told of a warning.

    Raises InputError (Usage) where `asked` has the number of arms already, BadArm; and where no
    cell has a layout, what is said of the one with one arm.
    """
    name, number, _ = asked.partition("=")
    if number:
        raise usage_error(f"--arm {asked}: with --cycle the number is looked for", f"--arm {name}")
    model, _ = asked_arms(asked)
    product = project.with_ground(replace(project.ground, cycle=None))
    slower, refused = [], None
    for arms in ((CellArm(),), (CellArm(), CellArm())):
        try:
            made = cell_of(product, model, arms)
            takes, _ = pace(made.layout, made.settings)
        except (InputError, RunError) as error:
            refused = refused or error
            continue
        if takes.meets(cycle):
            return made
        slower.append((takes, made))
    if not slower:
        assert refused is not None
        raise refused
    takes, best = min(slower, key=lambda one: one[0].seconds)
    warn(takes.too_slow(cycle, RAILS))
    return best
