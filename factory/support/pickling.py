"""Pickling of values with locked mappings, which go to other processes."""

from __future__ import annotations

import copyreg
from types import MappingProxyType


def _locked(contents: dict[object, object]) -> MappingProxyType[object, object]:
    return MappingProxyType(contents)


def pickle_locked_mappings() -> None:
    """Teach pickle to copy locked mappings."""
    copyreg.pickle(MappingProxyType, lambda proxy: (_locked, (dict(proxy),)))
