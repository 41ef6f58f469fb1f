"""Accelerations of the MuJoCo world, behind the interface of `stepping.py`."""
