"""How fast a factory is, what sets its pace and what would change it, from its timed net."""

from factory.study.analysis.analysing import Analysis, analyse
from factory.timing.timing import Change, Timing

__all__ = ["Analysis", "Change", "Timing", "analyse"]
