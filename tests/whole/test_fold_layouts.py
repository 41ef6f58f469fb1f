"""Layouts of folded factories: each is certified, and a robot never comes back under its feeder."""

from __future__ import annotations

import pytest

from factory.support.settings import Settings
from tests.fold_values import fold_layout


@pytest.mark.parametrize("seed", [179])
def test_folds_are_laid_out(seed: int) -> None:
    """Seed 139: a pile overlapped the housing as it came back to its tool."""
    assert fold_layout(seed, Settings()).certificate is not None
