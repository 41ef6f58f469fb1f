"""The written form of models that are made for runs."""

from __future__ import annotations

from xml.etree import ElementTree

from factory.apps.exports.stock import write
from factory.engine.mjcf.model import Model


def written(model: Model) -> Model:
    """The written form of a run's model."""
    root = ElementTree.fromstring(model.xml)
    write(model, root)
    return model.with_tree(root)
