"""The engine's timestep: the longest with which drives stay on their references.

A reference changes its acceleration at once. In the step in which it does, a drive is told the
speed of half a step before with the new acceleration, and pushes for the new one: it gets a wrong
speed, which it then takes away. How far off it gets meanwhile is what is predicted. Hands that meet
are no farther apart, and welds give no more, than two drives are off (docs/decisions/timestep.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import radians

import numpy as np

from factory.engine.mjcf.driving import (
    ALLOWED,
    GRAVITY,
    HOIST_STIFFNESS,
    STEPS,
    DrivenAxis,
    driven,
    heaviest,
    weights_of,
)
from factory.engine.mjcf.outfeed import SHUTTER_MASS, TRAY_MASS
from factory.engine.mjcf.robots import MOTOR
from factory.engine.mjcf.stops import tray_clearance
from factory.floor.layout.layout import Layout
from factory.support.bounds import WorldName
from factory.support.settings import AUTO, TICK, Settings
from factory.theory.plant.axes import Axis

USUAL = 5
"""Timesteps of a tick where none is good, or there are no drives: 2 ms."""

DIP, DEEPEST = 1.9e-5, 2.5e-4
"""So far [m] a part is below where a slider is to bring it as a hand comes there, for each kg and
each m/s² of the slider, in timesteps of a tick, measured; and it may be so far: a pad then presses
on it by half as much as it may."""

IMPACT, LEFT, TURNED = 0.46, 0.53, radians(0.1)
"""A part that meets another beside its middle is turned by at most IMPACT × a h² over half its
diagonal; of that a weld leaves the share LEFT in each timestep of the tick until it changes hands,
turned by at most TURNED [rad] (docs/decisions/timestep.md)."""

CRUISES = 0.7
"""The tray's share of a jump by twice its acceleration: between gaining speed and braking it goes
at one speed for a while (`layout/outfeed.py`)."""


def timed(
    settings: Settings, layout: Layout, world: WorldName = "mujoco", jitter: float = 0.0
) -> Settings:
    """Settings whose timestep and substeps are numbers: what was asked for, or with AUTO the
    longest timestep in which nothing goes as far as the certified clearance, with which no axis is
    predicted to get off its reference by more than ALLOWED and no part to be turned by more than
    TURNED, all end stops hold, and every robot gets into its goal ball; 2 ms, or the longest below
    it that the clearance allows, where none does that."""
    if settings.timestep != AUTO:
        return replace(settings, substeps=settings.steps)
    lowest = settings.substeps or 1
    counts = [n for n in STEPS if n >= lowest] or [lowest]
    candidates = [replace(settings, timestep=TICK / n, substeps=n) for n in counts]
    if world == "ideal":
        return _usual(candidates)
    fastest = max(settings.speed * (1 + jitter), settings.outfeed)
    candidates = [s for s in candidates if fastest * s.step < layout.clearance] or candidates[-1:]
    if layout.chains is not None:
        return next((s for s in candidates if s.step <= layout.chains.timestep), candidates[-1])
    axes = tuple(dict.fromkeys(_axes(settings, layout, jitter)))
    unusual = [axis for axis in axes if not axis.usual]
    candidates = [s for s in candidates if all(a.follows(s) for a in unusual)] or candidates[-1:]
    solids = [layout.product.solids[o.label] for o in layout.factory.leaves]
    fed = max(solid.mass for solid in solids) if any(layout.hands) else 0.0
    least = min(float(np.linalg.norm(solid.high - solid.low)) for solid in solids)
    calm = (s for s in candidates if _dip(s, fed) < DEEPEST and _impact(s, least) < TURNED)
    return next((s for s in calm if _good(s, axes)), _usual(candidates))


def _usual(candidates: Sequence[Settings]) -> Settings:
    """Those with the usual timestep, or the next shorter one that there is."""
    return next(s for s in candidates if s.steps >= USUAL)


def _good(settings: Settings, axes: Sequence[DrivenAxis]) -> bool:
    """Whether no error is beyond what is allowed, every end stop holds, and no axis is kept out of
    its goal ball, but for one that is kept out with the usual timestep as well."""
    usual = replace(settings, timestep=TICK / USUAL, substeps=USUAL)
    return all(
        axis.error(settings) < ALLOWED
        and axis.leap(settings) < axis.room
        and axis.rest(settings) <= max(settings.eps, axis.rest(usual))
        for axis in axes
    )


def _dip(settings: Settings, load: float) -> float:
    """How far a part is below where its feeder is to bring it, as a hand comes there [m]."""
    return DIP * load * settings.feeder_limits[1] * (settings.step / TICK) ** 3


def _impact(settings: Settings, across: float) -> float:
    """How far a part of a diagonal [m] is turned [rad] where it changes hands after it met
    another."""
    turned = IMPACT * settings.acceleration * settings.step**2 / (across / 2)
    return turned * float(LEFT ** (TICK / settings.step))


def _axes(settings: Settings, layout: Layout, jitter: float) -> Iterator[DrivenAxis]:
    """Every axis of robots and the tray with the heaviest that it carries, and the shutter."""
    room, far = layout.clearance, tray_clearance(layout)
    masses = weights_of(layout)
    for axis, load in zip(layout.factory.axes, heaviest(layout, masses), strict=True):
        yield replace(_carried(axis, load, settings), gain=1 - jitter, room=room)
    fast = settings.outfeed_acceleration
    product = max(masses[label] for label in layout.factory.products)
    yield DrivenAxis.loaded(TRAY_MASS, product, fast, far, jump=CRUISES)
    shut = settings.shutter_limits[1]
    yield DrivenAxis(SHUTTER_MASS + MOTOR, 0.0, shut, shut + GRAVITY, HOIST_STIFFNESS)


def _carried(axis: Axis, load: float, settings: Settings) -> DrivenAxis:
    """An axis of a robot with its load; one that turns bears its payload as a carriage does."""
    if axis.motion.rotary:
        return DrivenAxis.loaded(axis.robot.body.mass, load, settings.acceleration)
    return driven(axis.joint, load, settings)
