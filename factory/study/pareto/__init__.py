"""The front of a product: what can be had in robots, cycle time and floor, each point a factory."""

from factory.study.pareto.front import FrontPoint, ParetoFront
from factory.study.pareto.sweeping import Effort, FrontSweep, pareto

__all__ = ["Effort", "FrontPoint", "FrontSweep", "ParetoFront", "pareto"]
