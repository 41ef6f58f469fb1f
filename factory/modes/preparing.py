"""Whether the operations of a factory have modes at all, found when it is compiled.

Of the shipped templates it is known, whatever the layout. One of the user's own is tried on the
first feasible layout: its goal ball, and which robots may hold up which, are measured in metres.
"""

from __future__ import annotations

from collections.abc import Iterable

from factory.compiler.domains import EXAMPLE
from factory.control.laws import hold, law_of
from factory.geometry.solids import Product
from factory.layout.dimensions import Clearance
from factory.layout.optimising import first_feasible
from factory.modes.modes import operation_modes
from factory.plant.factory import Factory
from factory.problem.template import Template
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import Settings


def check_modes(factory: Factory, own: Iterable[Template], product: Product) -> None:
    """Try templates of the user's `own`. Raises InputError: BadTemplate for an F that is no control
    law, NotPrepared where an operation cannot reach its goal."""
    for template in own:
        _check_moves(template)
    settings = Settings()
    layout = first_feasible(factory, product, Clearance(settings.clearance))
    operation_modes(layout, settings.eps)


def _check_moves(template: Template) -> None:
    """What is joined, or changes hands, has to come together."""
    if law_of(template) is hold:
        message = (
            f"{template.name}: F = {template.law.name} moves no robot, so they never come to"
            " their goals"
        )
        raise InputError(Diagnostic("NotPrepared", message, template.law_position, EXAMPLE))
