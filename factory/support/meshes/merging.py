"""Vertices of a mesh that are in one place, made one."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array, Indices

__all__: list[str] = []

STEPS = 1e8
"""Vertices are in one place if they are so on a grid of so many steps a unit."""

ODD = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
"""Factors that make one number of three."""


@np.errstate(all="ignore")
def merged_vertices(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """A mesh whose vertices are used, each once, in the order in which they first come."""
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    cells = (vertices[used] * STEPS).round().astype(np.int64)
    first, number = _distinct(cells)
    everywhere = np.zeros(len(vertices), np.int64)
    everywhere[used] = number
    return vertices[used][first], everywhere[faces]


def _distinct(cells: Indices) -> tuple[Indices, Indices]:
    """The first row of each value of cells (n, 3), in their order, and the number of the value of
    each row."""
    one, two, three = cells.view(np.uint64).T
    key = one * ODD[0] + two * ODD[1] + three * ODD[2]
    _, first, number = np.unique(key, return_index=True, return_inverse=True)
    if not np.array_equal(cells[first[number]], cells):  # two values have one key
        _, first, number = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[number.reshape(-1)]
