"""Approaches for a factory that was compiled without any: its robots have no lifts, so all inputs
slide, or are blocked."""

from __future__ import annotations

from dataclasses import replace

from factory.compiler.mating.mating import matings
from factory.geometry.solids import Product
from factory.plant.factory import Factory


def judged(factory: Factory, product: Product) -> Factory:
    """The factory with an approach for every operation that has inputs to join."""
    if all(o.approach is not None for o in factory.operations if len(o.inputs) > 1):
        return factory
    templates = {o.template.name: o.template for o in factory.operations}
    found = matings(factory.pag, templates, product, lifts=False).approaches
    operations = tuple(
        replace(o, approach=o.approach or found.get(o.label)) for o in factory.operations
    )
    return replace(factory, operations=operations)
