"""What a factory is not told of: pushes, wrong masses, weak drives, friction, noise, delay, slow
robots.

    simulation = Simulation(layout, RunRequest(units=3))
    disturb(simulation, Push("r1/carriage", (5, 0, 0), 1.0, 0.1))
    run = simulation.run()

A disturbance changes the physics (MuJoCo) or what is sensed of it; supervisor, drives and the
figures predicted before a run know nothing of it, save for `Slowed`. Without any a run is the same
to the bit."""

from factory.apps.disturbance.acting import disturb
from factory.apps.disturbance.values import (
    Delay,
    Disturbance,
    Dragged,
    Friction,
    Gain,
    Mass,
    Noise,
    Push,
    Slowed,
)

__all__ = [
    "Delay",
    "Disturbance",
    "Dragged",
    "Friction",
    "Gain",
    "Mass",
    "Noise",
    "Push",
    "Slowed",
    "disturb",
]
