"""IEC 61131-3 Structured Text: a function block for each robot, the program that calls them, and
the configuration of a task that runs it.

The blocks are the programs of `run --distributed` with set-points instead of the navigation
function: gates of a mode are kept, the motion itself is left to the drives.
"""

from __future__ import annotations

from factory.apps.exports.iec.cell import declarations
from factory.apps.exports.iec.structured_text import write
from factory.apps.exports.subject import Subject

FORMAT, TAKES, OF = "st", "pag", "the scan time of the task, 10ms by default"


def export(subject: Subject) -> str:
    """The programs of all robots. Raises InputError where a mode cannot be entered."""
    return write(declarations(subject))
