"""Deviations: what goes wrong in a run, faults and disturbances alike, as one list of values.

    simulation = Simulation(layout, RunRequest(units=3))
    deviate(simulation, Deviation("mass", factor=1.2), Deviation("slow", robot="r3", factor=0.5))
    run = simulation.run()

The supervisor, the drives and the figures predicted before a run know nothing of them. Without any
a run is the same to the bit. `recover` (apps/recovery) does the same in a factory that continues
after failures, where every kind may occur; `deviate` takes those after which nothing need be
repaired.

`deviation.py` has the catalogue (`KINDS`, of the `DeviationKind` in `kind.py`), `injector.py` says
when one strikes, `effects.py` (`EFFECTS`) what it does, by the methods of `condition.py`;
disturbances act through `interference.py` and `pushes.py`. `campaign.py` is the value of a file of
them, which `campaign_file.py` reads.
"""

from factory.apps.deviations.campaign import Campaign, Sensors
from factory.apps.deviations.deviation import KINDS, Deviation
from factory.apps.deviations.injector import FaultInjector, deviate

__all__ = ["KINDS", "Campaign", "Deviation", "FaultInjector", "Sensors", "deviate"]
