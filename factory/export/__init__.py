"""Exporters, found by directory: every module here that defines `FORMAT` and `export`."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from types import MappingProxyType

from factory.factory import Factory
from factory.nets.gears import GearNet
from factory.nets.marked import MarkedNet

Exporter = Callable[[Factory | GearNet | MarkedNet], str]


def exporters() -> Mapping[str, Exporter]:
    """What writes a factory's net as text, by the name of the format; sorted by name."""
    modules = (import_module(f"{__name__}.{m.name}") for m in pkgutil.iter_modules(__path__))
    found = {m.FORMAT: m.export for m in modules if hasattr(m, "FORMAT") and hasattr(m, "export")}
    return MappingProxyType(dict(sorted(found.items())))


def net_of(subject: Factory | GearNet | MarkedNet) -> GearNet | MarkedNet:
    """The net of a factory; a net itself."""
    return subject.net if isinstance(subject, Factory) else subject
