"""Recovery: a factory continues when operations fail and robots die.

    simulation = Simulation(layout, RunRequest(units=20, recovers=True))
    recover(simulation, Campaign((Deviation("drop", label="part2", unit=3),)))
    run = simulation.run()

A failure is firing backwards: the marking goes to the greatest one that the factory could have been
in anyway. What physics does is detected by sensors alone; deviations (apps/deviations) are the
world's, and nothing tells the supervisor of them."""

from factory.apps.recovery.recovery import Recovery, recover

__all__ = ["Recovery", "recover"]
