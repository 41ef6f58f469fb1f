"""How a product is turned and stood before its tree is sought: as drawn, unless it would tip, or
its parts come along no axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.geometry.meshes import Array
from factory.nets.verdict import listing
from factory.planning.blocking import Blocking
from factory.planning.cannot import Direction, Interlock, interlocks, named
from factory.planning.parts import InPlace
from factory.planning.standing import TIPS, overhang
from factory.planning.turning import only, turned, turns
from factory.support.errors import Diagnostic, InputError

AS_DRAWN: Direction = (2, +1)
"""z is up."""

SIDES = tuple((axis, side) for axis in (2, 0, 1) for side in (+1, -1))
"""All six directions along the axes, z first."""


@dataclass(frozen=True)
class Pose:
    """A product turned by `turn` (3, 3), the axis and side of the turned one that are `up`, and
    what is in the way then; `stuck`: what still interlocks; `needs`: the directions (3,) of the
    file in which parts with these labels would come apart, where no turn has all of these along
    axes; `tips`: how far its centre of mass is beyond what it stands on [m]."""

    source: InPlace
    turn: Array
    up: Direction
    found: Blocking = field(repr=False)
    stuck: tuple[Interlock, ...] = ()
    needs: tuple[tuple[tuple[str, ...], Array], ...] = ()
    tips: float = 0.0


def posed(
    source: InPlace, found: Blocking, up: Direction | None, graph: Callable[[InPlace], Blocking]
) -> Pose:
    """The pose in which a source is planned; `found` is what is in the way as it was drawn, `graph`
    finds that of others. Raises InputError (Usage) where it tips if `up` is up."""
    drawn = up or AS_DRAWN
    tips = overhang(source.parts, along(drawn))
    if up is not None and tips > TIPS:
        message = f"the product tips over if {named(up)} is up: {_beyond(tips)}"
        raise InputError(Diagnostic("Usage", message, None, "leave out --up, or choose another"))
    stuck = interlocks(found)
    first = Pose(source, np.eye(3), drawn, found, stuck, tips=tips)
    if not stuck and tips <= TIPS:
        return first
    if not stuck:
        side = min(SIDES, key=lambda side: overhang(source.parts, along(side)))
        if overhang(source.parts, along(side)) <= TIPS:
            return Pose(source, np.eye(3), side, found)
    needs: dict[tuple[str, ...], Array] = {}
    for turn, way in _candidates(source, stuck, along(drawn), up is None):
        free = [_freed(source, one, turn, graph) for one in stuck]
        for labels in filter(None, free):
            needs.setdefault(labels, way)
        if all(labels == one.labels for labels, one in zip(free, stuck, strict=True)):
            pose = _in(turned(source, turn), turn, drawn, up is None, graph)
            if not pose.stuck and pose.tips <= TIPS:
                return pose
    return Pose(source, np.eye(3), drawn, found, stuck, tuple(needs.items()), tips)


def _candidates(
    source: InPlace, stuck: tuple[Interlock, ...], up: Array, tilted: bool
) -> Iterator[tuple[Array, Array]]:
    """Turns, those about the vertical first."""
    labels = {label for one in stuck for label in one.labels}
    concerned = only(source, labels) if stuck else source
    yield from turns(concerned, up, tilted=False)
    if tilted:
        yield from turns(concerned, up, tilted=True)


def _freed(
    source: InPlace, one: Interlock, turn: Array, graph: Callable[[InPlace], Blocking]
) -> tuple[str, ...]:
    """Those of parts that interlock which come off the others after a turn."""
    left = interlocks(graph(turned(only(source, one.labels), turn)))
    held = {label for other in left for label in other.labels}
    return tuple(label for label in one.labels if label not in held)


def _in(
    source: InPlace,
    turn: Array,
    up: Direction,
    free: bool,
    graph: Callable[[InPlace], Blocking],
) -> Pose:
    """The pose of a turned product: with that axis up that was, unless it tips then and there is a
    choice (`free`)."""
    tips = {side: overhang(source.parts, along(side)) for side in (SIDES if free else (up,))}
    side = up if tips[up] <= TIPS else min(tips, key=tips.__getitem__)
    found = graph(source)
    return Pose(source, turn, side, found, interlocks(found), tips=tips[side])


def along(direction: Direction) -> Array:
    """A direction along an axis as a unit vector (3,)."""
    axis, side = direction
    return np.asarray(side * np.eye(3)[axis])


def in_words(way: Array) -> str:
    """A direction (3,) in words: `+x`, or `(0.71, 0.71, 0)`."""
    axis = int(np.abs(way).argmax())
    if abs(way[axis]) > 1 - 1e-9:
        return named((axis, 1 if way[axis] > 0 else -1))
    return f"({', '.join(f'{x + 0.0:.3g}' for x in np.round(way, 3))})"


def said(pose: Pose, turn: Array) -> tuple[str, ...]:
    """What is to be said of how the product stands, turned by `turn` (3, 3) in all."""
    upright = np.round(turn[2], 9)
    stands = "the product stands as it was drawn, +z up"
    if upright[2] < 1:
        stands = f"the product stands with {in_words(upright)} of the file up"
    angle = np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))
    if upright[2] == 1 and abs(angle) > 1e-6:
        stands += f", turned by {angle:.4g}° about it"
    tips = f"; it tips over there, and on each side: {_beyond(pose.tips)}"
    return (stands + (tips if pose.tips > TIPS else ""),)


def screwing(labels: Sequence[str]) -> tuple[str, ...]:
    """Which parts are driven in as screws, if any are."""
    some = f"{listing(labels, 12)} {'are driven in as screws' if len(labels) > 1 else 'is a screw'}"
    return (f"{some}, after what they clamp (--no-screws: as other parts)",) if labels else ()


def toppling(count: int) -> tuple[str, ...]:
    """That some sub-assemblies would tip over by themselves, if any do."""
    some = f"{count} sub-assemblies tip" if count > 1 else "a sub-assembly tips"
    return (f"{some} over where nothing holds it: no tree was found without",) if count else ()


def _beyond(far: float) -> str:
    return f"its centre of mass is {1e3 * far:.1f} mm beyond what it stands on"
