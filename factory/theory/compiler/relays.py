"""Relays: additional robots on the way of a label, which hand it over to each other."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from factory.theory.compiler.compiler import compile_nodes
from factory.theory.compiler.expanding import Node, delivered, handed_over
from factory.theory.plant.factory import Factory
from factory.theory.problem.robot_types import Catalogue
from factory.theory.problem.template import Template


def with_relays(
    before: Factory,
    numbers: Mapping[str, int],
    templates: Mapping[str, Template],
    catalogue: Catalogue,
) -> Factory:
    """The factory with a given number of additional robots on the way of each label. Linear."""
    plan = replace(before.plan, relays={label: n for label, n in numbers.items() if n})
    nodes = handed_over(Node.of_factory(before), plan.relays, templates)
    approaches = {  # a relay turns nothing
        o.label: replace(o.approach, lowered=delivered(o.approach.lowered, plan))
        for o in before.operations
        if o.approach is not None
    }
    return compile_nodes(before.pag, nodes, templates, catalogue, approaches, plan)
