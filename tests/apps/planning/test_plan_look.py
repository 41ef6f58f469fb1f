"""The exploded view of a planned product, as a still and as a film."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from factory.apps.planning.loose_parts import loose_parts


def test_a_light_stands_as_far_off_as_the_product_is_large() -> None:
    box = trimesh.creation.box((0.1, 0.1, 0.1))
    surfaces = {"a": (np.array(box.vertices), np.array(box.faces))}
    for size in (0.1, 2.0):
        m = loose_parts(surfaces, [(1.0, 0.0, 0.0, 1.0)], 0.0, size)
        assert m.light_pos == pytest.approx(-3.0 * size * m.light_dir, rel=0.01)
