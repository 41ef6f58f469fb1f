"""What is drawn: rounded boxes, and nothing without a GL."""

from __future__ import annotations

import numpy as np
import pytest

from factory.film import painter
from factory.film.skins import rounded
from factory.support.errors import Diagnostic, MissingError


@pytest.mark.parametrize("bevel", [0.001, 0.5])
def test_a_rounded_box_is_as_large_as_the_box(bevel: float) -> None:
    half = np.array([0.3, 0.2, 0.01])
    skin = rounded(*half.tolist(), bevel)
    corners = np.abs(skin.at)
    assert corners.max(axis=0) == pytest.approx(half)
    assert (corners > 0.5 * half - 1e-12).all()


def test_without_a_gl_nothing_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def probe() -> None:
        raise MissingError(Diagnostic("Missing", "no GL", None, "install one"))

    monkeypatch.setattr(painter.gl, "probe", probe)
    with pytest.raises(MissingError):
        painter.Painter(*[None] * 5)  # type: ignore[arg-type]
