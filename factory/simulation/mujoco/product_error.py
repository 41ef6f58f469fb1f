"""How far the parts of a finished product are from their places in it."""

from __future__ import annotations

import numpy as np

from factory.mjcf.model import Model
from factory.support.engine import mujoco


class ProductError:
    """The vertices of a product: which body each is of, and where it belongs, in the frame of its
    own body and in that of the first."""

    def __init__(self, model: Model) -> None:
        solids, bodies = model.layout.product.solids, model.carried
        found = bodies.carried[model.factory.pag.root]
        corners = [
            np.concatenate([solids[part].corners for part in bodies.parts(body)]) for body in found
        ]
        self._owner = np.repeat(np.arange(len(found)), [len(points) for points in corners])
        self._nominal = np.concatenate(corners) - bodies.centre[found[0]]
        places = np.array([bodies.centre[body] for body in found])
        self._local = np.concatenate(corners) - places[self._owner]

    def measure(self, d: mujoco.MjData, bodies: np.ndarray) -> float:
        """The largest displacement [m] of any vertex from its place in the product, after a rigid
        fit on the first body."""
        turn = d.xmat[bodies].reshape(-1, 3, 3)
        turned = np.einsum("nij,nj->ni", turn[self._owner], self._local)
        here = turned + d.xpos[bodies][self._owner]
        fitted = (here - d.xpos[bodies[0]]) @ turn[0]
        return float(np.linalg.norm(fitted - self._nominal, axis=1).max())
