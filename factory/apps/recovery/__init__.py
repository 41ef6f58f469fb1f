"""Recovery: a factory goes on when operations fail and robots die (few-robots.md, sections d, 45).

    simulation = Simulation(layout, RunRequest(units=20))
    recover(simulation, Campaign((WorldFault("drop", label="part2", unit=3),)))
    run = simulation.run()

A failure is firing backwards: the marking goes to the greatest one that the factory could have been
in anyway. What physics does is detected by sensors alone; faults are the world's, and nothing tells
the supervisor of them."""

from factory.apps.recovery.faults import Campaign, Sensors, WorldFault
from factory.apps.recovery.recovery import Recovery, recover

__all__ = ["Campaign", "Recovery", "Sensors", "WorldFault", "recover"]
