"""Whether the operations of a factory have modes at all, found when it is compiled.

Of the shipped templates it is known, whatever the layout. One of the user's own is tried on the
first feasible layout: its goal ball, and who may hold up whom, are measured in metres.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from factory.assets import templates_folder
from factory.control.laws import hold, law_of
from factory.control.plan import operation_modes
from factory.errors import Diagnostic, InputError
from factory.factory import Factory
from factory.geometry import Product
from factory.layout.dimensions import Clearance
from factory.layout.optimising import first_feasible
from factory.settings import Settings
from factory.template import Template


def check_modes(factory: Factory, product: Callable[[], Product]) -> None:
    """`product`: gives its solids, asked for where a layout is needed.

    Raises InputError: BadTemplate for an F that is no control law, NotPrepared where an operation
    of a user's own template cannot reach its goal."""
    used = {id(o.template): o.template for o in factory.operations}
    own = [template for template in used.values() if not _is_shipped(template)]
    for template in own:
        _check_moves(template)
    if own:
        settings = Settings()
        layout = first_feasible(factory, product(), Clearance(settings.clearance))
        operation_modes(layout, settings.eps)


def _is_shipped(template: Template) -> bool:
    return template.position is not None and (
        Path(template.position.file).parent == templates_folder()
    )


def _check_moves(template: Template) -> None:
    """What is joined, or changes hands, has to come together."""
    if law_of(template) is hold:
        message = (
            f"{template.name}: F = {template.law.name} moves nobody, so its robots never come to"
            " their goals"
        )
        position = template.law.position or template.position
        hint = "mate, for comparison: F = navigation on W to ( A1 + 2r, A2 + 2r, B3 ) within eps"
        raise InputError(Diagnostic("NotPrepared", message, position, hint))
