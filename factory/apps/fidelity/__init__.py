"""Fidelity: figures of how close MuJoCo is to the ideal world, from runs in both over the same
seeds.

    >>> from factory.apps.fidelity import QUANTITIES
    >>> QUANTITIES["handoff_gap_max_mm"].unit
    'mm'

`measure(layout, ...)` gives a `record.Fidelity`, `measure_seed` one seed of it. The definitions of
all figures are in `record`.
"""

from factory.apps.fidelity.comparing import measure, measure_seed
from factory.apps.fidelity.record import QUANTITIES, SeedRecord

__all__ = ["QUANTITIES", "SeedRecord", "measure", "measure_seed"]
