"""The coordinated net: what waits in a laid-out factory is proved live, keeps to the compiled net,
predicts what is measured, and is what runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from factory.floor.layout.clearance import certify
from factory.theory.nets.coordinated import Coordination
from tests.examples import with_hands


@pytest.mark.parametrize("name", ["truck"])
def test_an_order_with_its_tokens_exchanged_is_refused(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout = with_hands(name)
    assert certify(layout).holds
    order: Callable[..., None] = Coordination.order

    def exchanged(self: Coordination, place: str, past: Any, start: int, tokens: int) -> None:
        order(self, place, past, start, 0)

    monkeypatch.setattr(Coordination, "order", exchanged)
    fault, *_ = (f for f in certify(layout).faults if "for ever" in f.message)
    assert "order:" in fault.message
