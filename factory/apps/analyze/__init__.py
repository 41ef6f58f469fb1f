"""Analysis of a factory's pace by its timed net: cycle time, bottlenecks, sensitivities."""

from factory.apps.analyze.analysing import Analysis, analyse
from factory.engine.timing.timing import Change, Timing

__all__ = ["Analysis", "Change", "Timing", "analyse"]
