"""Types of arrays, for annotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Index", "Indices", "Truth"]

Array = NDArray[np.float64]
"""An array of floating-point numbers."""

Index = NDArray[np.intp]
"""An array of positions in another array."""

Indices = NDArray[np.int64]
"""An array of whole numbers, such as the corners of a mesh's triangles (m, 3)."""

Truth = NDArray[np.bool_]
"""An array of truth values."""
