"""Values whose mappings are locked go to other processes, which pickle does not do by itself."""

from __future__ import annotations

import copyreg
from types import MappingProxyType


def _locked(contents: dict[object, object]) -> MappingProxyType[object, object]:
    return MappingProxyType(contents)


def pickle_locked_mappings() -> None:
    """From now on pickle takes a locked mapping, as a copy."""
    copyreg.pickle(MappingProxyType, lambda proxy: (_locked, (dict(proxy),)))
