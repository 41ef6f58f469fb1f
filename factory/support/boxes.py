"""Boxes in the plane, along its axes or those of a frame."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["Box", "Extent", "Point2", "hull", "moved"]

Box = tuple[float, float, float, float]
"""(xlo, xhi, ylo, yhi) [m]."""

Extent = tuple[float, float, float, float]
"""(ulo, uhi, tlo, thi): a box in a robot's frame, about the product's middle [m]."""

Point2 = tuple[float, float]
"""A point or a vector in the plane of the floor [m]."""


def project(box: Box, u: Point2, t: Point2) -> Extent:
    """A box of the world in the frame (u, t), both along world axes."""
    along = sorted((box[0] * u[0] + box[2] * u[1], box[1] * u[0] + box[3] * u[1]))
    across = sorted((box[0] * t[0] + box[2] * t[1], box[1] * t[0] + box[3] * t[1]))
    return along[0], along[1], across[0], across[1]


def hull(boxes: Sequence[Box]) -> Box:
    """The bounding box of boxes."""
    xlo, xhi, ylo, yhi = zip(*boxes, strict=True)
    return float(min(xlo)), float(max(xhi)), float(min(ylo)), float(max(yhi))


def moved(box: Box, by: Point2) -> Box:
    """A box, moved; its numbers are those of the axes in which `by` is given [m]."""
    return box[0] + by[0], box[1] + by[0], box[2] + by[1], box[3] + by[1]
