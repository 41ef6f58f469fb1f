"""Stages that tests share: computed once, but by a test that plants a fault."""

from __future__ import annotations

import pytest

from factory.floor.layout import clearance
from factory.pipeline import read
from tests.paths import PAPER


def test_a_stage_is_computed_once_and_anew_under_a_planted_fault(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shared = read(PAPER).layout
    monkeypatch.setenv("FACTORY_SEED", "1")
    assert read(PAPER).layout is shared
    monkeypatch.setattr(clearance, "certify", clearance.certify)
    own = read(PAPER).layout
    assert own is not shared and own.guidepaths == shared.guidepaths
