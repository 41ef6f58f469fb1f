"""Mechanisms that only make the world faster, behind the interface of `stepping.py`."""
