"""Recovery: a factory continues when operations fail and robots die.

    simulation = Simulation(layout, RunRequest(units=20, recovers=True))
    recover(simulation, Campaign((Deviation("drop", label="part2", unit=3),)))
    run = simulation.run()

A failure is firing backwards: the marking goes to the greatest one that the factory could have been
in anyway. What physics does is detected by sensors alone; deviations (apps/deviations) are the
world's, and nothing tells the supervisor of them.

`recovery.py` makes failures of what sensors report, and `responding.py` responds: `undo.py` gives
the marking to continue from, `returning.py` and `standing.py` move robots or stop them,
`wasting.py` says where scrap goes. `plant.py` is the interface to a world, with the faults of its
bodies, its sensors and its responses; `ideal.py` and `mujoco/` implement it.
"""

from factory.apps.recovery.recovery import Recovery, recover

__all__ = ["Recovery", "recover"]
