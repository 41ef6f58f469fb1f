"""CSV of the joints of an arm of a cell: leg, t, x and its joints, every 8 ms of the legs of its
cycle, at the speed and acceleration of robots; into a folder, a file for every arm.

The curve is the one that is certified: a controller follows the table itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from factory.api import Layout, Pace
from factory.apps.arms.joint_table import joint_table
from factory.apps.exports.subject import Subject
from factory.support.errors import usage_error

FORMAT, TAKES, ENDING, FOLDER, OF = "joints", "cell", "csv", True, "an arm"


def export(subject: Subject) -> str | Mapping[str, bytes]:
    """The table of an arm, the first one by default, or those of a folder."""
    pace = Pace.of(subject.project.settings)
    return of_arms(subject, FORMAT, "joints.csv", lambda made, arm: joint_table(made, arm, pace))


def of_arms(
    subject: Subject, name: str, ending: str, write: Callable[[Layout, int], str]
) -> str | Mapping[str, bytes]:
    """The text about an arm, or those of a folder. Raises InputError (Usage) for a factory without
    arms, or an unknown arm.

    Args:
        subject: a project.
        name: of the format.
        ending: of the files in a folder, after the product's name and the arm's.
        write: gives the text about an arm (index) of a layout.
    """
    robots = subject.project.compiled.robots
    if not any(robot.body.first.moves for robot in robots):
        message = f"format {name} is about arms; all robots of '{subject.file}' have guidepaths"
        raise usage_error(message, "--arm six")
    layout = subject.project.layout
    arms = {robot.name: robot.index for robot in layout.factory.robots if robot.body.first.moves}
    if not subject.whole:
        return write(layout, arms[subject.choose([*arms], "arms")])
    return {
        f"{subject.stem}.{robot}.{ending}": write(layout, arm).encode()
        for robot, arm in arms.items()
    }
