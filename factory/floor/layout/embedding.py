"""Lays out a factory: the best layout found, certified, on the given floor.

Guarantees what `factory.floor.layout.clearance` proves, and carries the proof: no two robots that
are not coupled by a mode can touch, nor their payloads. All lengths are whole millimetres, so a
written model loses nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations
from math import ceil

from factory.floor.geometry.solids import Product
from factory.floor.layout.certificate import LOADS, Certificate, Fault, Region
from factory.floor.layout.clearance import certify
from factory.floor.layout.dimensions import Clearance
from factory.floor.layout.durations import Pace
from factory.floor.layout.exclusions import crowded
from factory.floor.layout.fork import NO_ARMS, forked
from factory.floor.layout.hands.choosing import Hands
from factory.floor.layout.hands.holding import held
from factory.floor.layout.layout import Layout
from factory.floor.layout.optimising import bounds, optimised
from factory.floor.layout.way import rounding_for
from factory.floor.mating.mating import judged
from factory.support.boxes import Point2, hull
from factory.support.decimals import up
from factory.support.errors import Diagnostic, RunError
from factory.theory.compiler.tees import on_stems
from factory.theory.plant.factory import Factory

AGAIN = 3
"""So often a factory is laid out again where robots have to go further."""


def lay_out(
    factory: Factory,
    product: Product,
    clearance: float = 0.02,
    floor: Point2 | None = None,
    pace: Pace | None = None,
    hands: Hands | None = None,
    draft: Layout | None = None,
) -> Layout:
    """The layout of a factory with its clearance certificate, the best found for robots of a
    `pace`, with those of `hands` that suit it, if any; `draft`: what `drafted` gave of it, if
    that is known. Raises RunError (Layout) where it does not fit a floor of the given width and
    depth, saying by how much and where, or where an operation's template asks for what cannot be
    kept clear."""
    lifted, c = judged(factory, product), Clearance(clearance, factory.carriage)
    pace = pace or Pace()
    layout = draft or drafted(lifted, product, c, pace, floor, hands)
    place, certificate, arms = on_stems(lifted)[1], None, dict[int, float]()
    for _ in range(AGAIN if hands else 0):
        certificate = certify(layout)
        further = crowded(layout, certificate) or _parted(layout, certificate)
        if not further:
            break
        assert hands is not None
        longer = dict(arms)
        for robot, travel in further.items():
            at, more = place[robot], travel - layout.guidepaths[robot].travel
            if robot in layout.stems:  # its arm gets longer, not the stem
                longer[at] = max(longer.get(at, 0.0), arms.get(at, 0.0) + more)
            else:
                hands.travels[at] = travel
        arms = longer
        layout, certificate = drafted(lifted, product, c, pace, floor, hands, arms), None
    return certified(layout, floor, certificate)


def drafted(
    factory: Factory,
    product: Product,
    c: Clearance,
    pace: Pace,
    floor: Point2 | None,
    hands: Hands | None,
    arms: Mapping[int, float] = NO_ARMS,
) -> Layout:
    """The best layout found of a factory whose inputs can come together, before it is certified;
    `arms` as in `forked`. Raises RunError (Layout) where there is no room for a tee."""
    stems, place = on_stems(factory)
    layout = optimised(stems, product, c, pace, floor, (), hands)
    if stems is factory:
        return layout
    return forked(layout, factory, place, rounding_for(pace.speed, pace.acceleration), arms)


def _parted(layout: Layout, certificate: Certificate) -> dict[int, float]:
    """Least travels of robots, so that what waits with its payload at a point of delivery is clear
    of all that passes: of two robots that are too near, the one that needs less [m]."""
    carried, travels = [r for r in certificate.regions if r.kind in LOADS], dict[int, float]()
    for fault in certificate.faults:
        pair = [r.index for r in layout.factory.robots if r.name in fault.robots]
        ways = list[tuple[float, int]]()
        stem = len(pair) == 2 and layout.share_stem(*pair)
        for robot, other in permutations(pair) if len(pair) == 2 and not stem else ():
            path = layout.guidepaths[robot]
            loads = [r.box for r in carried if r.robot == robot and not r.is_coupled]
            passing = [r.box for r in carried if r.robot == other]
            if loads and passing:
                further = path.frame(hull(loads))[1] - path.frame(hull(passing))[0]
                ways.append((further + layout.clearance, robot))
        further, longer = min((way for way in ways if way[0] > 0), default=(0.0, -1))
        if further:
            travel = up(layout.guidepaths[longer].travel + further)
            travels[longer] = max(travel, travels.get(longer, 0.0))
    return travels


def certified(
    layout: Layout, floor: Point2 | None = None, certificate: Certificate | None = None
) -> Layout:
    """A layout with its certificate and the floor it takes.

    Args:
        layout: the layout.
        floor: width and depth that it may take [m]; None for any.
        certificate: its certificate; None to compute it.

    Raises RunError (Layout) where the certificate does not hold or the floor is too small.
    """
    certificate = certificate or certify(layout)
    if not certificate.holds:
        raise RunError(dict.fromkeys(_reason(layout, fault) for fault in certificate.faults))
    around = bounds(certificate.regions, layout.clearance)
    layout = replace(layout, floor=around, certificate=certificate)
    if floor is not None:
        _check_floor(layout, certificate.regions, floor)
    return layout


def _reason(layout: Layout, fault: Fault) -> Diagnostic:
    """The error of a fault. Where a robot of it has no hand, that is the reason: what it brings is
    attached, and nobody waits for its way home."""
    factory = layout.factory
    for robot in factory.robots:
        hand = layout.hand(robot.index)
        if robot.name in fault.robots and hand is not None and not hand.kind.holds:
            label = held(factory, robot.index).partition("@")[0]
            message = f"no hand can hold '{label}', and robots without hands meet here"
            hint = (
                f"{', '.join(fault.robots)}: `factory check --clashes DIR` draws the nearest miss"
            )
            made = factory.by_label.get(label)
            return Diagnostic("NoGrip", message, made.position if made else None, hint)
    return fault.diagnostic()


def _check_floor(layout: Layout, occupied: tuple[Region, ...], wanted: Point2) -> None:
    xlo, xhi, ylo, yhi = layout.floor
    size = (xhi - xlo, yhi - ylo)
    if size[0] <= wanted[0] and size[1] <= wanted[1]:
        return
    excess = "; ".join(
        f"{size[i] - wanted[i]:.3f} m too {word}, from {_at_edge(layout, occupied, 2 * i)}"
        f" to {_at_edge(layout, occupied, 2 * i + 1)}"
        for i, word in ((0, "wide (along the output robot's path)"), (1, "deep (across it)"))
        if size[i] > wanted[i]
    )
    message = f"the factory takes {size[0]:.3f} x {size[1]:.3f} m of floor: {excess}"
    longest = max(range(len(layout.guidepaths)), key=lambda i: layout.guidepaths[i].length)
    robot = layout.factory.robots[longest]
    fits = "x".join(f"{ceil(length * 100 - 1e-6) / 100:g}" for length in size)
    hint = (
        f"it fits --floor {fits}; the longest guidepath is that of {robot.name}"
        f" ({layout.guidepaths[longest].length:.3f} m)"
    )
    raise RunError(Diagnostic("Layout", message, robot.position, hint))


def _at_edge(layout: Layout, occupied: tuple[Region, ...], edge: int) -> str:
    """The region that reaches farthest at one edge of the floor, in words."""
    outwards = 1 if edge % 2 else -1
    return max(occupied, key=lambda r: outwards * r.box[edge]).named(layout.factory)
