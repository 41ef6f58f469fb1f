"""The Pareto front of a product in robots, cycle time and floor area; each point is a factory."""

from factory.apps.pareto.front import FrontPoint, ParetoFront
from factory.apps.pareto.sweeping import Effort, FrontSweep, pareto

__all__ = ["Effort", "FrontPoint", "FrontSweep", "ParetoFront", "pareto"]
