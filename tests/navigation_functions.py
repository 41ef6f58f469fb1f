"""phi and its gradient, from the terms that the field is made of (see `control/navigation.py`)."""

from __future__ import annotations

import numpy as np

from factory.support.arrays import Array
from factory.theory.control.navigation import KAPPA, Bundle


def potential(bundle: Bundle, x: Array) -> Array:
    """phi (modes,) in [0, 1]: 0 at the goal, 1 on Δ."""
    terms = bundle._terms(x)
    gamma = terms.way / bundle.span
    return np.asarray(gamma / (gamma**KAPPA + terms.beta) ** (1 / KAPPA))


def gradient(bundle: Bundle, x: Array) -> Array:
    """D phi (n,) [1/m], each robot's by its own mode's phi."""
    terms = bundle._terms(x)
    gamma = terms.way / bundle.span
    outer = (gamma**KAPPA + terms.beta) ** (-1 / KAPPA - 1)
    rise = (terms.pull + terms.opening) * (terms.beta / bundle.span)[bundle.owner]
    return np.asarray((rise - terms.push * (gamma / KAPPA)[bundle.owner]) * outer[bundle.owner])
