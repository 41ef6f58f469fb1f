"""Analysis of a factory's pace by its timed net: cycle time, bottlenecks, sensitivities."""

from factory.study.analysis.analysing import Analysis, analyse
from factory.timing.timing import Change, Timing

__all__ = ["Analysis", "Change", "Timing", "analyse"]
