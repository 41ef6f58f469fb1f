"""Drives: what each moves, and the gains and force that it has for that.

The drive of a robot is sized for its heaviest payload, unless its type has gains of its own; it is
never stronger than the motor of its type.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, sqrt

from factory.engine.mjcf.robots import Drive
from factory.engine.mjcf.stops import OVERLOAD
from factory.engine.mjcf.tools import GYRATION, gyration
from factory.floor.layout.layout import Layout
from factory.support.errors import Diagnostic, InputError
from factory.support.settings import AUTO, TICK, Settings
from factory.theory.plant.axes import Axis
from factory.theory.problem.robot_bodies import FRICTION, RobotAxis

STIFFNESS = 70.0
"""Natural frequency of a robot's position loop at full payload [rad/s]."""

HOIST_STIFFNESS = 200.0
"""The same of a lift's, which holds a weight: half a payload unaccounted for lets it sag by 0.1
mm [rad/s]."""

PUSHED, DAMPED = 0.4, 0.8
"""In a timestep a drive that carries nothing takes at most such shares of an offset and of a speed
away: it is explicit, overshoots at 1, and is unstable where the first and twice the second are 4.
With a long timestep it is less stiff for that."""

LEAST = 0.5
"""What moves a payload weighs at least this share of it: a weld is as stiff as the lighter of its
bodies is heavy, and a heavy payload would swing on it. A motor's inertia makes up for what is
missing."""

STEPS = (1, 2, 4, 5, 10, 20)
"""So many timesteps may a tick have: 10, 5, 2.5, 2, 1 or 0.5 ms each."""

ALLOWED = 0.5e-3
"""Half of what a good factory keeps of tracking errors, gaps and residuals (`fidelity`) [m]."""

GRAVITY = 9.81
"""[m/s²]; the engine's own."""

ROLLING = 0.003
"""Friction of a carriage's and the tray's guide, as a share of the weight that it bears: that of a
profile rail with balls (docs/decisions/guides.md)."""

SLACK = 0.3
"""Share of a lift's weight that its drive must hold without having been told: drives that are a
third stronger or weaker, and parts half as heavy again, are survived (docs/fidelity.md)."""

SURE = 1.25
"""Measured errors are up to so many times the formula's: 630 random runs at 10 ms."""

RESERVE = 1.5
"""A motor gives at least so many times the force that its robot's acceleration takes."""

SETTLED = 0.7
"""Least damping ratio of gains that a type has of its own: with less a robot swings at its goal."""


@dataclass(frozen=True, slots=True)
class DrivenAxis:
    """What a drive moves, and how.

    Attributes:
        own: mass that moves without a load [kg].
        load: mass of the load [kg].
        acceleration: its acceleration, which changes by up to twice its amount, times `jump`,
            at once [m/s²].
        push: the acceleration that its force is for [m/s²].
        stiffness: its stiffness [rad/s].
        gain: the least gain that jitter draws for it.
        jump: see `acceleration`.
        held: force against which it must push untold [N].
        room: how far its end stops may let it go [m].
        motor: the axis of the robot type; None of a station.
    """

    own: float
    load: float
    acceleration: float
    push: float
    stiffness: float
    gain: float = 1.0
    jump: float = 1.0
    held: float = 2 * FRICTION
    room: float = inf
    motor: RobotAxis | None = None

    @classmethod
    def loaded(
        cls,
        mass: float,
        load: float,
        acceleration: float,
        room: float = inf,
        gain: float = 1.0,
        jump: float = 1.0,
    ) -> DrivenAxis:
        """A station's whose guide bears its load, and which pushes for its acceleration alone."""
        held = 2 * (FRICTION + ROLLING * load * GRAVITY)
        return cls(mass, load, acceleration, acceleration, STIFFNESS, gain, jump, held, room)

    def drive(self, settings: Settings) -> Drive:
        """Its drive."""
        sized = drive_for(self.own, self.load, self.push, settings, self.stiffness)
        if self.motor is None:
            return sized
        if self.motor.kp is not None and self.motor.kv is not None:
            sized = replace(sized, kp=self.motor.kp, kv=self.motor.kv)
        return replace(sized, force=min(sized.force, self.motor.force))

    def error(self, settings: Settings) -> float:
        """How far it may get off its reference [m]: the speed that it misses, times the peak of a
        drive's answer to a speed of 1, and how far it is held off."""
        drive, h = self.drive(settings), settings.step
        mass = self.own + drive.inertia + self.load
        stiff, damping = self.gain * drive.kp / mass, self.gain * drive.kv / mass
        missed = self.jump * self.acceleration * h * abs(1 - damping * h)
        return SURE * (missed / (sqrt(stiff) + 0.85 * damping) + self.rest(settings))

    def leap(self, settings: Settings) -> float:
        """How far it goes from rest in the step in which it meets the buffer of its stop [m], when
        it is empty and under all that a stop withstands."""
        drive = self.drive(settings)
        force = (1 + OVERLOAD) * drive.force
        return force / (self.own + drive.inertia) * settings.step**2

    def rest(self, settings: Settings) -> float:
        """How far off its reference it may be held for ever [m]."""
        return self.held / (self.gain * self.drive(settings).kp)

    @property
    def usual(self) -> bool:
        """Whether its drive is sized for its load, against no more friction than usual."""
        return self.motor is None or self.motor.usual

    def follows(self, settings: Settings) -> bool:
        """Whether its gains are stable, do not swing, and keep it on its reference. The shorter the
        timestep, the sooner."""
        drive, h = self.drive(settings), settings.step
        lever = 1.0 if self.motor is None else self.motor.motion.lever
        empty, mass = self.own + drive.inertia, self.own + drive.inertia + self.load
        stable = drive.kp <= PUSHED * empty / h**2 and drive.kv <= DAMPED * empty / h
        calm = drive.kv >= 2 * SETTLED * sqrt(drive.kp * mass)
        near = lever * self.error(settings) < ALLOWED
        return stable and calm and near and lever * self.rest(settings) <= settings.eps


def drive_for(
    empty_mass: float,
    load: float,
    acceleration: float,
    settings: Settings,
    stiffness: float = STIFFNESS,
) -> Drive:
    """Critically damped gains for what moves a load, and the load [kg]; the force that their
    acceleration [m/s²] takes; the inertia that the motor adds."""
    inertia = max(0.0, LEAST * load - empty_mass)
    empty, rate = empty_mass + inertia, 1 / settings.step
    mass = empty + load
    kp = min(mass * stiffness**2, PUSHED * empty * rate**2)
    kv = min(2 * mass * stiffness, DAMPED * empty * rate)
    force = settings.force * mass * acceleration + 5
    return Drive(round(kp, 3), round(kv, 3), round(force, 3), settings.samples, round(inertia, 3))


def driven(axis: RobotAxis, load: float, settings: Settings) -> DrivenAxis:
    """What the drive of a robot's axis moves, with a load [kg]; where the axis turns, with the
    load's moment of inertia [kg m²].

    What hangs from a drive weighs on it; what a guide bears rubs there.
    """
    motion = axis.motion
    empty = axis.mass + axis.armature
    if motion.rotary:
        empty = round(GYRATION * axis.mass + axis.armature, 9)
    a, held = settings.acceleration / motion.lever, 2 * axis.friction
    if motion.rolls:
        held = 2 * (axis.friction + ROLLING * load * GRAVITY)
    if motion.hangs:
        held = 2 * axis.friction + SLACK * (axis.mass + load) * GRAVITY
    push = a + GRAVITY if motion.hangs else a
    stiffness = STIFFNESS if motion.rolls else HOIST_STIFFNESS
    return DrivenAxis(empty, load, a, push, stiffness, held=held, motor=axis)


def driven_axes(
    layout: Layout, masses: Mapping[str, float], settings: Settings
) -> list[DrivenAxis]:
    """What the drive of each axis of a factory moves, with the heaviest that it carries, by what
    labels weigh [kg]. Raises InputError (NoGrip) where a robot that turns has no hand."""
    loads = heaviest(layout, masses)
    return [
        driven(axis.joint, load * inertia_of(layout, axis), settings)
        for axis, load in zip(layout.factory.axes, loads, strict=True)
    ]


def inertia_of(layout: Layout, axis: Axis) -> float:
    """What a load of 1 kg adds to what an axis moves: 1 kg, or its moment of inertia [kg m²] where
    the axis turns. Raises InputError (NoGrip) as `gyration` does."""
    return gyration(layout, axis.robot.index) ** 2 if axis.motion.rotary else 1.0


def heaviest(layout: Layout, masses: Mapping[str, float]) -> list[float]:
    """The heaviest load of each axis [kg], by what labels weigh: what its robot carries, and
    delivers where it goes up."""
    factory = layout.factory
    carried = [
        max(
            masses.get(o.after[o.robots.index(robot.index)], 0.0)
            for o in (factory.operations[number] for number in robot.operations)
        )
        for robot in factory.robots
    ]
    robots = (axis.robot.index for axis in factory.axes[len(carried) :])
    return [*carried, *(max(map(masses.__getitem__, factory.deliveries(r))) for r in robots)]


def weights_of(layout: Layout) -> dict[str, float]:
    """What the result of each operation weighs [kg], by its label."""
    masses: dict[str, float] = {}
    for operation in reversed(layout.factory.making):
        inputs = [masses[label] for label in operation.inputs]
        solids = layout.product.solids
        masses[operation.label] = sum(inputs) if inputs else solids[operation.label].mass
    return masses


def check_drives(layout: Layout, settings: Settings) -> None:
    """Raises InputError (BadRobot) where the motor of a robot type is too weak for what a robot
    carries, or gains that the type has of its own do not keep a robot on its reference."""
    motors = {axis for robot in layout.factory.robots for axis in robot.body.axes}
    if all(motor.usual and motor.force == inf for motor in motors):
        return
    axes = driven_axes(layout, weights_of(layout), settings)
    names = (axis.robot.name for axis in layout.factory.axes)
    pairs = zip(names, axes, strict=True)
    faults = [fault for each in pairs for fault in _faults(*each, settings)]
    if faults:
        raise InputError(faults)


def _faults(name: str, axis: DrivenAxis, settings: Settings) -> Iterator[Diagnostic]:
    """What is wrong with the drive of one axis."""
    motor = axis.motor
    assert motor is not None, "it is a robot's"
    each = [settings]
    if settings.timestep == AUTO:
        each = [replace(settings, timestep=TICK / n, substeps=n) for n in STEPS]
    unit, of = ("N m", "kg m²") if motor.motion.rotary else ("N", "kg")
    carries = f"{name}, with {axis.load:.3g} {of}"
    moved = axis.drive(each[-1]).inertia + axis.own + axis.load
    needed = RESERVE * moved * axis.push + axis.held / 2
    if motor.force < needed:
        yield Diagnostic(
            "BadRobot",
            f"the motor of '{motor.joint}' gives {motor.force:g} {unit}, and {carries}, needs"
            f" {needed:.3g} {unit}",
            motor.position,
            f"valid: a forcerange from {needed:.3g} {unit}, less --acceleration, lighter parts",
        )
    if axis.usual or any(axis.follows(s) for s in each):
        return
    drive, sized = (a.drive(each[-1]) for a in (axis, replace(axis, motor=None)))
    yield Diagnostic(
        "BadRobot",
        f"kp {drive.kp:g} and kv {drive.kv:g} of '{motor.joint}' do not keep {carries}, within"
        f" {ALLOWED * 1e3:g} mm of its reference, against {motor.friction:g} {unit} of friction",
        motor.position,
        f"valid: about kp {sized.kp:g}, kv {sized.kv:g}; neither, then they are sized; less"
        " frictionloss",
    )
