"""Bodies that hold the geoms of one part in the body that a sub-assembly has become.

The engine leaves pairs of bodies out of contact, not pairs of geoms. So a part that overlaps
another too deep has a body of its own in what it is fused into, fixed and without mass, and is left
out alone.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from factory.mjcf import names


def trunks(m: Any) -> NDArray[np.intp]:
    """For each body of an engine's model (nbody,) the body that it is a shell of; else itself."""
    trunk = np.arange(m.nbody)
    shells = [b for b in range(m.nbody) if names.kind(m.body(b).name) == names.SHELL]
    trunk[shells] = m.body_parentid[shells]
    return trunk
