"""The engine's timestep: the longest with which drives stay on their references.

A reference changes its acceleration at once. In the step in which it does, a drive is told the
speed of half a step before with the new acceleration, and pushes for the new one: it gets a wrong
speed, which it then takes away. How far off it gets meanwhile is what is predicted. Hands that meet
are no farther apart, and welds give no more, than two drives are off (docs/decisions/timestep.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

from factory.control.profile import World
from factory.layout.layout import Layout
from factory.mjcf.model import (
    CARRIAGE_MASS,
    GRAVITY,
    HEAD_MASS,
    HOIST_MASS,
    HOIST_STIFFNESS,
    ROLLING,
    STIFFNESS,
    drive_for,
    heaviest,
    lifted,
)
from factory.mjcf.outfeed import TRAY_MASS
from factory.mjcf.stops import OVERLOAD, tray_clearance
from factory.support.settings import AUTO, TICK, Settings

STEPS = (1, 2, 4, 5, 10, 20)
"""So many timesteps may a tick have: 10, 5, 2.5, 2, 1 or 0.5 ms each."""

USUAL = 5
"""Timesteps of a tick where none is good, or there are no drives: 2 ms."""

ALLOWED = 0.5e-3
"""Half of what a good factory keeps of tracking errors, gaps and residuals (`fidelity`) [m]."""

FRICTION = 0.2
"""Dry friction of the axes of all robots (`mjcf/`) and of the tray, without a load [N]."""

SLACK = 0.3
"""Share of a lift's weight that its drive must hold without having been told: drives that are a
third stronger or weaker, and parts half as heavy again, are survived (docs/fidelity.md)."""

DIP, DEEPEST = 1.9e-5, 2.5e-4
"""So far [m] a part is below where a slider is to bring it as a hand comes there, for each kg and
each m/s² of the slider, in timesteps of a tick, measured; and it may be so far: a pad then presses
on it by half as much as it may."""

CRUISES = 0.7
"""The tray's share of a jump by twice its acceleration: between gaining speed and braking it goes
at one speed for a while (`layout/outfeed.py`)."""

SURE = 1.25
"""Measured errors are up to so many times the formula's: 630 random runs at 10 ms."""


@dataclass(frozen=True, slots=True)
class DrivenAxis:
    """What a drive moves: its `own` mass and a `load` [kg], with an `acceleration` [m/s²] that
    changes by up to twice its amount, times `jump`, at once; `push` [m/s²] is what its force is
    for; its `stiffness` [rad/s] and the least `gain` that jitter draws for it; `held`: what it must
    push against untold [N]; `room`: how far its end stops may let it go [m]."""

    own: float
    load: float
    acceleration: float
    push: float
    stiffness: float
    gain: float
    jump: float = 1.0
    held: float = 2 * FRICTION
    room: float = inf

    @classmethod
    def loaded(cls, mass: float, load: float, acceleration: float, **more: float) -> DrivenAxis:
        """One whose guide bears its load, and which pushes for its acceleration alone."""
        held = 2 * (FRICTION + ROLLING * load * GRAVITY)
        return cls(mass, load, acceleration, acceleration, STIFFNESS, held=held, **more)

    def error(self, settings: Settings) -> float:
        """How far it may get off its reference [m]: the speed that it misses, times the peak of a
        drive's answer to a speed of 1, and how far it is held off."""
        drive = drive_for(self.own, self.load, self.push, settings, self.stiffness)
        mass, h = self.own + drive.inertia + self.load, settings.step
        stiff, damping = self.gain * drive.kp / mass, self.gain * drive.kv / mass
        missed = self.jump * self.acceleration * h * abs(1 - damping * h)
        return SURE * (missed / (sqrt(stiff) + 0.85 * damping) + self.rest(settings))

    def leap(self, settings: Settings) -> float:
        """How far it goes from rest in the step in which it meets the buffer of its stop [m], when
        it is empty and under all that a stop withstands."""
        drive = drive_for(self.own, self.load, self.push, settings, self.stiffness)
        force = (1 + OVERLOAD) * drive.force
        return force / (self.own + drive.inertia) * settings.step**2

    def rest(self, settings: Settings) -> float:
        """How far off its reference it may be held for ever [m]."""
        drive = drive_for(self.own, self.load, self.push, settings, self.stiffness)
        return self.held / (self.gain * drive.kp)


def timed(
    settings: Settings, layout: Layout, world: World = "mujoco", jitter: float = 0.0
) -> Settings:
    """Settings whose timestep and substeps are numbers: what was asked for, or with AUTO the
    longest timestep in which nothing goes as far as the certified clearance, with which no axis is
    predicted to get off its reference by more than ALLOWED, all end stops hold, and every robot
    gets into its goal ball; 2 ms, or the longest below it that the clearance allows, where none
    does that. Whether robots have hands is as the layout says."""
    settings = replace(settings, hands=int(any(layout.hands)))
    if settings.timestep != AUTO:
        return replace(settings, substeps=settings.steps)
    least = settings.substeps or 1
    counts = [n for n in STEPS if n >= least] or [least]
    candidates = [replace(settings, timestep=TICK / n, substeps=n) for n in counts]
    if world == "ideal":
        return _usual(candidates)
    fastest = max(settings.speed * (1 + jitter), settings.outfeed)
    candidates = [s for s in candidates if fastest * s.step < layout.clearance] or candidates[-1:]
    axes, heaviest_fed = tuple(_axes(settings, layout, jitter)), 0.0
    if settings.hands:
        heaviest_fed = max(layout.product.solids[o.label].mass for o in layout.factory.leaves)
    good = (s for s in candidates if _good(s, axes) and _dip(s, heaviest_fed) < DEEPEST)
    return next(good, _usual(candidates))


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


def _axes(settings: Settings, layout: Layout, jitter: float) -> Iterator[DrivenAxis]:
    """Every robot, lift and the tray with the heaviest that it carries, and the shutter; those that
    are alike once."""
    room, far = layout.clearance, tray_clearance(layout)
    factory, solids, a = layout.factory, layout.product.solids, settings.acceleration
    masses: dict[str, float] = {}
    for operation in reversed(factory.making):
        inputs = [masses[label] for label in operation.inputs]
        masses[operation.label] = sum(inputs) if inputs else solids[operation.label].mass
    for load in sorted({*heaviest(layout, masses)}):
        yield DrivenAxis.loaded(CARRIAGE_MASS, load, a, gain=1 - jitter, room=room)
    for load in sorted({*lifted(layout, masses).values()}):
        held = 2 * FRICTION + SLACK * (HEAD_MASS + load) * GRAVITY
        push, stiff = a + GRAVITY, HOIST_STIFFNESS
        yield DrivenAxis(HOIST_MASS, load, a, push, stiff, 1 - jitter, held=held, room=room)
    fast = settings.outfeed_acceleration
    product = max(masses[label] for label in factory.products)
    yield DrivenAxis.loaded(TRAY_MASS, product, fast, gain=1.0, jump=CRUISES, room=far)
    shut = settings.shutter_limits[1]
    yield DrivenAxis(HOIST_MASS, 0.0, shut, shut + GRAVITY, HOIST_STIFFNESS, gain=1.0)
