"""The solids of a product whose units have labels of their own."""

from __future__ import annotations

from dataclasses import replace

from factory.geometry.solids import Product
from factory.plant.factory import Factory


def repeated(product: Product, factory: Factory) -> Product:
    """A product with a solid for each part of a factory: those for further units of a period are
    alike. The product itself where one unit is made at a time."""
    if factory.period == 1:
        return product
    further = {
        leaf.label: replace(product.solids[leaf.written], label=leaf.label)
        for leaf in factory.leaves
        if leaf.label not in product.solids
    }
    return replace(product, solids={**product.solids, **further})
