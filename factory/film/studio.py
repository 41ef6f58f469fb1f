"""The light of a photographer's studio: where its sun stands, and what is around.

The surroundings are a cube map (KTX) that Filament reads, each level blurred as a rougher surface
reflects it, with the light that a matt surface gets. It is made from a formula: a large soft box
above, four tall ones around, and a floor that throws light back, without which metals are black
from below.
"""

from __future__ import annotations

import struct
from functools import cache

import numpy as np
from numpy.typing import NDArray

from factory.support.arrays import Array

SIZE, LEAST = 128, 16
"""Texels along an edge of the sharpest level and of the bluntest."""

ABOVE, AROUND, WALLS, BELOW = 2.2, 2.6, 0.55, 0.85
"""How bright the soft boxes above and around are, the walls, and the floor."""

BOXES = (-150.0, -62.0, 20.0, 112.0)
"""Where the soft boxes around stand [degrees]."""

ASIDE, HIGH = 68.0, 54.0
"""Where the sun stands, so far to the left of the camera and so high that shadows fall back to the
right, and the foreground is free of them [degrees]."""

GOLDEN = 2.399963
"""The golden angle [rad], by which samples are spread."""


def sun(axes: Array) -> Array:
    """The direction to the sun (3,) where the first camera has these axes."""
    back = -axes[2] if abs(axes[2, 2]) < 0.9 else -axes[1]
    turn, high = np.arctan2(back[1], back[0]) - np.radians(ASIDE), np.radians(HIGH)
    return np.array([np.cos(high) * np.cos(turn), np.cos(high) * np.sin(turn), np.sin(high)])


def moved(direction: Array, radius: float, turn: float) -> Array:
    """A direction (3,) moved by a radius [rad], to the side that an angle says [rad]."""
    side = np.cross(direction, (0.0, 0.0, 1.0))
    side /= np.linalg.norm(side)
    other = np.cross(direction, side)
    aside = direction + radius * (np.cos(turn) * side + np.sin(turn) * other)
    return np.asarray(aside / np.linalg.norm(aside))


FACES = (
    ((0, 0, -1), (0, -1, 0), (1, 0, 0)),
    ((0, 0, 1), (0, -1, 0), (-1, 0, 0)),
    ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
    ((1, 0, 0), (0, 0, -1), (0, -1, 0)),
    ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
)
"""The faces of a cube map: right, down and ahead; y is up."""


def light(way: Array) -> Array:
    """What comes from directions (n, 3), z upwards: (n, 3), linear."""
    x, y, z = way.T
    azimuth = np.degrees(np.arctan2(y, x))
    value = np.where(z > 0, WALLS + 0.25 * z, WALLS + (BELOW - WALLS) * _step(0.0, 0.15, -z))
    value = value + ABOVE * _step(0.62, 0.80, z)
    for at in BOXES:
        off = np.abs((azimuth - at + 180) % 360 - 180)
        value = value + AROUND * _step(17, 11, off) * _step(0.10, 0.2, z) * _step(0.62, 0.52, z)
    cool = np.clip(z, -1, 1)[:, None] * np.array([-0.015, 0.0, 0.03])
    return np.asarray(value[:, None] * (np.array([1.0, 0.995, 0.985]) + cool))


def _step(low: float, high: float, at: Array) -> Array:
    """A smooth step from 0 to 1 between two places."""
    share = np.clip((at - low) / (high - low), 0.0, 1.0)
    return np.asarray(share * share * (3 - 2 * share))


def _env(way: Array) -> Array:
    """The light from directions of the cube map: its y is up, its z towards -y."""
    return light(np.stack([way[:, 0], -way[:, 2], way[:, 1]], axis=1))


@cache
def environment() -> bytes:
    """The KTX file."""
    levels = int(np.log2(SIZE / LEAST)) + 1
    words = "".join("{:.6g} {:.6g} {:.6g}\n".format(*row) for row in _harmonics())
    pair = b"sh\0" + words.encode() + b"\0"
    pair = struct.pack("<I", len(pair)) + pair + bytes(-len(pair) % 4)
    kind = 0x8C3A  # three floats of 11, 11 and 10 bits
    head = (0x04030201, kind, 1, 0x1907, kind, kind, SIZE, SIZE, 0, 0, 6, levels, len(pair))
    out = b"\xabKTX 11\xbb\r\n\x1a\n" + struct.pack("<13I", *head) + pair
    for level in range(levels):
        size, rough = SIZE >> level, 1 - (1 - level / (levels - 1)) ** 0.5
        texels = _packed(_blurred(size, rough))
        out += struct.pack("<I", 4 * size * size) + texels.astype("<u4").tobytes()
    return out


def _ways(size: int) -> Array:
    """The directions of the texels of all faces (6 size size, 3)."""
    at = (np.arange(size) + 0.5) / size * 2 - 1
    u, v = np.meshgrid(at, at)
    rows = [u[..., None] * np.array(r) + v[..., None] * np.array(d) + f for r, d, f in FACES]
    ways = np.array(rows).reshape(-1, 3)
    return np.asarray(ways / np.linalg.norm(ways, axis=1, keepdims=True))


def _blurred(size: int, rough: float, samples: int = 160) -> Array:
    """What a surface so rough, by its perceptual roughness, reflects (6 size size, 3)."""
    ways = _ways(size)
    if rough == 0.0:
        return _env(ways)
    u = (np.arange(samples) + 0.5) / samples
    turn = GOLDEN * np.arange(samples)
    c = np.sqrt((1 - u) / (1 + (rough**4 - 1) * u))
    s = np.sqrt(1 - c * c)
    half = np.stack([s * np.cos(turn), s * np.sin(turn), c], axis=1)
    to = 2 * half[:, 2:] * half - (0, 0, 1)
    to = to[to[:, 2] > 0]
    side = np.cross(np.where(np.abs(ways[:, 2:]) < 0.99, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)), ways)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other, total = np.cross(ways, side), np.zeros_like(ways)
    for x, y, z in to:
        total += z * _env(x * side + y * other + z * ways)
    return np.asarray(total / to[:, 2].sum(), float)


def _harmonics() -> Array:
    """Irradiance over pi as the nine terms that the shader sums."""
    size = 32
    at = (np.arange(size) + 0.5) / size * 2 - 1
    u, v = np.meshgrid(at, at)
    solid = np.tile(((1 + u * u + v * v) ** -1.5).ravel() * (2 / size) ** 2, 6)
    ways, normals = _ways(size), _ways(8)
    gets = np.maximum(normals @ ways.T, 0) @ (_env(ways) * solid[:, None]) / np.pi
    x, y, z = normals.T
    terms = [np.ones_like(x), y, z, x, y * x, y * z, 3 * z * z - 1, z * x, x * x - y * y]
    return np.asarray(np.linalg.lstsq(np.stack(terms, axis=1), gets, rcond=None)[0])


def _packed(values: Array) -> NDArray[np.uint32]:
    """Colours (n, 3) as floats of 11, 11 and 10 bits in one word each."""
    bits = np.clip(values, 0, 6e4).astype(np.float16).view(np.uint16).astype(np.uint32)
    rounded = (0, 8, 4), (1, 8, 4), (2, 16, 5)
    red, green, blue = (bits[:, k] + half >> shift for k, half, shift in rounded)
    return np.asarray(red | green << 11 | blue << 22)
