"""Accelerations of the MuJoCo world, behind the interface of `stepping.py`: `strides.py` takes many
timesteps at once, `neighbours.py` says which bodies can meet meanwhile."""
