"""Repair of meshes that bound no volume: small gaps are closed, and triangles are oriented
outwards. Meshes of a solid's faces are zipped where these divide a common edge differently."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from factory.support.arrays import Array, Indices
from factory.support.meshes.triangles import areas_of, components, is_closed

__all__ = ["SLIVERS"]

if TYPE_CHECKING:
    import trimesh

GAP = 1e-5
"""In an open mesh, vertices closer than about this share of the longest edge are merged."""

HOLES, SLIVERS = 0.05, 0.001
"""Holes with three or four corners are filled if that adds no more than the first share of the
surface, others if it adds no more than the second: the rim of a large hole says little about its
interior."""

HOLLOW = 1e-6
"""A mesh bounds no intended volume, like a sheet with two sides or bodies that cancel each other,
if its volume divided by its surface is less than this share of its size. A wire is not that
thin."""

FILLED = "had slivers or small holes"


def mended(vertices: Array, faces: Indices) -> tuple[Array, Indices, str]:
    """A mesh that bounds a volume, and the defect of the given one. The defect is "", and the mesh
    the given one, if nothing was wrong, or if it cannot be repaired. The box of the mesh does not
    change."""
    mesh = _body(vertices, faces)
    turned = _outwards(mesh)
    if turned is not None:
        return vertices, turned, "was inside out" if (turned != faces).any() else ""
    for step, was in (
        (_weld, "had cracks"),
        (lambda body: body.update_faces(body.unique_faces()), "had duplicate triangles"),
        (_fill, FILLED),
        (_wind, "had triangles of inconsistent orientation"),
    ):
        step(mesh)
        turned = _outwards(mesh)
        if turned is not None:
            is_filled = len(turned) > len(faces)
            return np.asarray(mesh.vertices), turned, FILLED if is_filled else was
    return vertices, faces, ""


def _body(vertices: Array, faces: Indices) -> trimesh.Trimesh:
    import trimesh

    return trimesh.Trimesh(vertices.copy(), faces.copy(), process=False)


def _weld(mesh: trimesh.Trimesh) -> None:
    """Merge vertices that are next to each other."""
    step = GAP * float(np.ptp(mesh.vertices, axis=0).max())
    mesh.merge_vertices(digits_vertex=int(np.ceil(-np.log10(step))))
    faces = np.asarray(mesh.faces)
    mesh.update_faces((faces != np.roll(faces, 1, axis=1)).all(axis=1))


def _fill(mesh: trimesh.Trimesh) -> None:
    """Close small holes. They are found in a mesh of the same triangles with random vertices,
    because trimesh adds no flat triangles, and flat ones close a side that has one vertex more than
    its neighbour."""
    from trimesh import repair

    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    for use_fan, most in ((False, HOLES), (True, SLIVERS)):
        anywhere = _body(np.random.default_rng(0).random(vertices.shape), faces)
        repair.fill_holes(anywhere, use_fan=use_fan)
        filled = _body(vertices, np.asarray(anywhere.faces))
        if len(filled.faces) > len(faces) and filled.area <= (1 + most) * mesh.area:
            mesh.faces = filled.faces
            return


def _wind(mesh: trimesh.Trimesh) -> None:
    """Make the orientation of triangles consistent."""
    from trimesh import repair

    if mesh.is_watertight:
        repair.fix_winding(mesh)


def _outwards(mesh: trimesh.Trimesh) -> Indices | None:
    """The faces of a closed mesh, reoriented where a body is inside out; None if it is open, or
    bounds too little. A body inside the box of another may be a cavity: it is reoriented only with
    that body."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if not is_closed(faces):
        return None
    number, corners = components(len(vertices), faces), vertices[faces] - vertices.mean(axis=0)
    cones = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    volume = np.bincount(number, cones)
    turned = np.full(len(volume), volume.sum() < 0)
    if (np.where(turned, -volume, volume) < 0).any():
        low, high = np.full((len(volume), 3), np.inf), np.full((len(volume), 3), -np.inf)
        np.minimum.at(low, number, corners.min(axis=1))
        np.maximum.at(high, number, corners.max(axis=1))
        for body in np.flatnonzero(np.where(turned, -volume, volume) < 0):
            if not ((low < low[body]) & (high > high[body])).all(axis=1).any():
                with_it = ((low >= low[body]) & (high <= high[body])).all(axis=1)
                turned[with_it] = ~turned[with_it]
    whole, box = np.where(turned, -volume, volume).sum(), np.prod(np.ptp(vertices, axis=0))
    thinnest = HOLLOW * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if not thinnest * areas_of(vertices, faces).sum() < whole <= (1 + 1e-9) * box:
        return None
    return np.where(turned[number, None], faces[:, ::-1], faces)
