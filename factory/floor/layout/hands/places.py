"""Places of a sub-assembly's surface where a pad fits, and how well it holds there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from math import floor, log10, pi

import numpy as np

from factory.floor.geometry.solids import Product
from factory.floor.layout.hands.hand import Point3
from factory.floor.layout.hands.kinds import HandKind
from factory.floor.layout.hands.outermost import outermost
from factory.floor.layout.hands.surfaces import Surfaces
from factory.floor.layout.hands.tips import Tip, shares, tip
from factory.support.arrays import Array, Index, Truth

RADII = (0.02, 0.014, 0.01, 0.007, 0.005, 0.0035, 0.0025, 0.0016, 0.001)
"""Radii of pads [m]."""

SMALL, FINE = 0.008, 0.0006
"""What is no wider than the first, a fastener, is looked at more closely, and with pads of the
second radius too [m]."""

GRID = 7
"""So many places are tried along either side of a body's box."""

BODIES = 24
"""So many bodies of a sub-assembly are looked at, those nearest to its centre of mass."""

TRIED, NEAR = 24, 60
"""So many places are measured: of the outermost, and of those near the centre of mass."""

LINES = 12
"""So many lines under a sub-assembly are tried in either direction."""

BELLOWS = 0.25
"""A pad's bellows reach back by this share of its radius: it holds on round shapes too."""

GRAVITY, PUSH = 9.81, 2.0
"""What a payload's mass is pulled and pushed by [m/s²]: its weight, and robots' acceleration where
nothing else is asked for."""

SURGE = 1.08
"""A robot's acceleration is up to so many times that of its reference: its drive falls behind as
that begins, and makes up for it. Measured: 1.02 to 1.075 in 54 random factories, jitter 0.3."""

PUSHES = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
"""Where to it is pushed."""

EASY = 0.25
"""Of the pads that fit, the smallest is taken of whose strength no more than this is used."""

LEAST = 0.0035
"""But none smaller than this where a larger one fits [m]."""

PARTLY = 0.6
"""A pad that is not all covered is so at least to this share, but for the smallest."""

UP = np.array([0.0, 0.0, 1.0])
"""From a tip below to its payload."""

RASTER, WIDE = 0.01, 9
"""Between lines on which all products of a mix are held [m], and how many of them over a body."""

SAME = 1e-9
"""Radii that differ by no more are one [m]."""

RAYS = 6
"""In so many directions from its middle it is looked at what a pad covers."""

ASKED = 1e-4
"""A place is one that is asked for within this distance [m]."""

SMALLER = (2, 4, 6, 8)
"""Where there is little room, these of the RADII are tried too."""


@dataclass(frozen=True, eq=False)
class Places:
    """Places (n, 3) on one side of a sub-assembly's surface, the best first, each with the largest
    pad that is of use there: `radius` (n,) [m], the `share` (n,) of its strength that is used, by
    suction and if it is `pinned`, and which share of it the surface covers (n,)."""

    at: Array
    radius: Array
    share: Array
    pinned: Array
    covered: Array

    @classmethod
    def nowhere(cls) -> Places:
        """No place."""
        empty = np.zeros(0)
        return cls(np.zeros((0, 3)), empty, empty, empty, empty)

    def chosen(self, which: Index | Truth) -> Places:
        """A selection of places."""
        every = self.at, self.radius, self.share, self.pinned, self.covered
        return Places(*(values[which] for values in every))

    def __len__(self) -> int:
        return len(self.at)


@dataclass(frozen=True)
class Loads:
    """All that a hand ever holds, n sub-assemblies of parts, `held`; the acceleration by which each
    is pushed to any side, `push` [m/s²]; `mass` (n,) [kg] and `centre` (n, 3) of mass [m]."""

    held: tuple[tuple[str, ...], ...]
    push: float
    mass: Array = field(compare=False)
    centre: Array = field(compare=False)

    @classmethod
    def of(cls, product: Product, held: tuple[tuple[str, ...], ...], push: float) -> Loads:
        """The loads of sub-assemblies of such parts."""
        masses, centres = zip(*(centre_of(product, parts) for parts in held), strict=True)
        return cls(held, push, np.array(masses), np.array(centres))

    def about(self, at: Array) -> tuple[Array, Array]:
        """Force (3, 1, m) [N] and moment (3, n, m) [Nm] about places `at` (n, 3) of each load, at
        rest and under acceleration to any side."""
        fx, fy, fz = force = self._pulled
        x, y, z = (self.centre - at[:, None]).T.swapaxes(1, 2)[..., None]
        moment = np.stack([y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
        return force.reshape(3, 1, -1), moment.reshape(3, len(at), fx.size)

    @cached_property
    def _pulled(self) -> Array:
        """What each load is pulled and pushed by (3, n, 7) [N]."""
        pulls = np.array([0.0, 0.0, -GRAVITY]) + SURGE * self.push * PUSHES
        return np.asarray(pulls.T[:, None] * self.mass[:, None])


def centre_of(product: Product, parts: Sequence[str]) -> tuple[float, Array]:
    """Mass [kg] and centre of mass (3,) of some parts."""
    masses = np.array([product.solids[part].mass for part in parts])
    centres = np.array([product.solids[part].centre for part in parts])
    return float(masses.sum()), np.asarray(masses @ centres / masses.sum())


def places(
    product: Product,
    parts: tuple[str, ...],
    side: tuple[int, int],
    kind: HandKind,
    loads: Loads,
    on_raster: bool = False,
    wanted: Sequence[Point3] = (),
) -> Places:
    """Places on the side of a sub-assembly that faces a direction, an axis and a way (+1, -1) along
    it, where nothing of it is further out; `loads`: what is held there; `on_raster`: with places
    on lines that other sub-assemblies have too; `wanted`: points [m] that are tried as well."""
    axis, way = side
    surfaces = product.kept(Surfaces)
    _, centre = centre_of(product, parts)
    across = [a for a in range(3) if a != axis]
    low, high = np.moveaxis(surfaces.boxes(parts), 1, 0)
    points = _tried(low, high, centre, side)
    if kind.rises:
        points = np.concatenate([points, _lines(low, high, centre)])
    if on_raster:
        points = np.concatenate([points, _raster(low, high, product.middle, across)])
    asked = np.array(wanted, float).reshape(-1, 3)
    small = float((high.max(axis=0) - low.min(axis=0))[across].min()) <= SMALL
    radii, smaller = (*RADII, *[FINE] * small), (*SMALLER, *[len(RADII)] * small)
    points = _rounded(points, float((high - low)[:, across].min()), product.middle, asked)
    out = surfaces.outermost(parts, points, side)
    points, out = points[np.isfinite(out)], out[np.isfinite(out)]
    if not len(points):
        return Places.nowhere()
    points[:, axis] = way * out
    away = np.linalg.norm((points - centre)[:, across], axis=1)
    # the outermost, of which nothing is in the way, and those near the centre of mass
    first = np.lexsort((away, np.round(-out, 3)))[:TRIED]
    nearest = np.argsort(away)[: len(points) if small else NEAR]
    beside = np.abs(points[:, None, across] - asked[:, across]).max(axis=2)
    kept = beside.min(axis=1, initial=np.inf) < ASKED
    kept[first] = kept[nearest] = True
    points = points[kept]
    sizes, load = np.array(radii), loads.about(points)
    used = strain(tip("suction"), side, sizes[:, None], load)
    useful = [n for n, radius in enumerate(radii) if radius <= LEAST or used[n].max() > EASY]
    largest = max(0, useful[0] - 1)  # larger pads are of no more use
    covered, plane = _covered(surfaces, parts, points, (axis, way), radii[largest:])
    blank = np.zeros((largest, len(points)))
    covered, plane = np.concatenate([blank, covered]), np.concatenate([blank, plane])
    best, share = np.full(len(points), -1), np.full(len(points), np.inf)
    for number in range(largest, len(radii)):
        better = (covered[number] == 1.0) & (
            (share > EASY) & (used[number] < share)
            | (used[number] <= EASY) & (radii[number] >= LEAST)
        )
        best[better], share[better] = number, used[number][better]
    # smaller pads have room where large ones do not, and one that is not all covered holds less
    pads = [((best >= 0).nonzero()[0], best[best >= 0])]
    for number in smaller:
        least = PARTLY if number < SMALLER[-1] else 0.0
        chosen = ((covered[number] > least) & (number > best)).nonzero()[0]
        pads.append((chosen, np.full(len(chosen), number)))
    point, size = (np.concatenate(numbers) for numbers in zip(*pads, strict=True))
    at, radius, covers = points[point], sizes[size], covered[size, point]
    at[:, axis] = plane[size, point]
    load = loads.about(at)
    share = strain(tip("suction"), side, radius, load) / covers
    pinned = strain(tip("pin"), side, radius, load)
    result = Places(at, radius, share, pinned, covers)
    return result.chosen(np.argsort(np.round(result.share, 2), kind="stable"))


def resized(
    product: Product,
    parts: tuple[str, ...],
    side: tuple[int, int],
    loads: Loads,
    candidates: Places,
    radius: float,
) -> Places:
    """The `candidates` with a pad no smaller at which one of a `radius` [m] fits, each once, with
    such a pad; loads and side as for `places`."""
    surfaces = product.kept(Surfaces)
    points = np.unique(candidates.at[candidates.radius >= radius - SAME], axis=0)
    if not len(points):
        return candidates.chosen(np.zeros(0, np.intp))
    covered, plane = _covered(surfaces, parts, points, side, (radius,))
    fits = covered[0] > (PARTLY if radius > RADII[-1] else 0.0)
    at, covers = points[fits], covered[0][fits]
    at[:, side[0]] = plane[0][fits]
    sizes, load = np.full(len(at), radius), loads.about(at)
    share = strain(tip("suction"), side, sizes, load) / covers
    return Places(at, sizes, share, strain(tip("pin"), side, sizes, load), covers)


def _tried(low: Array, high: Array, centre: Array, side: tuple[int, int]) -> Array:
    """Points (n, 3) of lines to be tried: a grid over the outermost bodies and those near the
    centre of mass, with boxes from `low` to `high` (b, 3), and the centre itself."""
    axis, way = side
    across = [a for a in range(3) if a != axis]
    outer = (-way * (high if way > 0 else low)[:, axis]).tolist()
    away = (np.clip(centre, low, high) - centre)[:, across]
    near = np.sqrt(np.vecdot(away, away)).tolist()
    ranked = sorted(range(len(low)), key=lambda n: (round(outer[n], 4), near[n]))
    chosen = {*ranked[:BODIES], *sorted(range(len(low)), key=near.__getitem__)[: BODIES // 2]}
    begin, end = (ends[sorted(chosen)][:, across] for ends in (low, high))
    shares = (np.arange(GRID) + 0.5) / GRID
    ticks = begin[:, None] + (end - begin)[:, None] * shares[:, None]
    grid = np.empty((len(begin), GRID, GRID, 2))
    grid[..., 0], grid[..., 1] = ticks[:, None, :, 0], ticks[:, :, None, 1]
    points = np.zeros((len(begin) * (GRID**2 + 1) + 1, 3))
    points[0] = centre
    points[1:, across] = np.concatenate([grid.reshape(-1, 2), np.clip(centre[across], begin, end)])
    return points


def _raster(low: Array, high: Array, middle: Array, across: Sequence[int]) -> Array:
    """Points (n, 3) over each body, of boxes from `low` to `high` (b, 3), on lines at multiples of
    RASTER from the product's middle: the WIDE nearest to the middle of the body."""
    rasters = [np.zeros((0, 3))]
    for least, most in zip(low - middle, high - middle, strict=True):
        for line, along in (across, across[::-1]):
            at = RASTER * np.arange(np.ceil(least[line] / RASTER), most[line] / RASTER)
            order = np.argsort(np.abs(at - (least[line] + most[line]) / 2), kind="stable")
            at, share = at[order][:WIDE], (np.arange(3) + 0.5) / 3
            points = np.zeros((3 * len(at), 3))
            points[:, line] = np.repeat(at, 3)
            points[:, along] = np.tile(least[along] + share * (most[along] - least[along]), len(at))
            rasters.append(points + middle)
    return np.concatenate(rasters)


def _lines(low: Array, high: Array, centre: Array) -> Array:
    """Points (n, 3) under a sub-assembly, several on each line along x or y: near the centre of
    mass, and where lines cross bodies, with boxes from `low` to `high` (b, 3)."""
    points_on, middle = [centre[None]], (low + high) / 2
    for along, across in ((0, 1), (1, 0)):
        tried = np.unique(np.round([centre[across], *middle[:, across]], 3))
        for line in tried[np.argsort(abs(tried - centre[across]))][:LINES]:
            crossed = np.flatnonzero((low[:, across] < line) & (high[:, across] > line))
            nearest = np.argsort(abs(middle[crossed, along] - centre[along]))
            body = crossed[nearest[: 2 * LINES], None]
            begin, end = low[body, along], high[body, along]
            inner = np.clip(centre[along], begin, end)
            at = np.concatenate([np.arange(1, 6) * ((end - begin) / 6) + begin, inner], axis=1)
            points = np.zeros((at.size, 3))
            points[:, along], points[:, across] = at.ravel(), line
            points_on.append(points)
    return np.concatenate(points_on)


def _rounded(points: Array, least: float, middle: Array, asked: Array) -> Array:
    """Points (n, 3) in whole millimetres from the product's middle, in tenths if the `least` width
    of a body is small, or in what it has room for, and those `asked` for as they are; unique."""
    step = 1e-3 if least > 8e-3 else min(1e-4, 10.0 ** floor(log10(least / 2)))
    every = np.concatenate([points, asked])
    rounded = middle + np.round((every - middle) / step) * step
    other = np.abs(rounded - every) > 1e-6
    other[: len(points)] = False
    rounded[other] = every[other]
    ordered = rounded[np.lexsort(rounded.T[::-1])]
    new = (ordered[1:] != ordered[:-1]).any(axis=1)
    return np.asarray(ordered[np.append(True, new)])


def _covered(
    surfaces: Surfaces,
    parts: Sequence[str],
    points: Array,
    side: tuple[int, int],
    radii: Sequence[float],
) -> tuple[Array, Array]:
    """On a side, an axis and a way along it, for each pad and point (radii, n): the share of the
    pad over which its bellows reach the surface, and the position of its face along the axis, on
    what stands out most under it [m]."""
    (_, way), sizes, (rims, which) = side, np.array(radii), _rims(side[0], tuple(radii))
    out = surfaces.outermost(parts, (rims[:, None] + points).reshape(-1, 3), side)
    out = out.reshape(len(rims), -1)[which].reshape(2 * RAYS + 1, len(sizes), -1)
    bodies = [body for part in parts for body in surfaces.bodies[part]]
    discs = np.tile(points, (len(sizes), 1)), np.repeat(sizes, len(points))
    most = outermost(bodies, *discs, side, out.max(axis=0).ravel()).reshape(out.shape[1:])
    reached = most - out <= BELLOWS * sizes[:, None]
    return np.count_nonzero(reached, axis=0) / len(reached), way * most


@cache
def _rims(axis: int, radii: tuple[float, ...]) -> tuple[Array, Index]:
    """Where in pads across an axis it is looked at what these cover (m, 3) [m]: on their rims,
    half-way there, and in their common middle; and which of it is each place in each (13 n,)."""
    turns, ring = np.arange(RAYS) * 2 * pi / RAYS, np.zeros((2 * RAYS + 1, 3))
    rim = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    ring[:-1, [a for a in range(3) if a != axis]] = np.concatenate([rim, rim / 2])
    every = (np.array(radii)[:, None] * ring[:, None]).reshape(-1, 3)
    return np.unique(every, axis=0, return_inverse=True)


def strain(tip: Tip, side: tuple[int, int], radius: Array, load: tuple[Array, Array]) -> Array:
    """The largest share (..., n) of the strength of a tip with a `radius` (..., n) on a side that
    any of some loads uses; `load`: as `Loads.about` the middles of the tips."""
    shares = tip.alone(side, radius[..., None], *load)
    return np.asarray(np.maximum(shares.max(axis=-1), 0.0))


def strain_of_two(tip: Tip, radius: Array, apart: Array, load: tuple[Array, Array]) -> Array:
    """The same (n,) of two tips below, `apart` (n, 3)."""
    force, moment = np.broadcast_arrays(*load)
    terms = tip.gauge(UP, radius, apart) @ np.concatenate([force, moment]).swapaxes(0, 1)
    return np.asarray(np.maximum(shares(terms.swapaxes(1, 2)).max(axis=-1), 0.0))
