"""Control: navigation functions in arc length, the table of control laws, and the times they take.

`Mode` is one operation's law, `Bundle` evaluates the fields of all active modes at once, `follow`
moves a reference by them within the acceleration limits, `mode_time` predicts.
"""

from factory.control.governor import follow, govern
from factory.control.laws import LAWS, Setting, mode_of
from factory.control.mode import Limits, Mode
from factory.control.navigation import Bundle
from factory.control.profile import ideal_time, mode_time, staged_time, trapezoid_time

__all__ = [
    "LAWS",
    "Bundle",
    "Limits",
    "Mode",
    "Setting",
    "follow",
    "govern",
    "ideal_time",
    "mode_of",
    "mode_time",
    "staged_time",
    "trapezoid_time",
]
