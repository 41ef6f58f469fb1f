"""Programs of the arms of a cell, to be read: movej and movel with joint values, waits and outputs,
in the words of URScript; into a folder, a file for every arm."""

from __future__ import annotations

from collections.abc import Mapping

from factory.api import LayoutMachines
from factory.apps.arms.program_text import program_text
from factory.apps.exports.joints import of_arms
from factory.apps.exports.subject import Subject

FORMAT, TAKES, ENDING, FOLDER, OF = "arm-program", "cell", "txt", True, "an arm"


def export(subject: Subject) -> str | Mapping[str, bytes]:
    """The program of an arm, the first one by default, or those of a folder."""
    return of_arms(
        subject,
        FORMAT,
        "program.txt",
        lambda layout, arm: program_text(layout, arm, LayoutMachines(layout).coordinated.orders),
    )
