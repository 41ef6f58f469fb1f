"""Errors of position and rotation of the parts of a finished product."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from factory.engine.mjcf.model import Model
from factory.engine.simulation.mujoco.fusing import angles
from factory.support.engine import mujoco


@dataclass(frozen=True, slots=True)
class Misfit:
    """Largest displacement of a vertex relative to a first body [m], largest rotation of a body
    against that one [rad], and the `label` of the body with that vertex."""

    vertex: float = 0.0
    angle: float = 0.0
    label: str = ""

    def worse(self, other: Misfit) -> Misfit:
        """The larger figures of two."""
        label = self.label if self.vertex >= other.vertex else other.label
        return Misfit(max(self.vertex, other.vertex), max(self.angle, other.angle), label)


class ProductError:
    """The vertices of a product: the body of each, and its position in the frames of that body and
    of the first."""

    def __init__(self, model: Model, product: str) -> None:
        solids, bodies = model.layout.product.solids, model.carried
        labels = bodies.carried[product]
        corners = [
            np.concatenate([solids[part].corners for part in bodies.parts(body)]) for body in labels
        ]
        self._labels = labels
        self._owner = np.repeat(np.arange(len(labels)), [len(points) for points in corners])
        self._nominal = np.concatenate(corners) - bodies.centre[labels[0]]
        places = np.array([bodies.centre[body] for body in labels])
        self._local = np.concatenate(corners) - places[self._owner]

    def measure(self, d: mujoco.MjData, bodies: np.ndarray) -> Misfit:
        """The largest displacement of any vertex from its place in the product, and the largest
        turn of any body, after a rigid fit on the first body."""
        turn = d.xmat[bodies].reshape(-1, 3, 3)
        turned = np.einsum("nij,nj->ni", turn[self._owner], self._local)
        here = turned + d.xpos[bodies][self._owner]
        fitted = (here - d.xpos[bodies[0]]) @ turn[0]
        off = np.linalg.norm(fitted - self._nominal, axis=1)
        worst = int(off.argmax())
        label = self._labels[int(self._owner[worst])]
        return Misfit(float(off[worst]), float(angles(turn[0].T @ turn).max()), label)


def product_errors(model: Model) -> tuple[ProductError, ...]:
    """The error of the product of each unit of a period: units of one product share it."""
    factory, errors = model.factory, dict[str, ProductError]()
    for written, product in zip(factory.sequence, factory.products, strict=True):
        if written not in errors:
            errors[written] = ProductError(model, product)
    return tuple(errors[written] for written in factory.sequence)
