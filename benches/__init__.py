"""Benches and campaigns: what is measured, not what is tested.

`benches.speed` has times and sizes, `benches.fidelity` the accuracy of the physics, and
`benches.faults` what becomes of factories in which things go wrong. `python -m benches.NAME
[SECTION ...]` measures and writes a page of the documentation; with `--write` it measures nothing.
"""
