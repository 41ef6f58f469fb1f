"""Parts of the same shape, whatever their places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from factory.support.meshes.alike import PartShape, RigidMotion, motion_between


@dataclass(frozen=True, slots=True)
class Alike:
    """The kind of each shape, as the index of the first shape of that kind, and the motion that
    maps the first to it. `twins`: the pairs of kinds that are mirror images of each other."""

    kinds: tuple[int, ...]
    motions: tuple[RigidMotion, ...]
    twins: tuple[tuple[int, int], ...]


def alike(shapes: Sequence[PartShape]) -> Alike:
    """The kinds of shapes, in the order of their first members."""
    firsts: dict[int, list[int]] = {}
    kinds: list[int] = []
    motions: list[RigidMotion] = []
    for index, shape in enumerate(shapes):
        same = firsts.setdefault(len(shape.vertices), [])
        matches = ((first, motion_between(shapes[first], shape)) for first in same)
        kind, motion = next(((k, m) for k, m in matches if m is not None), (index, RigidMotion()))
        if kind == index:
            same.append(index)
        kinds.append(kind)
        motions.append(motion)
    twins = [
        (first, other)
        for same in firsts.values()
        for number, first in enumerate(same)
        for other in same[number + 1 :]
        if motion_between(shapes[first].mirrored(), shapes[other]) is not None
    ]
    return Alike(tuple(kinds), tuple(motions), tuple(sorted(twins)))
