"""Runs: a supervisor fires the net over a world, tick by tick.

`simulation.py` (`Simulation.run`) has the loop: the supervisor's step, hooks, observers.
`supervisor.py` starts and ends operations, and asks `ordering.py` for the waits of the coordinated
net; `distributed.py` lets each robot execute its own program instead. `world.py` is what both know
of a world: `ideal.py`, or `mujoco/`. `request.py` asks for a run, `run.py` records it.
"""
