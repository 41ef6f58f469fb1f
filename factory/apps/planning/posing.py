"""The pose in which a product is assembled: as drawn, unless it would tip over or its parts come
along no axis."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from factory.api import Diagnostic, InputError
from factory.apps.planning.blocking import Blocking
from factory.apps.planning.cannot import Direction, Interlock, interlocks, named
from factory.apps.planning.parts import InPlace
from factory.apps.planning.shanks import shank_of
from factory.apps.planning.standing import STEADY, TIPS, overhang
from factory.apps.planning.turning import only, turned, turns
from factory.support.arrays import Array
from factory.support.errors import listing

AS_DRAWN: Direction = (2, +1)
"""z is up."""

SIDES = tuple((axis, side) for axis in (2, 0, 1) for side in (+1, -1))
"""All six directions along the axes, z first."""


@dataclass(frozen=True)
class Pose:
    """A product turned by `turn` (3, 3), with its blocking `graphs`. `up`: the axis and side of the
    turned product that are upwards; `stuck`: the sets that still interlock; `needs`: the directions
    (3,) of the file in which parts with these labels could be separated, if no turn brings all of
    these along axes; `tips`: the distance of the centre of mass outside the support [m]."""

    source: InPlace
    turn: Array
    up: Direction
    graphs: Blocking = field(repr=False)
    stuck: tuple[Interlock, ...] = ()
    needs: tuple[tuple[tuple[str, ...], Array], ...] = ()
    tips: float = 0.0


def posed(
    source: InPlace,
    graphs: Blocking,
    up: Direction | None,
    graphs_of: Callable[[InPlace], Blocking],
    screws: Sequence[str] = (),
) -> Pose:
    """The pose in which a source is planned. `graphs`: its blocking graphs as it was drawn;
    `graphs_of` computes those of another pose; `screws`: the units that are driven in, from above
    if the product can stand so and few of them come from above as it is drawn. Raises InputError
    (Usage) if the product tips over with `up` upwards."""
    drawn = up or _for_screws(source, screws)
    tips = overhang(source.parts, along(drawn))
    if up is not None and tips > TIPS:
        message = f"the product tips over if {named(up)} is up: {_beyond(tips)}"
        raise InputError(Diagnostic("Usage", message, None, "leave out --up, or choose another"))
    stuck = interlocks(graphs)
    first = Pose(source, np.eye(3), drawn, graphs, stuck, tips=tips)
    if not stuck and tips <= TIPS:
        return first
    if not stuck:
        side = min(SIDES, key=lambda side: overhang(source.parts, along(side)))
        if overhang(source.parts, along(side)) <= TIPS:
            return Pose(source, np.eye(3), side, graphs)
    needs: dict[tuple[str, ...], Array] = {}
    concerned = only(source, {x for one in stuck for x in one.labels}) if stuck else source
    about = (False,) if up is not None else (False, True)  # the vertical first
    for turn, way in (pair for tilted in about for pair in turns(concerned, along(drawn), tilted)):
        free = [_freed(source, one, turn, graphs_of) for one in stuck]
        for labels in filter(None, free):
            needs.setdefault(labels, way)
        if all(labels == one.labels for labels, one in zip(free, stuck, strict=True)):
            pose = _in(turned(source, turn), turn, drawn, up is None, graphs_of)
            if not pose.stuck and pose.tips <= TIPS:
                return pose
    return Pose(source, np.eye(3), drawn, graphs, stuck, tuple(needs.items()), tips)


def _for_screws(source: InPlace, screws: Sequence[str]) -> Direction:
    """The side up that most screws come from, if the product stands steadily then, and those that
    come from above as it is drawn are not half as many."""
    shanks = [shank_of(units[0]) for label, units in source.units() if label in screws]
    ways = Counter(shank.way for shank in shanks if shank is not None)
    if not ways:
        return AS_DRAWN
    most = max(SIDES, key=lambda side: ways[side])
    few = 2 * ways[AS_DRAWN] < ways[most]
    return most if few and overhang(source.parts, along(most), STEADY) <= 0.0 else AS_DRAWN


def _freed(
    source: InPlace, one: Interlock, turn: Array, graphs_of: Callable[[InPlace], Blocking]
) -> tuple[str, ...]:
    """The interlocked parts that can be separated from the others after a turn."""
    left = interlocks(graphs_of(turned(only(source, one.labels), turn)))
    held = {label for other in left for label in other.labels}
    return tuple(label for label in one.labels if label not in held)


def _in(
    source: InPlace,
    turn: Array,
    up: Direction,
    free: bool,
    graphs_of: Callable[[InPlace], Blocking],
) -> Pose:
    """The pose of a turned product, with the same axis upwards unless it would tip over and another
    axis may be chosen (`free`)."""
    tips = {side: overhang(source.parts, along(side)) for side in (SIDES if free else (up,))}
    side = up if tips[up] <= TIPS else min(tips, key=tips.__getitem__)
    graphs = graphs_of(source)
    return Pose(source, turn, side, graphs, interlocks(graphs), tips=tips[side])


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
    """A note on the orientation of the product, which is turned by `turn` (3, 3) in total."""
    upright = np.round(turn[2], 9)
    stands = "the product stands as it was drawn, +z up"
    if upright[2] < 1:
        stands = f"the product stands with {in_words(upright)} of the file up"
    angle = np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))
    if upright[2] == 1 and abs(angle) > 1e-6:
        stands += f", turned by {angle:.4g}° about it"
    tips = f"; it tips over on every side: {_beyond(pose.tips)}"
    return (stands + (tips if pose.tips > TIPS else ""),)


def screwing(driven: Sequence[str], screws: Sequence[str]) -> tuple[str, ...]:
    """Notes on the screws of a product: those that are driven in, and those that are joined as
    other parts."""
    notes = []
    if driven:
        some = "are driven in as screws" if len(driven) > 1 else "is driven in as a screw"
        after = f"after the parts that {'they clamp' if len(driven) > 1 else 'it clamps'}"
        notes.append(f"{listing(driven, 12)} {some}, {after} (--no-screws: ordinary parts)")
    if others := [label for label in screws if label not in driven]:
        some = "are screws and are" if len(others) > 1 else "is a screw and is"
        why = "no sub-assembly lets a driver get there from above, or along its axis"
        hint = "if the product stands on its side, --up turns it"
        notes.append(f"{listing(others, 12)} {some} not driven in: {why} ({hint})")
    return tuple(notes)


def sharing(lines: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """A note on each line of screws that share a robot and a driver."""
    words = "share the robot that brings them, and a driver ([lines] in factory.toml)"
    return tuple(f"{listing(line, 12)} {words}" for line in lines)


def loose(count: int) -> tuple[str, ...]:
    """A note on sub-assemblies whose parts do not touch each other, if there are any."""
    some = f"{count} sub-assemblies have" if count > 1 else "a sub-assembly has"
    return (f"{some} parts that touch none of its others: no tree avoids this",) if count else ()


def onto(base: str) -> str:
    """A note on the base."""
    return f"{base} is the base, onto which all others come (--base)"


def falling(count: int, every: int) -> tuple[str, ...]:
    """A note on sub-assemblies of which something would fall, if there are any."""
    some = f"{count} of {every} sub-assemblies need" if every > 1 else "the sub-assembly needs"
    return (f"{some} a hand or glue until more is there",) if count else ()


def toppling(count: int) -> tuple[str, ...]:
    """A note on sub-assemblies that would tip over by themselves, if there are any."""
    some = f"{count} sub-assemblies tip" if count > 1 else "a sub-assembly tips"
    return (f"{some} over where nothing holds it: no tree avoids this",) if count else ()


def _beyond(far: float) -> str:
    return f"its centre of mass is {1e3 * far:.1f} mm outside its support"
