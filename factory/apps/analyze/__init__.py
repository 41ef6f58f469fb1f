"""Analysis of a factory's pace by its timed net: cycle time, bottlenecks, sensitivities."""

from factory.api import Timing
from factory.apps.analyze.analysing import Analysis, analyse
from factory.engine.timing.timing import Change

__all__ = ["Analysis", "Change", "Timing", "analyse"]
